"""An engine or a motor on its drive line.

The group ``excitation`` on nodes of the tables, and the steady answer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.driveline.drive_line import DriveLine, read_drive_line
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.excitation.engine import check_group, read_engine, read_wheels
from gensig.driveline.excitation.engine_torques import Engine, engine_torques
from gensig.driveline.excitation.line_torques import LineTorques
from gensig.driveline.excitation.motor import KIND, read_motor
from gensig.driveline.excitation.motor_torques import MotorDrive, motor_torques
from gensig.driveline.linear.forced import (
    Elements,
    SteadyResponse,
    closed_line,
    over_cycle,
    steady_response,
)
from gensig.driveline.linear.matrices import LineMatrices
from gensig.driveline.linear.stiffness_range import check_stiffness_range
from gensig.driveline.table_rows import told_nodes
from gensig.dynamics.linear_system import LinearSystem
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.sensing.toothed_wheel import ToothedWheel, draw_wheel, instantaneous_speed
from gensig.systems.registry import LINE

SAMPLES_PER_CYCLE = 7200  # about 100 kHz at 1688 r/min
SEEN_CYCLES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineLine:
    """A drive line and the engine that turns it.

    Degrees of freedom are the nodes, then lateral motion if any.

    ``engine`` may be a motor with its load: the crank is then the motor's shaft, the brake torque
    what the load takes.
    """

    drive: DriveLine
    engine: Engine | MotorDrive
    wheels: Mapping[str, ToothedWheel]

    @property
    def has_cycle(self) -> bool:
        """True where torques follow the cycle of an engine, False where a motor turns the line."""
        return isinstance(self.engine, Engine)

    @property
    def ratios(self) -> dict[int, float]:
        """Speed of every node over the crank's, by its number, positive."""
        speeds = np.abs(self.drive.line.speed_ratio)
        crank = speeds[self._index(self.engine.driving_nodes[0], "throw_nodes")]
        return dict(zip(self.drive.numbers, (speeds / crank).tolist(), strict=True))

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Numbers of the two nodes of each mesh with a slash, (mesh,)."""
        gears, numbers = self.drive.line.gears, self.drive.numbers
        return tuple(
            f"{numbers[gears[mesh.driving].node]}/{numbers[gears[mesh.driven].node]}"
            for mesh in self.drive.line.meshes
        )

    def linear(self) -> tuple[LinearSystem, Elements]:
        """The line whose meshes never part, and its meshes."""
        return closed_line(self.matrices())

    def matrices(self, *, merge_rigid: bool = False) -> LineMatrices:
        """Matrices of the line with the slopes of motor and load torques over speed."""
        matrices = self.drive.matrices(merge_rigid=merge_rigid)
        slopes = self.engine.dampers(self.ratios)
        if not slopes:
            return matrices
        damping = matrices.damping.copy()
        for node, slope in slopes.items():
            dof = int(np.argmax(matrices.expand[self.drive.numbers.index(node)]))
            damping[dof, dof] += slope
        return replace(matrices, damping=damping)

    def torques(self, speed: float, torque: float | None) -> LineTorques:
        """Torques on the line at a speed of the crank (rad/s) and a brake torque (N m)."""
        if isinstance(self.engine, Engine):
            return engine_torques(self.engine, speed, torque, self.ratios)
        assert torque is not None
        return motor_torques(self.engine, speed, torque, self.ratios)

    def load_at(self, torque: float | Array, speed_share: float | Array) -> Any:
        """The brake torque at a share of the speed at which it is ``torque`` N m, by the law of
        the load.
        """
        return torque * speed_share**self.engine.load_exponent

    def on_line(self, torques: LineTorques) -> Array:
        """Torques on the degrees of freedom, (dof, point) N m."""
        rows = torques.on(self.drive.numbers)
        n_dofs = len(self.drive.matrices().mass)
        return np.concatenate([rows, np.zeros((n_dofs - len(rows), rows.shape[1]))])

    def response(self, speed: float, torque: float | None) -> SteadyResponse:
        """Steady vibration at a speed of the crank (rad/s) and a brake torque (N m)."""
        return steady_response(
            self.linear()[0], self.on_line(self.torques(speed, torque)), speed
        )

    def seen_by(
        self, wheel: ToothedWheel, response: SteadyResponse, rng: np.random.Generator
    ) -> Array:
        """Speed that a toothed wheel of this machine shows, over `SEEN_CYCLES` cycles, (sample,)
        rad/s.
        """
        index = self._index(wheel.node, "toothed_wheels")
        deviation = over_cycle(response.angle[index], SAMPLES_PER_CYCLE)
        crank = CYCLE / SAMPLES_PER_CYCLE * np.arange(SEEN_CYCLES * SAMPLES_PER_CYCLE)
        turned = self.ratios[wheel.node] * crank + np.tile(deviation, SEEN_CYCLES)
        angle = np.asarray(turned, dtype=np.float64)
        rate = SAMPLES_PER_CYCLE * response.speed / CYCLE
        return instantaneous_speed(wheel, draw_wheel(rng, wheel), angle, rate)

    def _index(self, number: int, key: str) -> int:
        if number not in self.drive.numbers:
            raise ConfigError(f"excitation.{key}: the shaft line has no node {number}")
        return self.drive.numbers.index(number)


def read_engine_line(config: Configuration) -> EngineLine:
    """The drive line and the engine, or motor, of a configuration.

    Raises
    ------
    ConfigError        for a system that is no drive line, none or an ill excitation, nodes that
        the tables have not, joints too unlike in stiffness
    SimulationError    for inertias and joints that natural modes cannot be computed from
    """
    kind = config.section("system").get("kind")
    if kind != LINE:
        raise ConfigError(
            f"system.kind = {kind!r} is no drive line; take system=engine_gear_train, "
            "two_stage_gearbox or shaft_line"
        )
    if config.get("excitation") is None:
        raise ConfigError(
            "no excitation is chosen; take excitation=engine_v20, motor_and_load, or "
            "your own option of that group"
        )
    values = config["excitation"]
    check_group("excitation", values)
    drive = read_drive_line(config)
    check_stiffness_range(drive)
    engine: Engine | MotorDrive
    if values.get("kind") == KIND:
        engine = read_motor(values, drive)
    else:
        engine = read_engine(values)
        _check_throws(engine, drive)
    return EngineLine(drive=drive, engine=engine, wheels=read_wheels(values))


def _check_throws(engine: Engine, drive: DriveLine) -> None:
    """Raise for an engine whose crank is not on the line."""
    missing = [node for node in engine.throw_nodes if node not in drive.numbers]
    if missing:
        raise ConfigError(
            f"excitation.throw_nodes: the shaft line has no node {missing[0]}; {drive.name} has "
            f"{told_nodes(drive.numbers)}: take excitation=motor_and_load, or the engine's own "
            "line, system=engine_gear_train"
        )
