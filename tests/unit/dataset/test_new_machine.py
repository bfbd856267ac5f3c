"""``new_machine``: tested machines share neither gears nor gearbox with those of training."""

import numpy as np
import pytest
from dataset_samples import sides
from hypothesis import given, settings
from hypothesis import strategies as st

from gensig.dataset.plan import Plan, record_ids, shard_rows
from gensig.dataset.splitting.protocols import NEW_MACHINE, PROTOCOLS, why_left_out
from gensig.dataset.splitting.split_check import split_problems
from gensig.dataset.splitting.splits import SplitTable

PARTS = ("unit_id", "specimen_id", "gearbox_id")


def plan_of(specimen, gearbox, n_classes=2):
    """One record a class of each unit, given by its set of gears and its gearbox."""
    unit = np.repeat(np.arange(len(specimen)), n_classes)
    shard, row = shard_rows(len(unit), 50)
    columns = {
        "record_id": record_ids(len(unit)),
        "shard": shard,
        "row": row,
        "label": np.tile(np.arange(n_classes), len(specimen)),
        "unit_id": [f"u{number}" for number in unit],
        "specimen_id": [f"s{specimen[number]}" for number in unit],
        "gearbox_id": [f"g{gearbox[number]}" for number in unit],
    }
    return Plan(columns={name: np.array(values) for name, values in columns.items()})


def dealt(plan, seed=0):
    return PROTOCOLS[NEW_MACHINE].outcome(plan, seed)


def separate(n_units):
    return plan_of(range(n_units), range(n_units))


MACHINES = st.lists(
    st.tuples(st.integers(0, 20), st.integers(0, 20)),
    min_size=5,
    max_size=40,
    unique=True,
)


@settings(max_examples=100, deadline=None)
@given(machines=MACHINES, seed=st.integers(0, 2**31))
def test_no_gears_and_no_gearbox_are_on_two_sides(machines, seed):
    """Whatever shares what: a split is clean, or one line says why there is none."""
    plan = plan_of(*zip(*machines, strict=True))
    table = dealt(plan, seed)
    if isinstance(table, str):
        assert "\n" not in table
        return
    for column in PARTS:
        parts = [set(part.tolist()) for part in sides(table, plan, column)]
        assert all(parts)
        assert sum(map(len, parts)) == len(set.union(*parts))
    assert len(table.record_id) == plan.n_records
    assert all(set(part.tolist()) == {0, 1} for part in sides(table, plan, "label"))
    assert split_problems(NEW_MACHINE, table, plan) == []


SIZES = {5: (3, 1, 1), 10: (7, 1, 2), 20: (14, 2, 4), 40: (26, 4, 10), 60: (42, 6, 12)}


@pytest.mark.parametrize("n_units", SIZES)
def test_seven_tenths_train(n_units):
    plan = separate(n_units)
    units = sides(dealt(plan), plan, "unit_id")
    assert tuple(len(set(part.tolist())) for part in units) == SIZES[n_units]


def test_machines_that_share_through_others_stay_together():
    """A chain: unit 0 and 1 share gears, 1 and 2 a gearbox, and so on to unit 9."""
    numbers = np.arange(20)
    chain = numbers < 10
    specimen = np.where(chain, numbers // 2, numbers)
    gearbox = np.where(chain, (numbers + 1) // 2, numbers)
    plan = plan_of(specimen, gearbox)
    for seed in range(20):
        units = sides(dealt(plan, seed), plan, "unit_id")
        chained = [len({f"u{k}" for k in range(10)} & set(part)) for part in units]
        assert sorted(chained) == [0, 0, 10]


LACKS = "groups of machines that share neither gears nor gearbox, and 5 are needed"


@pytest.mark.parametrize(
    ("plan", "reason"),
    [
        (
            plan_of(np.arange(40) // 4, np.arange(40) % 4),
            f"the plan has 1 {LACKS.replace('groups', 'group', 1)}: plan.machines=separate",
        ),
        (
            plan_of(np.arange(8), np.arange(8) // 2),
            f"the plan has 4 {LACKS}: plan.machines=separate",
        ),
        (separate(4), f"the plan has 4 {LACKS}: plan.n_units=5 or more"),
    ],
    ids=["crossed", "shared gearboxes", "few"],
)
def test_too_few_groups_are_told_with_the_remedy(plan, reason):
    assert dealt(plan) == reason
    assert why_left_out(plan, 0, (NEW_MACHINE,)) == {NEW_MACHINE: reason}


def test_every_class_is_needed_on_every_side():
    plan = separate(6)
    labels = np.where(plan.columns["unit_id"] == "u0", plan.columns["label"], 0)
    reason = dealt(Plan(columns={**plan.columns, "label": labels}))
    assert reason.startswith("no deal of 6 groups of machines found")


def test_it_comes_first():
    assert next(iter(PROTOCOLS)) == NEW_MACHINE


def test_the_check_finds_a_gearbox_on_two_sides():
    """A split that is clean by unit and by gears, but not by gearbox."""
    plan = plan_of(np.arange(10), np.arange(10) // 2)
    table = PROTOCOLS["by_unit"].outcome(plan, 3)
    assert isinstance(table, SplitTable)
    (line,) = split_problems(NEW_MACHINE, table, plan)
    assert line.startswith("new_machine: gearbox_id g")
