"""Protocols of splits: what a test score claims, from machines never seen to speeds, severities
and faults never seen.

Every protocol but the leaky one keeps whole units together, and with them their conditions and
noise seeds. One that also holds out a range of values trains and validates outside it and tests
inside it; a record that would be on the wrong side of its unit is in no subset.
"""

import functools
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.plan import Plan
from gensig.dataset.splitting.dealing import Deal, deal_groups
from gensig.dataset.splitting.splits import SUBSETS, SplitTable

N_WINDOWS = 8
MIN_SPECIMENS = 4
HELD_OUT = (
    0.25  # share of the records, or of a fault's records, whose values are held out
)
CONDITION_TEST_SHARE = (
    0.25  # of the units: where each unit has one condition, nothing is lost
)
SEVERITY_TEST_SHARE = (
    0.4  # of the units, because a test uses a quarter of their faults only
)

Mask = NDArray[np.bool_]
Outcome = SplitTable | str
HEALTHY = "[]"  # `faults_json` of a record without fault


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """How a split is made and what it keeps apart.

    Parameters
    ----------
    stream : int                   of its random numbers; adding a protocol leaves the others alone
    apart : tuple of text          plan columns of which no two subsets share a value
    make : (plan, rng) -> table    or one line that says why the plan cannot have it
    every_class : bool             whether every class is in every subset, as a classifier needs it
    """

    stream: int
    apart: tuple[str, ...]
    make: Callable[[Plan, np.random.Generator], Outcome]
    every_class: bool = True


def make_splits(plan: Plan, seed: int) -> dict[str, SplitTable]:
    """The protocols this plan can have; one whose subsets could not all hold their classes is
    left out.

    Parameters
    ----------
    plan : Plan    with `label` and, for the clean protocols, `unit_id` and the columns that they
                   hold out
    seed : int     the same plan and seed give the same splits

    Returns
    -------
    protocol -> SplitTable, a subset of `PROTOCOLS`
    """
    return {
        name: table
        for name, table in _outcomes(plan, seed)
        if isinstance(table, SplitTable)
    }


def why_left_out(
    plan: Plan, seed: int, names: Collection[str] | None = None
) -> dict[str, str]:
    """Protocol -> one line that says why this plan cannot have it, for those that `make_splits`
    leaves out.

    ``names`` are the protocols to ask about, None all of them.
    """
    return {
        name: reason
        for name, reason in _outcomes(plan, seed, names)
        if isinstance(reason, str)
    }


def _outcomes(
    plan: Plan, seed: int, names: Collection[str] | None = None
) -> list[tuple[str, Outcome]]:
    found: list[tuple[str, Outcome]] = []
    for name, protocol in PROTOCOLS.items():
        if names is not None and name not in names:
            continue
        sequence = np.random.SeedSequence(seed, spawn_key=(protocol.stream,))
        rng = np.random.Generator(np.random.Philox(sequence))
        missing = [
            column
            for column in ("label", *protocol.apart)
            if column not in plan.columns
        ]
        if missing and protocol.apart:
            found.append((name, f"the plan has no column {missing[0]}"))
        else:
            found.append((name, protocol.make(plan, rng)))
    return found


def _random_windows(plan: Plan, rng: np.random.Generator) -> SplitTable:
    """Eight windows of every record scattered over the subsets, so that a record is on every
    side: leaks on purpose.
    """
    n = plan.n_records
    # 5 windows train; the other three 2 + 1 or 1 + 2, which gives shares of 62.5 / 18.75 / 18.75
    # % on average.
    subset = np.tile([0, 0, 0, 0, 0, 1, 2, 0], (n, 1))
    subset[:, 7] = rng.integers(1, 3, size=n)
    subset = rng.permuted(subset, axis=1).ravel()
    start = np.tile(np.arange(N_WINDOWS) / N_WINDOWS, n)
    return SplitTable(
        record_id=np.repeat(plan.columns["record_id"], N_WINDOWS),
        start_fraction=start,
        stop_fraction=start + 1 / N_WINDOWS,
        subset=np.array(SUBSETS)[subset],
    )


def _by_group(
    column: str, min_groups: int, plan: Plan, rng: np.random.Generator
) -> Outcome:
    """Whole groups dealt 60 / 20 / 20.

    Of 40 to 49, ten are tested on, see `gensig.dataset.splitting.dealing`.
    """
    usable = np.ones((len(SUBSETS), plan.n_records), dtype=bool)
    return deal_groups(
        plan, Deal(column=column, usable=usable, min_groups=min_groups), rng
    )


def _cross_range(
    column: str, hold: str, plan: Plan, rng: np.random.Generator
) -> Outcome:
    """The highest or lowest quarter of a condition's values tested on, in units that are not
    trained on.
    """
    if column not in plan.columns:
        return f"the plan has no column {column}"
    values = np.asarray(plan.columns[column], dtype=float)
    if not np.isfinite(values).all():
        return (
            f"{column} is not a number in {int((~np.isfinite(values)).sum())} of {values.size} "
            "records"
        )
    held = _outer(values if hold == "highest" else -values)
    if not held.any():
        return f"{column} is {values[0]:g} in all records"
    deal = Deal(
        column="unit_id",
        usable=np.stack([~held, ~held, held]),
        test_share=CONDITION_TEST_SHARE,
        for_test=np.where(held, 1.0, -1.0),
    )
    return deal_groups(plan, deal, rng)


