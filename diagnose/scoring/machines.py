"""Machines behind a score, and the groups of them that an interval resamples.

Machines that share a set of gears or a gearbox are not independent: what they share is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

IntArray = NDArray[np.integer]
CountArray = NDArray[np.int64]

# Of n groups one resample in n^n holds the worst alone. For three or fewer that is more than
# 2.5 %, and a 95 % interval would end at the worst and the best group.
LEAST_UNITS = 4
MACHINES, LIVES = "machines", "lives"
# Column of what machines may share -> its name in texts.
SHARED = {"specimen_id": "sets of gears", "gearbox_id": "gearboxes"}


def units_drawn(n_units: int, n_bootstrap: int, rng: np.random.Generator) -> CountArray:
    """Number of times that each resample holds each unit, (resample, unit).

    A resample has as many draws with replacement as there are units.

    Source: Efron & Tibshirani (1993), "An introduction to the bootstrap", section 8.3 (units, not
    records, are drawn).
    """
    return rng.multinomial(n_units, np.full(n_units, 1 / n_units), size=n_bootstrap)


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """Number of groups that a resample draws for a score; of two kinds the one with fewer.

    Attributes
    ----------
    kind : name of the groups in texts, in the plural
    n_groups : number of them behind the score
    """

    kind: str
    n_groups: int

    @property
    def too_few(self) -> str | None:
        """Kind of the groups that are too few for an interval; None where they are enough."""
        if self.n_groups < LEAST_UNITS:
            return self.kind
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Grouping:
    """Units in groups that are drawn whole.

    Attributes
    ----------
    kind : name of the groups in texts, in the plural
    group : (unit,) number of the group of each unit, from 0
    """

    kind: str
    group: IntArray

    def drawn(self, n_bootstrap: int, rng: np.random.Generator) -> CountArray:
        """Number of times that each resample holds the group of each unit, (resample, unit)."""
        n_groups = int(self.group.max()) + 1
        return units_drawn(n_groups, n_bootstrap, rng)[:, self.group]

    def n_groups(self, unit: IntArray) -> int:
        """Number of groups that hold some units."""
        return int(np.unique(self.group[unit]).size)


@dataclass(frozen=True, slots=True, kw_only=True)
class Machines:
    """Units of test records, in order of their names, and what a resample of them draws.

    Attributes
    ----------
    groupings : one: the units themselves, or what is shared by them. Two, sets of gears and
        gearboxes, where both are shared
    """

    groupings: tuple[Grouping, ...]

    @classmethod
    def alone(cls, n_units: int, kind: str = MACHINES) -> Machines:
        """Units that share nothing."""
        return cls(groupings=(Grouping(kind=kind, group=np.arange(n_units)),))

    @property
    def n_units(self) -> int:
        """Number of units."""
        return int(self.groupings[0].group.size)

    def drawn(self, n_bootstrap: int, rng: np.random.Generator) -> CountArray:
        """Weight of each unit in each resample, (resample, unit).

        With two groupings it is the number of times that its gears are drawn, times that of its
        gearbox. The interval is then about as wide as the truth or wider.

        Source: Owen (2007), "The pigeonhole bootstrap", Annals of Applied Statistics 1 (2).
        """
        weight = self.groupings[0].drawn(n_bootstrap, rng)
        for grouping in self.groupings[1:]:
            weight = weight * grouping.drawn(n_bootstrap, rng)
        return weight

    def support(self, unit: IntArray | None = None) -> Support:
        """Groups behind a score of some units, or of all."""
        if unit is None:
            unit = np.arange(self.n_units)
        counts = [
            Support(kind=grouping.kind, n_groups=grouping.n_groups(unit))
            for grouping in self.groupings
        ]
        return min(counts, key=lambda support: support.n_groups)

    def counts(self) -> dict[str, int]:
        """Name of what is drawn -> number of groups."""
        every = np.arange(self.n_units)
        return {grouping.kind: grouping.n_groups(every) for grouping in self.groupings}

    def coarsest(self) -> Grouping:
        """The grouping with the fewest groups."""
        every = np.arange(self.n_units)
        return min(self.groupings, key=lambda grouping: grouping.n_groups(every))


def machines_of(
    dataset: Dataset,
    record: IntArray,
    *,
    unit: NDArray[Any] | None = None,
    kind: str = MACHINES,
) -> Machines:
    """Machines of some records of a data set.

    A data set that does not say which gears and gearbox a unit has counts its units as alone.

    Parameters
    ----------
    record : (record,) index in the data set
    unit : (record,) name of the unit of each of them; None: its ``unit_id``
    kind : name of the units in texts, in the plural
    """
    if unit is None:
        unit = np.asarray(dataset.column("unit_id"))[record]
    names, first = np.unique(unit, return_index=True)
    groupings = []
    for column, shared in SHARED.items():
        if column in dataset.column_names:
            values = np.asarray(dataset.column(column))[record][first]
            groups, group = np.unique(values, return_inverse=True)
            if groups.size < names.size:
                groupings.append(Grouping(kind=shared, group=group))
    if not groupings:
        return Machines.alone(names.size, kind)
    return Machines(groupings=tuple(groupings))
