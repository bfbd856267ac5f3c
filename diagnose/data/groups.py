"""Groups of records by a value, for curves over a condition or a severity."""

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
        if self.low == self.high:
            return f"{self.low:.4g}"
        return f"{self.low:.4g} to {self.high:.4g}"


def groups_of(values: NDArray[Any], *, most: int) -> list[Group]:
    """Groups of numbers with about as many records each, or one group for each name.

    Equal values are in one group.

    Parameters
    ----------
    values : (record,) numbers or names
    most : number of groups; fewer where values are equal. Names are not merged
    """
    if values.dtype.kind in "US":
        return [
            Group(member=values == name, low=None, high=None, name=str(name))
            for name in np.unique(values)
        ]
    edges = np.unique(values)
    if edges.size > most:
        edges = np.unique(np.quantile(values, np.linspace(0, 1, most + 1)[1:-1]))
    position = np.searchsorted(edges, values)
    groups = []
    for index in np.unique(position):
        member = position == index
        low, high = float(values[member].min()), float(values[member].max())
        groups.append(Group(member=member, low=low, high=high, name=None))
    return groups
