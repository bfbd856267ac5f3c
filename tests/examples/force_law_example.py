"""A force law for gensig's core: a stop between two bodies, which touches beyond a clearance."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, final

import numpy as np

from gensig.dynamics._vector import get_row, set_row, spread, where_above
from gensig.dynamics._written import loop
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._flat import number_at, rows_of
from gensig.dynamics.backends.nystroem._group import of
from gensig.dynamics.backends.nystroem.force_law import ForceLaw
from gensig.dynamics.equations import Element
from gensig.dynamics.lanes import side_by_side


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Stop(Element):
    """Stop between two translations, by their degrees of freedom.

    ``clearance`` m is how far the first moves towards the second before they touch, ``stiffness``
    N/m that of the contact.
    """

    law: ClassVar[str] = "stop"
    first: int
    second: int
    clearance: float
    stiffness: float

    def largest_stiffness(self, n_dof):
        """That of the contact."""
        along = np.zeros(n_dof)
        along[[self.first, self.second]] = 1.0, -1.0
        return self.stiffness * np.outer(along, along)


class StopRows(NamedTuple):
    """Stops of a group: ``touched`` (stop, 2), clearance and stiffness (stop, lane)."""

    touched: Any
    clearance: Any
    stiffness: Any


@final
class StopLaw(ForceLaw):
    """Force of a stop: stiffness times the penetration."""

    rows = StopRows

    def pack(self, elements, rests, precision):
        """As ``ForceLaw.pack``; clearances are counted from the rests."""
        touched = np.array([[stop.first, stop.second] for stop in elements[0]])
        apart = rests[:, touched[:, 0]] - rests[:, touched[:, 1]]
        clearance = [[stop.clearance for stop in of_lane] for of_lane in elements]
        stiffness = [[stop.stiffness for stop in of_lane] for of_lane in elements]
        return StopRows(
            touched=touched.ravel(),
            clearance=side_by_side(np.array(clearance) - apart, precision),
            stiffness=side_by_side(np.array(stiffness), precision),
        )

    def push(self, group, elements, q, v, machine):
        """Write the force of every stop on its two bodies."""
        zero = spread(machine, 0.0)

        def push(stop):
            a, b = (number_at(elements.touched, 2 * stop + end) for end in (0, 1))
            moved = get_row(machine, of(q, a)) - get_row(machine, of(q, b))
            bite = moved - get_row(elements.clearance, stop)
            bite = where_above(bite, zero, bite, zero)
            force = get_row(elements.stiffness, stop) * bite
            for on, sign in ((of(rows.ON, a), -1.0), (of(rows.ON, b), 1.0)):
                set_row(machine, on, get_row(machine, on) + sign * force)

        loop(rows_of(elements.touched, 2), push)
