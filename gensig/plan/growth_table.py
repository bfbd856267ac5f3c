"""Growth laws of a plan of lives: a table from a fault's ``growth`` to the builder of its law.

A new law needs a name in ``gensig.faults.base.Growth``, its parameters in
``gensig.life.life_options.OPTIONS``, and its builder in ``LAWS`` below.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product

import numpy as np

from gensig.arrays import Array
from gensig.faults.base import Growth
from gensig.faults.crack import Crack
from gensig.faults.flank_form import Wear
from gensig.faults.pitting import DistributedPitting
from gensig.geometry.contact import SIDES
from gensig.life.crack_growth import CrackGrowthOptions
from gensig.life.growth import GrowthLaw
from gensig.life.life_options import WearGrowthOptions
from gensig.life.pit_growth import PitGrowthOptions
from gensig.life.wear.wear_growth import WearGrowth, WearTable, wear_table
from gensig.record.inputs import InputReader
from gensig.record.vibration_limit import limited_by_vibration
from gensig.systems.base import Machine, MachineMesh, home_meshes
from gensig.systems.growth_laws import crack_law, pit_law
from gensig.systems.wear import OF_PAIR, flank_wear, wear_fault

SetPoint = tuple[float, float]
"""Speed in rad/s and torque in N m as the configuration gives them."""


def corners(speed: Array, torque: Array) -> tuple[SetPoint, ...]:
    """Set-points with the least and the greatest of all speeds and torques, any shapes."""
    speeds = {float(speed.min()), float(speed.max())}
    torques = {float(torque.min()), float(torque.max())}
    return tuple(product(sorted(speeds), sorted(torques)))


class LifeGears:
    """The gears of one mesh in a plan of lives; loads and worn flanks are computed once.

    Parameters
    ----------
    reader : of the plan
    machine : that follows this mesh
    corners : set-points between which those of all units lie
    names : of the pinion and the wheel in the machine of the plan, by their sides of this mesh;
        of those whose faults are on the flanks that work here
    """

    def __init__(
        self,
        reader: InputReader,
        machine: Machine,
        corners: Sequence[SetPoint],
        names: Mapping[str, str] = OF_PAIR,
    ) -> None:
        self.machine, self.names = machine, names
        self._reader, self._corners = reader, corners
        self._others: dict[str, tuple[LifeGears, str]] = {}
        self._tooth_loads = cache(self._tooth_loads_at)

    def tooth_loads(self, points: Sequence[SetPoint]) -> tuple[Array, ...]:
        """Loads that a tooth meets at each set-point, (mesh,) N m of the pinion each."""
        return tuple(self._tooth_loads(*_rounded(point)) for point in points)

    def mean_loads(self, points: Sequence[SetPoint]) -> tuple[Array, ...]:
        """Mean torque of the pinion at each set-point, (1,) N m each."""
        ratio = self.machine.ratio
        means = (
            self.machine.mean_torque(speed * ratio, torque) for speed, torque in points
        )
        return tuple(np.array([mean]) for mean in means)

    @cached_property
    def torques(self) -> tuple[float, float]:
        """Least and greatest torque of the pinion between the corners, N m.

        Of the loads of a set-point the greatest counts.
        """
        greatest = [float(loads.max()) for loads in self.tooth_loads(self._corners)]
        return min(greatest), max(greatest)

    def of_gear(self, gear: str) -> tuple[LifeGears, str]:
        """The gears of the home mesh of a gear, and its side there."""
        if gear in SIDES:
            return self, gear
        if gear not in self._others:
            machine, side = self.machine.at_gear(gear)
            number = home_meshes(self.machine.meshes)[gear]
            names = worn_together(self.machine.meshes, number)
            there = LifeGears(self._reader, machine, self._corners, names)
            self._others[gear] = there, side
        return self._others[gear]

    def _tooth_loads_at(self, speed: float, torque: float) -> Array:
        return self.machine.mesh_torques(speed * self.machine.ratio, torque)

    @cached_property
    def wear(self) -> WearTable:
        """Wear of the healthy flanks between the mean torques of the corners."""
        case = flank_wear(self.machine.flanks, self._reader.wear)
        case, _ = limited_by_vibration(case, self._reader, self.names)
        means = np.concatenate(self.mean_loads(self._corners))
        return wear_table(case, float(means.min()), float(means.max()))


def worn_together(meshes: Sequence[MachineMesh], number: int) -> dict[str, str]:
    """Gears of a mesh whose faults are on the flanks that work in it, by their sides.

    A gear whose home mesh is another one and meets its other flank there is left out.
    """
    homes = home_meshes(meshes)
    gears = {}
    for side, name in zip(SIDES, meshes[number].gears, strict=True):
        at_home = SIDES[meshes[homes[name]].gears.index(name)]
        if at_home == side:
            gears[side] = name
    return gears


def _rounded(point: SetPoint) -> SetPoint:
    """A set-point to 12 digits: that of a history has passed through the ratio of a gear."""
    speed, torque = (float(f"{value:.12g}") for value in point)
    return speed, torque


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitGrowth:
    """Growth law of one unit, and the size at which its life begins.

    ``loads`` are what the law meets at every set-point, (mesh,) N m each.
    """

    law: GrowthLaw
    start: float
    loads: tuple[Array, ...]


def paris(
    gears: LifeGears,
    fault: Crack,
    options: CrackGrowthOptions,
    points: Sequence[SetPoint],
    first: float,
) -> UnitGrowth:
    """A root crack that begins at a share of the root chord."""
    gear = gears.machine.pair.gears[fault.gear]
    law = crack_law(gears.machine, fault.seed(), options, gears.torques)
    return UnitGrowth(
        law=law,
        start=options.start_share * first * fault.root_chord(gear),
        loads=gears.tooth_loads(points),
    )


def pits(
    gears: LifeGears,
    fault: DistributedPitting,
    options: PitGrowthOptions,
    points: Sequence[SetPoint],
    first: float,
) -> UnitGrowth:
    """Pits of a flank that begins sound."""
    law = pit_law(gears.machine, fault, options, first, gears.torques)
    return UnitGrowth(law=law, start=0.0, loads=gears.tooth_loads(points))


def archard(
    gears: LifeGears,
    fault: Wear,
    options: WearGrowthOptions,
    points: Sequence[SetPoint],
    first: float,
) -> UnitGrowth:
    """Wear of both gears' flanks, which begin new, under the mean loads."""
    table, loads = gears.wear, gears.mean_loads(points)
    case = table.lives[0].case
    torque = float(np.exp(np.log(np.concatenate(loads)).mean()))
    law = WearGrowth(
        table=table,
        torque=torque,
        as_fault=lambda depth: wear_fault(case, depth, gears.names),
    )
    return UnitGrowth(law=law, start=0.0, loads=loads)


# Builders take the gears, a fault with this growth, the options of its law, the unit's set-points,
# and the unit's factor on the first size of its damage.
LAWS: Mapping[Growth, Callable[..., UnitGrowth]] = {
    Growth.PARIS: paris,
    Growth.PITS: pits,
    Growth.ARCHARD: archard,
}
