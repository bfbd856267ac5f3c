"""Records in a few groups by a value.

What every curve over a condition or a severity is drawn from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Records with values from `low` to `high`, or of one name.

    Attributes
    ----------
    member : (record,) bool
    low, high : smallest and largest value of the members; None for names
    name : of the members; None for numbers
    """

    member: NDArray[np.bool_]
    low: float | None
    high: float | None
    name: str | None

    @property
    def text(self) -> str:
        """The group in words."""
        if self.name is not None:
            return self.name
        return (
            f"{self.low:.4g}"
            if self.low == self.high
            else f"{self.low:.4g} to {self.high:.4g}"
        )


def groups_of(values: NDArray[Any], *, most: int) -> list[Group]:
    """Groups of numbers with about as many records each, equal values together; of names, one
    group a name.

    Parameters
    ----------
    values : (record,) numbers or names
    most : number of groups; fewer where values are equal. Names are not brought together
    """
    if values.dtype.kind in "US":
        return [
            Group(member=values == name, low=None, high=None, name=str(name))
            for name in np.unique(values)
        ]
    different = np.unique(values)
    if different.size <= most:
        place = np.searchsorted(different, values)
    else:
        edges = np.unique(np.quantile(values, np.linspace(0, 1, most + 1)[1:-1]))
        place = np.searchsorted(edges, values, side="left")
    groups = []
    for index in np.unique(place):
        member = place == index
        inside = values[member]
        groups.append(
            Group(
                member=member,
                low=float(inside.min()),
                high=float(inside.max()),
                name=None,
            )
        )
    return groups
