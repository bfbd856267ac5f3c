"""A size that grows under a history of loads, until it reaches its end or the history is over."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.life.load_history import History
from gensig.life.spread import Spread

Array = NDArray[np.float64]


class GrowthOptions(ABC):
    """Parameters of a growth law, as ``life`` gives them for one kind of fault."""

    __slots__ = ()

    @property
    @abstractmethod
    def spread(self) -> Spread:
        """Differences between units."""


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
        """Boundary keys of the class's fault at a size, over those of its option; with ``kind``
        it is a fault of its own."""

    @abstractmethod
    def measures(self, size: float, torque: float) -> dict[str, float]:
        """Measures of the damage besides the fault itself, by name with unit."""

    def turns(self, torque: Array | Sequence[Array]) -> Array:
        """Turns of the pinion that each cell between two sizes takes, (setpoint, cell); inf where
        nothing grows.

        Parameters
        ----------
        torque : (setpoint,) N m, or for each set-point those of its load spectrum, (mesh,) N m,
            all equally likely
        """
        middle, width = 0.5 * (self.sizes[1:] + self.sizes[:-1]), np.diff(self.sizes)
        rates = np.array(
            [
                np.mean(
                    [self.rate(middle, float(one)) for one in np.atleast_1d(row)],
                    axis=0,
                )
                for row in torque
            ]
        )
        return np.divide(
            width, rates, out=np.full_like(rates, np.inf), where=rates > 0.0
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """How a size went, linear in time between knots.

    Parameters
    ----------
    clock, running : (knot,) s       since the machine was new, and of that the time in which it ran
    turns : (knot,)                  of the pinion
    size : (knot,)
    setpoint : (knot,) int           at which the machine ran from this knot on; of the last, until
        it
    growing : (knot,) bool           whether the size grew from this knot on; of the last, until it
    has_failed : bool                whether the end was reached; else the life is censored where
        the history ends
    """

    clock: Array
    running: Array
    turns: Array
    size: Array
    setpoint: NDArray[np.int64]
    growing: NDArray[np.bool_]
    has_failed: bool

    def at(self, running: float) -> tuple[int, float]:
        """Piece, and place in it from 0 to 1, at which the machine had run so many s.

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

    def value(self, name: str, place: tuple[int, float]) -> float:
        """``clock``, ``turns`` or ``size`` at a place."""
        piece, share = place
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
    blocks = zip(
        history.begin.tolist(),
        history.end.tolist(),
        history.setpoint.tolist(),
        strict=True,
    )
    for begin, end, setpoint in blocks:
        seconds_a_turn = 2.0 * math.pi / float(history.speed[setpoint])
        clock, left = begin, (end - begin) / seconds_a_turn
        while left > 0.0:
            whole = per_cell[setpoint][cell]
            width = nodes[cell + 1] - nodes[cell]
            needed = (
                whole * (nodes[cell + 1] - size) / width
                if math.isfinite(whole)
                else math.inf
            )
            knots.append((clock, running, turned, size, setpoint, math.isfinite(whole)))
            spent = min(needed, left)
            crossed = needed <= left
            clock, running, turned = (
                clock + spent * seconds_a_turn,
                running + spent * seconds_a_turn,
                turned + spent,
            )
            left -= spent
            if crossed:
                size, cell = nodes[cell + 1], cell + 1
                if cell == len(nodes) - 1:
                    failed = True
                    break
            elif math.isfinite(whole):
                size += spent / whole * width
        knots.append((clock, running, turned, size, setpoint, knots[-1][5]))
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
