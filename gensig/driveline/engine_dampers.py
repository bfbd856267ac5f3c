"""Dampers on an engine's drive line.

Tooth force of one mesh, root stress under it, and their tuning.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.linear.damper_tuning import NodeResponse, response_at_nodes
from gensig.driveline.linear.dampers import TorsionalDamper, with_dampers
from gensig.driveline.linear.forced import USUAL_ORDERS, SteadyResponse, over_cycle
from gensig.driveline.linear.shaft_line import LineGear
from gensig.driveline.mesh_phase import start_rolls
from gensig.driveline.running import named_by_side
from gensig.errors import ConfigError
from gensig.life.root.strength import Strength
from gensig.mesh.options import (
    refuse_papers_heat,
)
from gensig.options.configuration import Configuration
from gensig.sensing.manufacturing import Quality
from gensig.systems.registry import PairParts
from gensig.systems.root_strength import GearStress, RootHistory, RootStrength
from gensig.systems.sliced_pair import SlicedPair

CYCLE_POINTS = 5760  # over which forces are looked at


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToothLoad:
    """Force of one mesh along its line of action over a cycle of the crank, (point,) N, at a
    speed in rad/s.
    """

    speed: float
    force: Array

    @property
    def greatest(self) -> float:
        """Greatest force that closes the mesh, N."""
        return float(self.force.max())

    @property
    def largest(self) -> float:
        """Largest force whichever way it acts, N."""
        return float(np.abs(self.force).max())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicRootStress:
    """Root stress of a mesh under its dynamic load.

    Parameters
    ----------
    strength : the pair under the greatest force as if it stood still
    gears : ISO's stress and safety of both gears under that force
    history : the same over the mesh, wherever the greatest force falls: the bound of what a
        tooth can see
    passes : by gear (pass, point) Pa    over ``history.roll``, of each pair that meets during a
        cycle as the teeth are keyed (``mesh_phase``); the load share is that under the greatest
        force, and a force that would part the mesh bends nothing here
    """

    strength: RootStrength
    gears: dict[str, GearStress]
    history: RootHistory
    passes: dict[str, Array]

    @classmethod
    def of(
        cls, strength: RootStrength, history: RootHistory, share: Array
    ) -> DynamicRootStress:
        """The stress under shares (pass, point) of the greatest force, that of ``strength``."""
        passes = {name: share * stress for name, stress in history.stress.items()}
        return cls(
            strength=strength, gears=strength.gears(), history=history, passes=passes
        )


def with_further_dampers(
    line: EngineLine, dampers: Sequence[TorsionalDamper]
) -> EngineLine:
    """The same engine with further dampers on its line."""
    drive = line.drive
    damped, numbers = with_dampers(drive.line, drive.numbers, dampers)
    return replace(line, drive=replace(drive, line=damped, numbers=numbers))


def mesh_between(line: EngineLine, nodes: Sequence[int]) -> int:
    """Index of the mesh between two nodes.

    Raises
    ------
    ConfigError    where these two do not mesh
    """
    wanted = {f"{nodes[0]}/{nodes[1]}", f"{nodes[1]}/{nodes[0]}"}
    for number, name in enumerate(line.mesh_names):
        if name in wanted:
            return number
    raise ConfigError(
        f"nodes {nodes[0]} and {nodes[1]} do not mesh; these do: {', '.join(line.mesh_names)}"
    )


def tooth_load(line: EngineLine, mesh: int, response: SteadyResponse) -> ToothLoad:
    """Force of a mesh in a steady vibration; the mesh is a spring that never parts."""
    mean, amplitudes = response.element_forces(line.linear()[1])
    return ToothLoad(
        speed=response.speed,
        force=mean[mesh] + over_cycle(amplitudes[mesh], CYCLE_POINTS),
    )


def response_for_dampers(
    line: EngineLine,
    mesh: int,
    nodes: Sequence[int],
    speeds: Iterable[float],
    torque: float,
) -> NodeResponse:
    """Force of a mesh over a range of speeds (rad/s) at one brake torque, for dampers on ``nodes``.

    Raises
    ------
    ConfigError    for nodes that the line has not, or one twice
    """
    numbers = line.drive.numbers
    for node in nodes:
        if node not in numbers:
            raise ConfigError(
                f"the shaft line has no node {node}; it has {min(numbers)} to {max(numbers)}"
            )
    if len(set(nodes)) != len(nodes):
        raise ConfigError(
            f"dampers on nodes {', '.join(map(str, nodes))}: name each node once"
        )
    linear, meshes = line.linear()
    return response_at_nodes(
        linear,
        meshes,
        mesh,
        lambda speed: line.on_line(line.torques(speed, torque)),
        speeds,
        {node: numbers.index(node) for node in nodes},
        n_orders=USUAL_ORDERS,
    )


def read_mesh_strength(
    config: Configuration, line: EngineLine, mesh: int
) -> RootStrength:
    """Pair and strength of one mesh of a line, without load.

    Flanks, material and strength of the configuration.
    """
    parts = PairParts(config)
    # the mesh code knows gears by their sides, the tables by the names of the machine
    pair = named_by_side(line.drive.pairs[mesh])
    modification = parts.modification
    if not modification.is_any:
        modification = line.drive.relief(mesh)
    flanks = SlicedPair(
        pair=pair,
        material=parts.material,
        mesh=refuse_papers_heat(parts.mesh, "a drive line"),
        slices=parts.slices,
        modification=modification,
        torque=0.0,
    )
    return RootStrength(
        flanks=flanks,
        sliced=flanks.modification.is_any or pair.pinion.helix_angle != 0.0,
        strength=config.section("strength").read(Strength),
        grade=config.section("quality").read(Quality).iso1328_grade,
    )


def dynamic_root_stress(
    strength: RootStrength, line: EngineLine, mesh: int, load: ToothLoad
) -> DynamicRootStress:
    """Root stress through the mesh under a force that changes from tooth to tooth.

    Raises
    ------
    ConfigError    for a force that never closes the mesh
    """
    if not load.greatest > 0.0:
        raise ConfigError(
            f"mesh {line.mesh_names[mesh]}: its force never closes the driving "
            "flanks; swap edge_from and edge_to of "
            "its row"
        )
    radius = strength.pair.pinion.base_radius
    loaded = replace(
        strength, flanks=replace(strength.flanks, torque=load.greatest * radius)
    )
    history = loaded.history()
    crank = crank_of_passes(
        strength, line, mesh, history.roll, range(passes_of_a_cycle(line, mesh))
    )
    angle = CYCLE / len(load.force) * np.arange(len(load.force))
    share = (
        np.maximum(np.interp(crank, angle, load.force, period=CYCLE), 0.0)
        / load.greatest
    )
    return DynamicRootStress.of(loaded, history, share)


def passes_of_a_cycle(line: EngineLine, mesh: int) -> int:
    """Tooth pairs that meet in a mesh during a cycle of the crank, counting one that is cut as
    whole.
    """
    driving = _driving(line, mesh)
    ratio = line.ratios[line.drive.numbers[driving.node]]
    return math.ceil(CYCLE * ratio * driving.n_teeth / (2.0 * math.pi) - 1e-9)


def crank_of_passes(
    strength: RootStrength,
    line: EngineLine,
    mesh: int,
    roll: Array,
    passes: Iterable[int],
) -> Array:
    """Crank angles at which pairs, counted from crank angle 0 on, are at ``roll`` (point,) m,
    (pass, point) rad.
    """
    pinion = strength.pair.pinion
    ratio = line.ratios[line.drive.numbers[_driving(line, mesh).node]]
    start = float(start_rolls(line.drive)[mesh])
    way = (
        roll + strength.pair.base_pitch * np.array(passes)[:, None] - start
    )  # of the pinion since crank angle 0
    return way / (pinion.base_radius * ratio)


def _driving(line: EngineLine, mesh: int) -> LineGear:
    return line.drive.line.gears[line.drive.line.meshes[mesh].driving]