def _unseen_severity(
    hold: Callable[[NDArray[np.float64]], Mask], plan: Plan, rng: np.random.Generator
) -> Outcome:
    """A quarter of each fault's severities tested on, in units that are not trained on.

    Healthy records and those of a fault that has no severity to hold out are on every side.
    """
    if "severity" not in plan.columns:
        return "the plan has no column severity"
    severity = np.asarray(plan.columns["severity"], dtype=float)
    held, varies = (
        np.zeros(plan.n_records, dtype=bool),
        np.zeros(plan.n_records, dtype=bool),
    )
    for label in np.unique(plan.columns["label"]):
        records = np.flatnonzero(plan.columns["label"] == label)
        held[records] = hold(severity[records])
        varies[records] = held[records].any()
    if not held.any():
        return "no class has enough different severities to hold some out"
    deal = Deal(
        column="unit_id",
        usable=np.stack([~held, ~held, held | ~varies]),
        test_share=SEVERITY_TEST_SHARE,
        for_test=np.where(varies, np.where(held, 1.0, -1.0), 0.0),
    )
    return deal_groups(plan, deal, rng)


def _healthy_only(plan: Plan, rng: np.random.Generator) -> Outcome:
    """Healthy records alone for training and validation, all records of the tested units."""
    if "faults_json" not in plan.columns:
        return "the plan has no column faults_json"
    healthy = plan.columns["faults_json"] == HEALTHY
    if healthy.all() or not healthy.any():
        return f"the plan has no {'faulty' if healthy.all() else 'healthy'} records"
    everything = np.ones(plan.n_records, dtype=bool)
    usable = np.stack([healthy, healthy, everything])
    return deal_groups(
        plan, Deal(column="unit_id", usable=usable, every_class=False), rng
    )


def _open_set(plan: Plan, rng: np.random.Generator) -> Outcome:
    """One faulty class, drawn by the seed, tested on only.

    At least two classes remain to be told apart.
    """
    if "faults_json" not in plan.columns:
        return "the plan has no column faults_json"
    label = plan.columns["label"]
    faulty = np.unique(label[plan.columns["faults_json"] != HEALTHY])
    if not faulty.size or len(np.unique(label)) < 3:
        return "it needs three classes, one of them faulty: two to tell apart and one to withhold"
    known = label != rng.choice(faulty)
    everything = np.ones(plan.n_records, dtype=bool)
    usable = np.stack([known, known, everything])
    return deal_groups(
        plan, Deal(column="unit_id", usable=usable, every_class=False), rng
    )


def _outer(values: NDArray[np.float64]) -> Mask:
    """(record,) whether a value is above the cut that leaves nearest to a quarter above it.

    None if all are equal.
    """
    distinct, counts = np.unique(values, return_counts=True)
    if len(distinct) < 2:
        return np.zeros(len(values), dtype=bool)
    above = len(values) - np.cumsum(counts)[:-1]
    cut = distinct[np.abs(above - HELD_OUT * len(values)).argmin()]
    return values > cut


def _inner(values: NDArray[np.float64]) -> Mask:
    """(record,) whether a value is in the middle quarter by rank.

    At least one value, never the least or largest.
    """
    distinct, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    if len(distinct) < 3:
        return np.zeros(len(values), dtype=bool)
    middle = (np.cumsum(counts) - counts / 2) / len(values)
    away = np.abs(middle - 0.5)
    away[[0, -1]] = np.inf
    held = away < HELD_OUT / 2
    held[away.argmin()] = True
    return held[place]


def _cross(column: str, hold: str) -> Callable[[Plan, np.random.Generator], Outcome]:
    return functools.partial(_cross_range, column, hold)


_UNIT = ("unit_id",)
PROTOCOLS = {
    "random_window_leaky": Protocol(stream=9001, apart=(), make=_random_windows),
    "by_unit": Protocol(
        stream=9002,
        apart=_UNIT,
        make=functools.partial(_by_group, "unit_id", len(SUBSETS)),
    ),
    "cross_specimen": Protocol(
        stream=9003,
        apart=("specimen_id",),
        make=functools.partial(_by_group, "specimen_id", MIN_SPECIMENS),
    ),
    "cross_gearbox": Protocol(
        stream=9004,
        apart=("gearbox_id",),
        make=functools.partial(_by_group, "gearbox_id", len(SUBSETS)),
    ),
    "cross_speed": Protocol(
        stream=9005, apart=_UNIT, make=_cross("speed_set_rpm", "highest")
    ),
    "cross_torque": Protocol(
        stream=9006, apart=_UNIT, make=_cross("torque_nm", "highest")
    ),
    "cross_snr": Protocol(stream=9007, apart=_UNIT, make=_cross("snr_db", "lowest")),
    "unseen_severity_inner": Protocol(
        stream=9008, apart=_UNIT, make=functools.partial(_unseen_severity, _inner)
    ),
    "unseen_severity_outer": Protocol(
        stream=9009, apart=_UNIT, make=functools.partial(_unseen_severity, _outer)
    ),
    "healthy_only": Protocol(
        stream=9010, apart=_UNIT, make=_healthy_only, every_class=False
    ),
    "open_set": Protocol(stream=9011, apart=_UNIT, make=_open_set, every_class=False),
}
