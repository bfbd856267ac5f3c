"""Protocols of splits, which test on unseen machines, speeds, loads, severities and faults.

Every protocol but the leaky one keeps whole units together, and with them their conditions and
noise seeds. One that also holds out a range of values trains and validates outside it and tests
inside it; a record that would be on the wrong side of its unit is in no subset.
"""

import functools
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array, Flags, Integers
from gensig.dataset.plan import Plan
from gensig.dataset.splitting.dealing import Deal, deal_groups
from gensig.dataset.splitting.splits import SUBSETS, SplitTable

NEW_MACHINE = "new_machine"
N_WINDOWS = 8
MIN_MACHINES = 5  # groups that share neither gears nor gearbox
MACHINE_VALIDATION_SHARE = 0.1  # of them: 70 / 10 / 20
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

# Ids of a machine and of what it is made of.
MACHINE_COLUMNS = ("specimen_id", "gearbox_id", "unit_id")
Outcome = SplitTable | str
HEALTHY = "[]"  # `faults_json` of a record without fault


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """Definition of a split and of the groups that it keeps apart.

    Parameters
    ----------
    stream : int                   of its random numbers; adding a protocol leaves the others alone
    apart : tuple of text          plan columns of which no two subsets share a value
    needs : tuple of text          further plan columns that it reads
    make : (plan, rng) -> table    or one line with the reason why the plan cannot have it
    every_class : bool             whether every class is in every subset, as a classifier needs it
    """

    stream: int
    make: Callable[[Plan, np.random.Generator], Outcome]
    apart: tuple[str, ...] = ("unit_id",)
    needs: tuple[str, ...] = ()
    every_class: bool = True

    def outcome(self, plan: Plan, seed: int) -> Outcome:
        """Table of a plan's examples, or one line with the reason why it cannot have one."""
        for column in ("label", *self.apart, *self.needs):
            if column not in plan.columns and self.apart:
                return f"the plan has no column {column}"
        sequence = np.random.SeedSequence(seed, spawn_key=(self.stream,))
        return self.make(
            plan.examples(), np.random.Generator(np.random.Philox(sequence))
        )


def make_splits(plan: Plan, seed: int) -> dict[str, SplitTable]:
    """Tables, by protocol, of the protocols that a plan can have.

    A protocol whose subsets could not all hold their classes is left out.

    Parameters
    ----------
    plan : Plan    with `label` and, for the clean protocols, `unit_id` and the columns that they
                   hold out
    seed : int     the same plan and seed give the same splits

    Returns
    -------
    protocol -> SplitTable, a subset of `PROTOCOLS`
    """
    tables = {}
    for name, protocol in PROTOCOLS.items():
        outcome = protocol.outcome(plan, seed)
        if isinstance(outcome, SplitTable):
            tables[name] = outcome
    return tables


def why_left_out(
    plan: Plan, seed: int, names: Collection[str] | None = None
) -> dict[str, str]:
    """Reasons in one line each, by protocol, for those that `make_splits` leaves out.

    ``names`` are the protocols to ask about, None all of them.
    """
    reasons = {}
    for name, protocol in PROTOCOLS.items():
        if names is None or name in names:
            outcome = protocol.outcome(plan, seed)
            if isinstance(outcome, str):
                reasons[name] = outcome
    return reasons


def _random_windows(plan: Plan, rng: np.random.Generator) -> SplitTable:
    """Eight windows of every record, scattered over the subsets: leaks on purpose."""
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
    deal = Deal(column=column, usable=usable, min_groups=min_groups)
    return deal_groups(plan, deal, rng)


def _new_machine(plan: Plan, rng: np.random.Generator) -> Outcome:
    """Machines dealt 70 / 10 / 20, none with gears or a gearbox of another subset."""
    machine = _connected_machines(plan)
    n_machines = len(np.unique(machine))
    if n_machines < MIN_MACHINES:
        remedy = "plan.machines=separate"
        if n_machines == len(np.unique(plan.columns["unit_id"])):
            remedy = f"plan.n_units={MIN_MACHINES} or more"
        return (
            f"the plan has {n_machines} group{'s' * (n_machines != 1)} of machines that share "
            f"neither gears nor gearbox, and {MIN_MACHINES} are needed: {remedy}"
        )
    deal = Deal(
        column="groups of machines",
        groups=machine,
        usable=np.ones((len(SUBSETS), plan.n_records), dtype=bool),
        min_groups=MIN_MACHINES,
        validation_share=MACHINE_VALIDATION_SHARE,
    )
    return deal_groups(plan, deal, rng)


