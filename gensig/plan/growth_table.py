"""Growth laws of a plan of lives: a table from a fault's ``growth`` to the builder of its law.

A new law needs a name in ``gensig.faults.base.Growth``, its parameters in
``gensig.life.life_options.OPTIONS``, and its builder in ``LAWS`` below.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.faults.base import Growth
from gensig.faults.crack import Crack
from gensig.faults.flank_form import Wear
from gensig.faults.pitting import DistributedPitting
from gensig.geometry.contact import SIDES
from gensig.life.crack_growth import CrackGrowthOptions
from gensig.life.growth import GrowthLaw
from gensig.life.life_options import WearGrowthOptions
from gensig.life.load_history import History
from gensig.life.pit_growth import PitGrowthOptions
from gensig.life.wear.wear_growth import WearGrowth, WearTable, wear_table
from gensig.options.configuration import Configuration
from gensig.record.vibration_limit import limited_by_vibration
from gensig.systems.base import Machine
from gensig.systems.growth_laws import crack_law, pit_law
from gensig.systems.wear import read_wear_case, wear_fault

Array = NDArray[np.float64]

HEALTHY = {"kind": "healthy"}


class LifeGears:
    """The gears of a plan of lives; tooth loads and worn flanks are computed once.

    Parameters
    ----------
    config : of the plan
    torques : least and greatest torque of all its set-points, N m
    """

    def __init__(
        self,
        config: Configuration,
        machine: Machine,
        torques: tuple[float, float],
    ) -> None:
        self.machine, self.torques = machine, torques
        self._config = config
        self._loads: dict[tuple[float, float], Array] = {}
        self._others: dict[str, tuple[LifeGears, str]] = {}

    def tooth_loads(self, speed: float, torque: float) -> Array:
        """Loads that a tooth meets at a set-point, (mesh,) N m."""
        if (speed, torque) not in self._loads:
            self._loads[speed, torque] = self.machine.mesh_torques(speed, torque)
        return self._loads[speed, torque]

    def of_gear(self, gear: str) -> tuple[LifeGears, str]:
        """The gears of the home mesh of a gear, and its side there."""
        if gear in SIDES:
            return self, gear
        if gear not in self._others:
            machine, side = self.machine.at_gear(gear)
            self._others[gear] = LifeGears(self._config, machine, self.torques), side
        return self._others[gear]

    @cached_property
    def wear(self) -> WearTable:
        """Wear of the sound flanks between the two torques."""
        sound = self._config.with_entries(fault=HEALTHY)
        case, _ = limited_by_vibration(read_wear_case(sound), sound)
        return wear_table(case, *self.torques)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitGrowth:
    """Growth law of one unit, and the size at which its life begins."""

    law: GrowthLaw
    start: float


def paris(
    gears: LifeGears,
    fault: Crack,
    options: CrackGrowthOptions,
    history: History,
    first: float,
) -> UnitGrowth:
    """A root crack that begins at a share of the root chord."""
    gear = gears.machine.pair.gears[fault.gear]
    law = crack_law(gears.machine, fault.seed(), options, gears.torques)
    return UnitGrowth(
        law=law, start=options.start_share * first * fault.root_chord(gear)
    )


def pits(
    gears: LifeGears,
    fault: DistributedPitting,
    options: PitGrowthOptions,
    history: History,
    first: float,
) -> UnitGrowth:
    """Pits of a flank that begins sound."""
    law = pit_law(gears.machine, fault, options, first, gears.torques)
    return UnitGrowth(law=law, start=0.0)


def archard(
    gears: LifeGears,
    fault: Wear,
    options: WearGrowthOptions,
    history: History,
    first: float,
) -> UnitGrowth:
    """Wear of both gears' flanks, which begin new."""
    table = gears.wear
    case = table.lives[0].case
    torque = float(np.exp(np.log(history.torque).mean()))
    law = WearGrowth(
        table=table, torque=torque, as_fault=lambda depth: wear_fault(case, depth)
    )
    return UnitGrowth(law=law, start=0.0)


# Builders take the gears, a fault with this growth, the options of its law, the unit's history of
# loads, and the unit's factor on the first size of its damage.
LAWS: Mapping[Growth, Callable[..., UnitGrowth]] = {
    Growth.PARIS: paris,
    Growth.PITS: pits,
    Growth.ARCHARD: archard,
}
PAIRS_ONLY = (Growth.ARCHARD,)  # laws that are not followed on drive lines
