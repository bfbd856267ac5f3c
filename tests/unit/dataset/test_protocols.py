"""Protocols over random plans: groups and held-out values apart, every class in each subset."""

import numpy as np
import pytest
from dataset_samples import sides

from gensig.dataset.plan import Plan, record_ids, shard_places
from gensig.dataset.splitting.protocols import PROTOCOLS, make_splits, why_left_out
from gensig.dataset.splitting.split_check import split_problems
from gensig.dataset.splitting.splits import SUBSETS, SplitTable

RANGES = {
    "cross_speed": "speed_set_rpm",
    "cross_torque": "torque_nm",
    "cross_snr": "snr_db",
}
SEVERITIES = ("unseen_severity_inner", "unseen_severity_outer")


def random_plan(seed, **fixed):
    """Conditions of units, each with one record a class, cut anywhere; values drawn, in levels, or
    all equal."""
    rng = np.random.default_rng(seed)
    n_units, n_classes = (
        fixed.get("n_units", int(rng.integers(1, 25))),
        fixed.get("n_classes", int(rng.integers(1, 6))),
    )
    n = fixed.get("n_records", int(rng.integers(n_classes, 400)))
    n_gearboxes = int(rng.integers(1, n_units + 1))
    condition = np.arange(n) // n_classes
    unit = condition % n_units
    label = rng.permuted(
        np.tile(np.arange(n_classes), (condition[-1] + 1, 1)), axis=1
    ).ravel()[:n]
    shard, row = shard_places(n, 50)

    def draw(low, high):
        values = rng.uniform(low, high, size=n)
        return (values, np.round(4 * values / high) * high / 4, np.full(n, high))[
            rng.integers(3)
        ]

    columns = {
        "record_id": record_ids(n),
        "shard": shard,
        "row": row,
        "label": label,
        "unit_id": np.char.add("unit-", unit.astype(str)),
        "gearbox_id": np.char.add("gearbox-", (unit % n_gearboxes).astype(str)),
        "specimen_id": np.char.add("specimen-", (unit // n_gearboxes).astype(str)),
        "faults_json": np.where(label == 0, "[]", '[{"kind": "crack"}]'),
        "severity": np.where(
            label == 0, 0.0, np.where(label == 3, 1.0, draw(0.1, 0.8))
        ),
        "speed_set_rpm": draw(1000.0, 2000.0)[condition],
        "torque_nm": draw(10.0, 40.0)[condition],
        "snr_db": draw(0.0, 30.0)[condition]
        if rng.random() < 0.8
        else np.full(n, np.nan),
    }
    return Plan(columns=columns)


PLANS = [random_plan(seed) for seed in range(60)]


@pytest.fixture(scope="module", params=range(len(PLANS)))
def made(request):
    return PLANS[request.param], make_splits(PLANS[request.param], request.param)


def test_random_plans_have_every_protocol_somewhere_and_lack_it_elsewhere():
    found = [set(make_splits(plan, seed)) for seed, plan in enumerate(PLANS)]
    counts = {name: sum(name in names for names in found) for name in PROTOCOLS}
    assert all(
        5 < count < 60
        for name, count in counts.items()
        if name != "random_window_leaky"
    ), counts


def test_a_protocol_is_made_or_its_lack_explained(made):
    plan, tables = made
    reasons = why_left_out(plan, PLANS.index(plan))
    assert {*tables, *reasons} == set(PROTOCOLS)
    assert not set(tables) & set(reasons)
    assert all(reason and "\n" not in reason for reason in reasons.values())


def test_nothing_is_on_two_sides(made):
    plan, tables = made
    for name, table in tables.items():
        assert split_problems(name, table, plan) == []
        for column in ("record_id", "unit_id") if name != "random_window_leaky" else ():
            parts = [set(part.tolist()) for part in sides(table, plan, column)]
            assert all(parts)
            assert sum(map(len, parts)) == len(set.union(*parts))


def test_every_class_is_on_every_side_of_a_closed_set(made):
    plan, tables = made
    classes = set(plan.columns["label"].tolist())
    for name, table in tables.items():
        train, validation, test = (
            set(part.tolist()) for part in sides(table, plan, "label")
        )
        assert test == classes
        if name == "healthy_only":
            assert train == validation == {0} != classes
        elif name == "open_set":
            assert train == validation
            assert 0 in train
            assert len(classes - train) == 1
            assert len(train) > 1
        else:
            assert train == validation == classes


def test_held_out_conditions_lie_beyond_those_of_training(made):
    plan, tables = made
    for name in set(RANGES) & set(tables):
        train, validation, test = sides(tables[name], plan, RANGES[name])
        sign = -1.0 if name == "cross_snr" else 1.0  # tested where there is more noise
        assert (
            max((sign * train).max(), (sign * validation).max()) < (sign * test).min()
        )


def test_held_out_severities_are_in_no_training(made):
    plan, tables = made
    for name in set(SEVERITIES) & set(tables):
        labels, values = (
            sides(tables[name], plan, "label"),
            sides(tables[name], plan, "severity"),
        )
        n_held = 0
        for label in np.unique(plan.columns["label"]).tolist():
            distinct = np.unique(
                plan.columns["severity"][plan.columns["label"] == label]
            )
            train, validation, test = (
                v[part == label] for v, part in zip(values, labels, strict=True)
            )
            learnt = np.concatenate([train, validation])
            if len(distinct) < (3 if name.endswith("inner") else 2):
                continue
            n_held += 1
            assert not ((learnt >= test.min()) & (learnt <= test.max())).any()
            assert (
                test.max() < distinct[-1]
                if name.endswith("inner")
                else learnt.max() < test.min()
            )
        assert n_held


def test_one_condition_a_unit_loses_no_record():
    plan = random_plan(3, n_units=40, n_classes=4, n_records=160)
    speed = np.repeat(np.random.default_rng(0).permutation(40) + 1000.0, 4)
    table = make_splits(Plan(columns={**plan.columns, "speed_set_rpm": speed}), 0)[
        "cross_speed"
    ]
    assert [int((table.subset == subset).sum()) for subset in SUBSETS] == [
        22 * 4,
        8 * 4,
        10 * 4,
    ]


@pytest.mark.parametrize(
    ("n_units", "n_train", "n_tested"),
    [
        (5, 3, 1),
        (10, 6, 2),
        (20, 12, 4),
        (39, 23, 8),
        (40, 22, 10),
        (49, 29, 10),
        (100, 60, 20),
    ],
)
def test_ten_units_are_tested_on_where_a_quarter_is_ten(n_units, n_train, n_tested):
    plan = random_plan(3, n_units=n_units, n_classes=4, n_records=800)
    units = sides(make_splits(plan, 0)["by_unit"], plan, "unit_id")
    sizes = [len(set(part.tolist())) for part in units]
    assert sizes == [n_train, n_units - n_train - n_tested, n_tested]


def test_levels_are_held_out_whole():
    plan = random_plan(3, n_units=20, n_classes=2, n_records=400)
    levels = np.array([0.2, 0.3, 0.4, 0.5])
    severity = np.where(
        plan.columns["label"] == 0, 0.0, np.repeat(levels[np.arange(200) // 20 % 4], 2)
    )
    poorer = Plan(columns={**plan.columns, "severity": severity})
    tables = make_splits(poorer, 0)
    for name, held in (("unseen_severity_inner", 0.3), ("unseen_severity_outer", 0.5)):
        train, validation, test = (
            set(part[part > 0].tolist())
            for part in sides(tables[name], poorer, "severity")
        )
        assert test == {held}
        assert train == validation == set(levels.tolist()) - {held}


def test_why_is_precise():
    plan = random_plan(5, n_units=12, n_classes=2, n_records=100)
    n = plan.n_records
    flat = {
        "speed_set_rpm": np.full(n, 1800.0),
        "snr_db": np.full(n, np.nan),
        "severity": np.zeros(n),
    }
    poor = {
        name: value for name, value in plan.columns.items() if name != "torque_nm"
    } | flat
    poor["gearbox_id"] = np.full(n, "gearbox-0")
    reasons = why_left_out(Plan(columns=poor), 0)
    assert reasons["cross_speed"] == "speed_set_rpm is 1800 in all records"
    assert reasons["cross_torque"] == "the plan has no column torque_nm"
    assert reasons["cross_snr"] == "snr_db is not a number in 100 of 100 records"
    assert (
        reasons["cross_gearbox"]
        == "1 gearbox_id in the plan, and at least 3 are needed"
    )
    assert (
        "no class has enough different severities" in reasons["unseen_severity_inner"]
    )
    assert "three classes" in reasons["open_set"]
    assert "healthy_only" not in reasons


def test_each_protocol_draws_from_its_own_stream():
    plan = random_plan(7, n_units=24, n_classes=4, n_records=384)
    assert len({protocol.stream for protocol in PROTOCOLS.values()}) == len(PROTOCOLS)
    ones, others = make_splits(plan, 1), make_splits(plan, 2)
    assert {name: table.to_csv() for name, table in ones.items()} == {
        name: table.to_csv() for name, table in make_splits(plan, 1).items()
    }
    assert all(ones[name].to_csv() != others[name].to_csv() for name in ones)


def moved(table, row, **change):
    """The table with one row more: a copy of another one, changed."""
    columns = {
        name: getattr(table, name)
        for name in ("record_id", "start_fraction", "stop_fraction", "subset")
    }
    return SplitTable(
        **{k: np.append(v, [change.get(k, v[row])]) for k, v in columns.items()}
    )


def test_the_check_finds_what_is_on_two_sides():
    plan = random_plan(7, n_units=24, n_classes=4, n_records=384)
    tables = make_splits(plan, 1)
    table = tables["by_unit"]
    train = int(np.flatnonzero(table.subset == "train")[0])
    name = table.record_id[train]
    lines = split_problems("by_unit", moved(table, train, subset="test"), plan)
    assert [line.partition(":")[0] for line in lines] == ["by_unit"] * 3
    assert f"a part of record {name} is given twice" in lines[0]
    assert f"record_id {name} is in more than one subset (1 such)" in lines[1]
    assert "unit_id unit-" in lines[2]
    subset = table.subset.copy()
    subset[train] = "test"
    torn = SplitTable(record_id=table.record_id, start_fraction=table.start_fraction,
                      stop_fraction=table.stop_fraction, subset=subset)  # fmt: skip
    assert len(split_problems("by_unit", torn, plan)) == 1
    assert split_problems("a_later_protocol", torn, plan) == []
    assert (
        "'r999999' is not in the plan"
        in split_problems("by_unit", moved(table, 0, record_id="r999999"), plan)[0]
    )
    leaky = tables["random_window_leaky"]
    assert (
        "given twice"
        in split_problems(
            "random_window_leaky", moved(leaky, 0, start_fraction=0.1), plan
        )[0]
    )
