"""An engine on its drive line: the group ``excitation`` on the nodes of the tables, and the steady answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.engine_cycle import CYCLE
from gensig.dynamics.engine_torques import Engine, EngineTorques, engine_torques
from gensig.dynamics.forced import Elements, LinearLine, SteadyResponse, closed_line, over_cycle, steady_response
from gensig.errors import ConfigError
from gensig.sensing.toothed_wheel import ToothedWheel, draw_wheel, instantaneous_speed
from gensig.systems.engine import read_engine, read_wheels
from gensig.systems.registry import LINE, section
from gensig.systems.shaft_line import DriveLine, read_drive_line

Array = NDArray[np.float64]

SAMPLES_PER_CYCLE = 7200  # about 100 kHz at 1688 r/min
SEEN_CYCLES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineLine:
    """A drive line and the engine that turns it; degrees of freedom are the nodes, then lateral motion if any."""

    drive: DriveLine
    engine: Engine
    wheels: Mapping[str, ToothedWheel]

    @property
    def ratios(self) -> dict[int, float]:
        """Speed of every node over the crank's, by its number, positive."""
        crank = abs(self.drive.line.speed_ratio[self._place(self.engine.throw_nodes[0], "throw_nodes")])
        ratios = np.abs(self.drive.line.speed_ratio) / crank
        return {number: float(ratio) for number, ratio in zip(self.drive.numbers, ratios, strict=True)}

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Numbers of the two nodes of each mesh with a slash, (mesh,)."""
        gears, numbers = self.drive.line.gears, self.drive.numbers
        return tuple(
            f"{numbers[gears[mesh.driving].node]}/{numbers[gears[mesh.driven].node]}" for mesh in self.drive.line.meshes
        )

    def linear(self) -> tuple[LinearLine, Elements]:
        """The line whose meshes never part, and its meshes."""
        return closed_line(self.drive.matrices())

    def torques(self, speed: float, torque: float | None) -> EngineTorques:
        """What acts at a speed of the crank (rad/s) and a brake torque (N m)."""
        return engine_torques(self.engine, speed, torque, self.ratios)

    def on_line(self, torques: EngineTorques) -> Array:
        """Torques on the degrees of freedom, (dof, point) N m."""
        rows = torques.on(self.drive.numbers)
        n_dofs = len(self.drive.matrices().mass)
        return np.asarray(np.concatenate([rows, np.zeros((n_dofs - len(rows), rows.shape[1]))]))

    def response(self, speed: float, torque: float | None) -> SteadyResponse:
        """Steady vibration at a speed of the crank (rad/s) and a brake torque (N m)."""
        return steady_response(self.linear()[0], self.on_line(self.torques(speed, torque)), speed)

    def seen_by(self, wheel: ToothedWheel, response: SteadyResponse, rng: np.random.Generator) -> Array:
        """Speed that a toothed wheel of this machine shows, over `SEEN_CYCLES` cycles, (sample,) rad/s."""
        place = self._place(wheel.node, "toothed_wheels")
        one = over_cycle(response.angle[place], SAMPLES_PER_CYCLE)
        crank = CYCLE / SAMPLES_PER_CYCLE * np.arange(SEEN_CYCLES * SAMPLES_PER_CYCLE)
        angle = np.asarray(self.ratios[wheel.node] * crank + np.tile(one, SEEN_CYCLES), dtype=np.float64)
        rate = SAMPLES_PER_CYCLE * response.speed / CYCLE
        return instantaneous_speed(wheel, draw_wheel(rng, wheel), angle, rate)

    def _place(self, number: int, key: str) -> int:
        if number not in self.drive.numbers:
            raise ConfigError(f"excitation.{key}: the shaft line has no node {number}")
        return self.drive.numbers.index(number)


def read_engine_line(config: Mapping[str, Any]) -> EngineLine:
    """The drive line and the engine of a configuration.

    Raises
    ------
    ConfigError    for a system that is no drive line, none or an ill excitation, nodes that the tables have not
    """
    kind = section(config, "system").get("kind")
    if kind != LINE:
        raise ConfigError(f"system.kind = {kind!r} is no drive line; take system=engine_gear_train or shaft_line")
    if config.get("excitation") is None:
        raise ConfigError("no excitation is chosen; take excitation=engine_v20, or your own option of that group")
    values = config["excitation"]
    return EngineLine(drive=read_drive_line(config), engine=read_engine(values), wheels=read_wheels(values))
