"""``plan.n_reference``: sound records of every unit after the examples, and in no split."""

import numpy as np
import pytest
from crossed_plan import CROSSED

from gensig.dataset.columns import IS_REFERENCE
from gensig.dataset.splitting.protocols import PROTOCOLS, make_splits, why_left_out
from gensig.dataset.splitting.split_check import split_problems
from gensig.errors import ConfigError
from gensig.plan.make import make_plan
from gensig.plan.notes import plan_notes
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader

SPEED = "operating.speed_rpm: {distribution: choice, values: [1200, 1800]}"
TORQUE = "operating.torque_nm: {distribution: uniform, low: 10, high: 40, levels: 3}"
QUICK = ("experiment=quickstart", *CROSSED, "operating.duration_s=0.02")
DESIGNS = {
    "latin_hypercube": QUICK,
    "sobol, repeats": (*QUICK, "plan.design=sobol", "plan.n_repeats=2"),
    "separate": (*QUICK, "plan.machines=separate", "plan.n_gearboxes=null"),
    "cut short": (*QUICK, "plan.n_records=90", "plan.n_units=30"),
    "sham": (*QUICK, "plan.sham=true"),
    "gear drawn": (*QUICK, "plan.fault_gear=drawn"),
    "grid": (
        "operating.duration_s=0.02",
        "plan.classes=[healthy,missing_tooth]",
        "plan.design=grid",
        "plan.n_records=null",
        "plan.n_units=6",
        f"plan.vary={{{SPEED}, {TORQUE}}}",
        "fault.vary={}",
    ),
}
N_EACH = 3


@pytest.fixture(scope="module", params=DESIGNS)
def both(request):
    """The configuration and its plan, without and with references."""
    words = DESIGNS[request.param]
    config = read_request([*words]).config
    more = config.with_keys("plan", n_reference=N_EACH)
    return more, make_plan(config), make_plan(more)


def equal(ours, theirs):
    return ((ours == theirs) | ((ours != ours) & (theirs != theirs))).all()


def test_examples_are_those_of_the_plan_without(both):
    """In ids, order, rows and every drawn value."""
    _, plain, plan = both
    n = plain.n_records
    assert IS_REFERENCE not in plain.columns
    assert set(plan.columns) - set(plain.columns) == {IS_REFERENCE}
    for name, values in plain.columns.items():
        assert equal(values, plan.columns[name][:n]), name
        assert equal(values, plan.examples().columns[name]) or name in ("shard", "row")
    assert not plan.is_reference[:n].any()
    assert plan.is_reference[n:].all()
    assert plain.examples() is plain


def test_every_unit_has_as_many_each_at_a_condition_of_its_own(both):
    _, plain, plan = both
    columns = {name: values[plain.n_records :] for name, values in plan.columns.items()}
    units, counts = np.unique(columns["unit_id"], return_counts=True)
    assert set(units) == set(plain.columns["unit_id"].tolist())
    assert set(counts.tolist()) == {N_EACH}
    conditions = columns["condition_id"].tolist()
    assert len(set(conditions)) == len(conditions)
    assert min(conditions) > max(plain.columns["condition_id"].tolist())
    parts = ("unit_id", "specimen_id", "gearbox_id")
    machines = [
        set(zip(*(of[name].tolist() for name in parts), strict=True))
        for of in (columns, plain.columns)
    ]
    assert machines[0] == machines[1]


def test_references_are_sound_and_drawn_from_the_distributions(both):
    config, plain, plan = both
    columns = {name: values[plain.n_records :] for name, values in plan.columns.items()}
    assert set(columns["label_name"].tolist()) == {"healthy"}
    assert set(columns["faults_json"].tolist()) == {"[]"}
    assert set(columns["severity"].tolist()) == {0.0}
    for key, spec in config["plan"]["vary"].items():
        values, examples = columns[f"params/{key}"], plain.columns[f"params/{key}"]
        if spec["distribution"] == "choice":
            assert set(values.tolist()) == set(spec["values"])
            continue
        low, high = spec["low"], spec["high"]
        assert low <= values.min() <= values.max() <= high
        assert np.ptp(values) > 0.7 * (high - low)
        assert not set(values.tolist()) & set(examples.tolist())


def test_no_split_has_a_reference_and_all_are_as_without(both):
    config, plain, plan = both
    tables, expected = make_splits(plan, config.seed), make_splits(plain, config.seed)
    assert {name: table.to_csv() for name, table in tables.items()} == {
        name: table.to_csv() for name, table in expected.items()
    }
    references = set(plan.columns["record_id"][plan.is_reference].tolist())
    for name, table in tables.items():
        assert not references & set(table.record_id.tolist())
        assert split_problems(name, table, plan) == []
    assert why_left_out(plan, config.seed) == why_left_out(plain, config.seed)
    assert plan_notes(InputReader(config), plan) == plan_notes(
        InputReader(config), plain
    )


@pytest.mark.parametrize("name", ["by_unit", "random_window_leaky"])
def test_the_check_finds_a_reference_in_a_split(name):
    config = read_request([*QUICK, "plan.n_records=80"]).config
    plain = make_plan(config)
    table = PROTOCOLS[name].outcome(plain, 0)
    last = np.arange(plain.n_records) >= plain.n_records - 2
    marked = type(plain)(columns={**plain.columns, IS_REFERENCE: last.astype(int)})
    (line,) = split_problems(name, table, marked)
    assert (
        line
        == f"{name}: record r000078 is a reference record, which no subset may have"
    )


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ("plan.classes=[crack,pitting]", "plan.n_reference=2"),
            "plan.n_reference = 2: reference records are healthy, but no class of plan.classes "
            "[crack, pitting] is; add healthy, or give 0",
        ),
        (
            ("experiment=run_to_failure", "plan.n_reference=1"),
            "plan.n_reference = 1: lives have no reference records; a machine is new at its first "
            "snapshot: give 0",
        ),
        (
            ("plan.n_reference=-1",),
            "plan.n_reference = -1 must be a whole number of at least 0",
        ),
    ],
    ids=["no healthy class", "lives", "negative"],
)
def test_what_cannot_be_is_refused(words, text):
    with pytest.raises(ConfigError) as caught:
        make_plan(read_request([*words]).config)
    assert str(caught.value) == text
