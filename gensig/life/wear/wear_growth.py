"""Flanks that wear under a history of loads: lives under steady torques, looked up between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.life.growth import GrowthLaw
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import WearLife, wear_life

N_DEPTHS = 121
N_TORQUES = 3  # life goes nearly as a power of the torque


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WearTable:
    """Lives under steady torques (torque,) N m, ascending; made by ``wear_table``.

    ``turns`` (torque, node) are those of the pinion to each of the depths ``sizes`` (node,) m by
    the case's criterion. ``reached`` (time,) m are the depths at the times of each life.
    """

    torque: Array
    lives: tuple[WearLife, ...]
    reached: tuple[Array, ...]
    sizes: Array
    turns: Array

    def worn(self, size: float, torque: float) -> Array:
        """Depth off both flanks, (2, slice, node) m, where a steady life has the depth ``size``."""
        depths = []
        for life, reached in zip(self.lives, self.reached, strict=True):
            at = float(np.interp(size, reached, np.arange(len(reached))))
            depths.append(_row(life.depth, at))
        return _between(self.torque, np.array(depths), torque)


def wear_table(case: WearCase, least: float, greatest: float) -> WearTable:
    """Lives of a case between two torques in N m.

    Raises
    ------
    GensigError    for what ``wear_life`` refuses
    """
    torques = np.array([least])
    if least != greatest:
        torques = np.geomspace(least, greatest, N_TORQUES)
    lives = tuple(wear_life(case.with_torque(float(torque))) for torque in torques)
    # a limit of the transmission error may end lives at unlike depths: the least of them ends all
    sizes = np.linspace(0.0, min(life.threshold for life in lives), N_DEPTHS)
    reached = tuple(
        np.array([life.case.judged(depth) for depth in life.depth]) for life in lives
    )
    turns = np.array(
        [
            np.interp(sizes, depths, life.turns)
            for depths, life in zip(reached, lives, strict=True)
        ]
    )
    return WearTable(
        torque=torques, lives=lives, reached=reached, sizes=sizes, turns=turns
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WearGrowth(GrowthLaw):
    """Growth law of one unit's flanks; its size is the depth of the wear criterion, m.

    ``torque`` in N m is the unit's mean one, whose steady life gives the worn profile. The order
    of the loads changes the rate of wear, but not the worn shape (assumed; all loads take off
    most where flanks slide most). ``as_fault`` makes a fault of the depth off both flanks.
    """

    table: WearTable
    torque: float
    as_fault: Callable[[Array], dict[str, Any]]

    @property
    def sizes(self) -> Array:  # type: ignore[override]
        """Depths of the table, (node,) m."""
        return self.table.sizes

    def rate(self, size: Array, torque: float) -> Array:
        """Depth a turn of the pinion, (size,) m."""
        taken = np.diff(self.table.turns, axis=1)
        turns = np.exp(_between(self.table.torque, np.log(taken), torque))
        cell = np.clip(np.searchsorted(self.sizes, size) - 1, 0, len(turns) - 1)
        return (np.diff(self.sizes) / turns)[cell]

    def fault(self, size: float) -> dict[str, Any]:
        """Both flanks."""
        return self.as_fault(self.table.worn(size, self.torque))

    def measures(self, size: float, torque: float) -> dict[str, float]:
        """Nothing: the fault has the depths."""
        return {}


def _between(torques: Array, values: Array, torque: float) -> Array:
    """Values (torque, ...) at one torque, linear over its logarithm."""
    if len(torques) == 1:
        return values[0]
    at = float(np.interp(np.log(torque), np.log(torques), np.arange(len(torques))))
    return _row(values, at)


def _row(values: Array, at: float) -> Array:
    """Row of ``values`` (row, ...) at a position between rows, linear."""
    low = min(int(at), len(values) - 2)
    return values[low] + (at - low) * (values[low + 1] - values[low])
