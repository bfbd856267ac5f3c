"""Growth of a damage under a history of loads, until its end or that of the history."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array, Flags, Integers
from gensig.errors import ConfigError
from gensig.life.load_history import History

WIDEST = 3.0  # standard deviations: nothing is drawn beyond


class GrowthOptions:
    """Parameters of a growth law, as ``life`` gives them for one kind of fault.

    Units differ in the rate of growth and in the first size. ``rate_scatter`` and
    ``start_scatter`` are the standard deviations of their logarithms about their medians.
    """

    __slots__ = ()
    rate_scatter: float
    start_scatter: float

    def __post_init__(self) -> None:
        for key in ("rate_scatter", "start_scatter"):
            if not 0.0 <= getattr(self, key) <= 2.0:
                raise ConfigError(
                    f"life: {key} = {getattr(self, key):g} must lie in 0..2"
                )

    @property
    def largest_start(self) -> float:
        """Greatest factor between a unit's first size and the median."""
        return math.exp(WIDEST * self.start_scatter)

    def draw(self, rng: np.random.Generator) -> tuple[float, float]:
        """Factors on the rate and the first size of one unit.

        Two draws, whatever the scatters are.
        """
        rate, start = np.clip(rng.standard_normal(2), -WIDEST, WIDEST).tolist()
        return math.exp(rate * self.rate_scatter), math.exp(start * self.start_scatter)


class GrowthLaw(ABC):
    """Growth of one kind of damage.

    ``sizes`` (node,) are where its rate is evaluated, from the least to the end.
    """

    sizes: Array

    @abstractmethod
    def rate(self, size: Array, torque: float) -> Array:
        """Growth a turn of the pinion under a torque in N m, (size,); 0 where it does not grow."""

    @abstractmethod
    def fault(self, size: float) -> dict[str, Any]:
        """Boundary keys of the fault at a size, over those of its option.

        With ``kind`` it is a different kind of fault.
        """

    @abstractmethod
    def measures(self, size: float, torque: float) -> dict[str, float]:
        """Measures of the damage besides the fault itself, by name with unit."""

    def turns(self, torque: Array | Sequence[Array]) -> Array:
        """Turns of the pinion that each cell between two sizes takes, (setpoint, cell).

        They are inf where nothing grows.

        Parameters
        ----------
        torque : (setpoint,) N m, or for each set-point those of its load spectrum, (mesh,) N m,
            all equally likely
        """
        middle, width = 0.5 * (self.sizes[1:] + self.sizes[:-1]), np.diff(self.sizes)
        rates = np.array(
            [
                np.mean([self.rate(middle, load) for load in np.ravel(row)], axis=0)
                for row in torque
            ]
        )
        never = np.full_like(rates, np.inf)
        return np.divide(width, rates, out=never, where=rates > 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """Course of a size, linear in time between knots.

    Parameters
    ----------
    clock, running : (knot,) s       since the machine was new, and of that the time in which it ran
    turns : (knot,)                  of the pinion
    size : (knot,)
    setpoint : (knot,) int           of the machine from this knot on; of the last, until it
    growing : (knot,) bool           True where the size grew from this knot on; of the last,
        until it
    has_failed : bool                True where the end was reached; else the life is censored where
        the history ends
    """

    clock: Array
    running: Array
    turns: Array
    size: Array
    setpoint: Integers
    growing: Flags
    has_failed: bool

    def at(self, running: float) -> tuple[int, float]:
        """Piece, and share of it from 0 to 1, after so many s of running.

        Never within a standstill.
        """
        last = len(self.running) - 2
        piece = min(
            max(int(np.searchsorted(self.running, running, side="right")) - 1, 0), last
        )
        while piece > 0 and self.running[piece + 1] == self.running[piece]:
            piece -= 1  # a standstill at the very end
        begin, end = self.running[piece], self.running[piece + 1]
        return piece, min(max((running - begin) / (end - begin), 0.0), 1.0)

    def value(self, name: str, where: tuple[int, float]) -> float:
        """``clock``, ``turns`` or ``size`` at a piece and share, as ``at`` gives them."""
        piece, share = where
        low, high = getattr(self, name)[piece : piece + 2]
        return float(low + share * (high - low))


def grow(sizes: Array, turns: Array, history: History, start: float) -> Course:
    """Follow a size from ``start`` through a history, cell by cell; within a cell it grows evenly.

    Parameters
    ----------
    sizes : (node,)             ascending; the last is the end of life
    turns : (setpoint, cell)    turns of the pinion that each cell takes; inf where nothing grows

    The rates do not depend on the size's past, so that loads of any order may follow each other
    (no overload retardation).
    """
    nodes, per_cell = sizes.tolist(), turns.tolist()
    cell = min(int(np.searchsorted(sizes, start, side="right")) - 1, len(nodes) - 2)
    size, running, turned = start, 0.0, 0.0
    knots: list[tuple[float, float, float, float, int, bool]] = []
    failed = False
    begins, ends = history.begin.tolist(), history.end.tolist()
    for begin, end, setpoint in zip(
        begins, ends, history.setpoint.tolist(), strict=True
    ):
        seconds_a_turn = 2.0 * math.pi / float(history.speed[setpoint])
        clock, left = begin, (end - begin) / seconds_a_turn
        while left > 0.0 and not failed:
            whole = per_cell[setpoint][cell]
            is_growing = math.isfinite(whole)
            width = nodes[cell + 1] - nodes[cell]
            needed = math.inf
            if is_growing:
                needed = whole * (nodes[cell + 1] - size) / width
            knots.append((clock, running, turned, size, setpoint, is_growing))
            spent = min(needed, left)
            clock += spent * seconds_a_turn
            running += spent * seconds_a_turn
            turned += spent
            if needed <= left:
                cell += 1
                size = nodes[cell]
                failed = cell == len(nodes) - 1
            elif is_growing:
                size += spent / whole * width
            left -= spent
        knots.append((clock, running, turned, size, setpoint, is_growing))
        if failed:
            break
    columns = [np.array(column) for column in zip(*knots, strict=True)]
    return Course(
        clock=columns[0],
        running=columns[1],
        turns=columns[2],
        size=columns[3],
        setpoint=columns[4],
        growing=columns[5],
        has_failed=failed,
    )
