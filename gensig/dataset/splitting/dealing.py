"""Deals of whole groups to train, validation and test."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Flags, Integers
from gensig.dataset.plan import Plan
from gensig.dataset.splitting.splits import SUBSETS, SplitTable

TRAIN, VALIDATION, TEST = range(len(SUBSETS))
VALIDATION_SHARE = 0.2
MIN_TESTED = 10  # groups: an interval over fewer is too narrow
MAX_FOR_TESTS = 0.25  # of the groups, so that training keeps more than half
# One group of a column in words, and several.
GROUP_NAMES = {
    "unit_id": ("machine", "machines"),
    "specimen_id": ("set of gears", "sets of gears"),
    "gearbox_id": ("gearbox", "gearboxes"),
}
_ATTEMPTS = 200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deal:
    """Demands of a protocol on a deal of whole groups.

    Parameters
    ----------
    column : text                         plan column of the groups; none of them is on two sides
    groups : (record,) or None            the groups, where no column holds them; ``column`` is
        then their name in a reason
    usable : (subset, record) bool        whether a record is used if its group is dealt to that
        subset
    min_groups : int                      fewer groups are no deal
    test_share : float                    of the groups; `MIN_TESTED` where that is no more than
        `MAX_FOR_TESTS`
    validation_share : float              of the groups
    for_test : (record,) float or None    groups of the largest sum are tested on, as long as all
        classes are there
    every_class : bool                    whether a subset needs every class of the plan, or only
        those it may use
    """

    column: str
    usable: Flags
    groups: Integers | None = None
    min_groups: int = len(SUBSETS)
    test_share: float = 0.2
    validation_share: float = VALIDATION_SHARE
    for_test: Array | None = None
    every_class: bool = True


def deal_groups(plan: Plan, deal: Deal, rng: np.random.Generator) -> SplitTable | str:
    """Table of one deal in which every subset has every class that it needs.

    One line with the reason where there is none. A record that its group's side may not use is in
    no subset. Of the groups at least one is dealt to each side.
    """
    groups = deal.groups
    if groups is None:
        groups = plan.columns[deal.column]
    names, group = np.unique(groups, return_inverse=True)
    if len(names) < deal.min_groups:
        return (
            f"the plan has {_counted(len(names), deal.column)}, and at least {deal.min_groups} "
            "are needed"
        )
    classes, label = np.unique(plan.columns["label"], return_inverse=True)
    holds = np.zeros((len(SUBSETS), len(names), len(classes)), dtype=bool)
    for subset, usable in enumerate(deal.usable):
        holds[subset, group[usable], label[usable]] = True
    needed = holds.any(axis=1) | deal.every_class
    for name, usable_classes in zip(SUBSETS, holds.any(axis=1) >= needed, strict=True):
        if not usable_classes.all():
            return f"a class has no record that may be used for {name}"
    n_validation = max(1, round(deal.validation_share * len(names)))
    n_test = max(1, round(deal.test_share * len(names)))
    if MAX_FOR_TESTS * len(names) >= MIN_TESTED:
        n_test = max(n_test, MIN_TESTED)
    n_train = len(names) - n_validation - n_test
    in_order = np.repeat([TRAIN, VALIDATION, TEST], [n_train, n_validation, n_test])
    for attempt in range(_ATTEMPTS):
        side = rng.permutation(in_order)
        if deal.for_test is not None and attempt < _ATTEMPTS // 2:
            worth = np.bincount(group, deal.for_test).astype(float)
            side = _best_tested(side, worth, rng)
        sides = enumerate(holds)
        present = np.stack([held[side == k].any(axis=0) for k, held in sides])
        if (present >= needed).all():
            return _table(plan, side[group], deal.usable)
    dealt = _counted(len(names), deal.column)
    return f"no deal of {dealt} found that gives every subset all its classes"


def _counted(n: int, column: str) -> str:
    """A number of groups in words, such as '1 set of gears'."""
    return f"{n} {GROUP_NAMES.get(column, (column, column))[n != 1]}"


def _best_tested(
    side: NDArray[np.integer], worth: Array, rng: np.random.Generator
) -> NDArray[np.integer]:
    """The same numbers of groups a side, those of the largest worth tested on.

    Ties and the rest by chance.
    """
    order = np.lexsort((rng.random(len(side)), worth))
    dealt = np.empty_like(side)
    dealt[order] = np.concatenate([side[side != TEST], side[side == TEST]])
    return dealt


def _table(plan: Plan, subset: NDArray[np.integer], usable: Flags) -> SplitTable:
    """Whole records in the order of the plan."""
    kept = np.flatnonzero(usable[subset, np.arange(plan.n_records)])
    return SplitTable(
        record_id=plan.columns["record_id"][kept],
        start_fraction=np.zeros(len(kept), dtype=int),
        stop_fraction=np.ones(len(kept), dtype=int),
        subset=np.array(SUBSETS)[subset[kept]],
    )