def _connected_machines(plan: Plan) -> Integers:
    """(record,) Number of the connected component of the record's machine.

    Units are connected that share a set of gears or a gearbox, also through others.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    numbers, n_nodes = [], 0
    for column in MACHINE_COLUMNS:
        names, number = np.unique(plan.columns[column], return_inverse=True)
        numbers.append(n_nodes + number)
        n_nodes += len(names)
    first, *others = numbers
    ends = np.concatenate(others)
    begins = np.tile(first, len(others))
    edges = coo_array((np.ones(len(ends)), (begins, ends)), shape=(n_nodes, n_nodes))
    component = connected_components(edges, directed=False)[1]
    return component[first].astype(np.int64)


def _cross_range(
    column: str, sign: float, plan: Plan, rng: np.random.Generator
) -> Outcome:
    """The quarter of a condition's values that is highest, times ``sign``, tested on.

    It is tested in units that are not trained on.
    """
    values = np.asarray(plan.columns[column], dtype=float)
    n_missing = int((~np.isfinite(values)).sum())
    if n_missing:
        return f"{column} is not a number in {n_missing} of {values.size} records"
    held = _outer(sign * values)
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
    hold: Callable[[Array], Flags], plan: Plan, rng: np.random.Generator
) -> Outcome:
    """A quarter of each fault's severities tested on, in units that are not trained on.

    Healthy records and those of a fault that has no severity to hold out are on every side.
    """
    severity = np.asarray(plan.columns["severity"], dtype=float)
    held, varies = np.zeros((2, plan.n_records), dtype=bool)
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
    healthy = plan.columns["faults_json"] == HEALTHY
    if healthy.all():
        return "the plan has no faulty records"
    if not healthy.any():
        return "the plan has no healthy records"
    return _tested_on_everything(plan, healthy, rng)


def _open_set(plan: Plan, rng: np.random.Generator) -> Outcome:
    """One faulty class, drawn by the seed, tested on only.

    At least two classes remain to be told apart.
    """
    label = plan.columns["label"]
    faulty = np.unique(label[plan.columns["faults_json"] != HEALTHY])
    if not faulty.size or len(np.unique(label)) < 3:
        return "it needs three classes, one of them faulty: two to tell apart and one to withhold"
    known = label != rng.choice(faulty)
    return _tested_on_everything(plan, known, rng)


def _tested_on_everything(
    plan: Plan, known: Flags, rng: np.random.Generator
) -> Outcome:
    """Known records alone for training and validation, all records of the tested units."""
    usable = np.stack([known, known, np.ones_like(known)])
    deal = Deal(column="unit_id", usable=usable, every_class=False)
    return deal_groups(plan, deal, rng)


def _outer(values: Array) -> Flags:
    """(record,) True above the cut that leaves nearest to a quarter of the values above it.

    No value if all are equal.
    """
    distinct, counts = np.unique(values, return_counts=True)
    if len(distinct) < 2:
        return np.zeros(len(values), dtype=bool)
    above = len(values) - np.cumsum(counts)[:-1]
    cut = distinct[np.abs(above - HELD_OUT * len(values)).argmin()]
    return values > cut


def _inner(values: Array) -> Flags:
    """(record,) True in the middle quarter by rank.

    At least one value, never the least or largest.
    """
    distinct, rank, counts = np.unique(values, return_inverse=True, return_counts=True)
    if len(distinct) < 3:
        return np.zeros(len(values), dtype=bool)
    middle = (np.cumsum(counts) - counts / 2) / len(values)
    away = np.abs(middle - 0.5)
    away[[0, -1]] = np.inf
    held = away < HELD_OUT / 2
    held[away.argmin()] = True
    return held[rank]


def _by(column: str, min_groups: int, stream: int) -> Protocol:
    make = functools.partial(_by_group, column, min_groups)
    return Protocol(stream=stream, make=make, apart=(column,))


def _cross(column: str, sign: float, stream: int) -> Protocol:
    make = functools.partial(_cross_range, column, sign)
    return Protocol(stream=stream, make=make, needs=(column,))


def _severity(hold: Callable[[Array], Flags], stream: int) -> Protocol:
    make = functools.partial(_unseen_severity, hold)
    return Protocol(stream=stream, make=make, needs=("severity",))


def _partly_trained(
    make: Callable[[Plan, np.random.Generator], Outcome], stream: int
) -> Protocol:
    return Protocol(stream=stream, make=make, needs=("faults_json",), every_class=False)


PROTOCOLS = {
    NEW_MACHINE: Protocol(stream=9012, make=_new_machine, apart=MACHINE_COLUMNS),
    "random_window_leaky": Protocol(stream=9001, make=_random_windows, apart=()),
    "by_unit": _by("unit_id", len(SUBSETS), 9002),
    "cross_specimen": _by("specimen_id", MIN_SPECIMENS, 9003),
    "cross_gearbox": _by("gearbox_id", len(SUBSETS), 9004),
    "cross_speed": _cross("speed_set_rpm", 1.0, 9005),
    "cross_torque": _cross("torque_nm", 1.0, 9006),
    "cross_snr": _cross("snr_db", -1.0, 9007),
    "unseen_severity_inner": _severity(_inner, 9008),
    "unseen_severity_outer": _severity(_outer, 9009),
    "healthy_only": _partly_trained(_healthy_only, 9010),
    "open_set": _partly_trained(_open_set, 9011),
}
