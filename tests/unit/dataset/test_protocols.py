"""Protocols over random plans: groups and held-out values apart, every class in each subset."""

from dataclasses import replace

import numpy as np
import pytest
from dataset_samples import sides

from gensig.dataset.plan import Plan, record_ids, shard_rows
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
    n_units = fixed.get("n_units", int(rng.integers(1, 25)))
    n_classes = fixed.get("n_classes", int(rng.integers(1, 6)))
    n = fixed.get("n_records", int(rng.integers(n_classes, 400)))
    n_gearboxes = int(rng.integers(1, n_units + 1))
    condition = np.arange(n) // n_classes
    unit = condition % n_units
    classes = np.tile(np.arange(n_classes), (condition[-1] + 1, 1))
    label = rng.permuted(classes, axis=1).ravel()[:n]
    shard, row = shard_rows(n, 50)

    def draw(low, high):
        values = rng.uniform(low, high, size=n)
        levels = np.round(4 * values / high) * high / 4
        return (values, levels, np.full(n, high))[rng.integers(3)]

    severity = np.select([label == 0, label == 3], [0.0, 1.0], draw(0.1, 0.8))
    speed, torque = draw(1000.0, 2000.0)[condition], draw(10.0, 40.0)[condition]
    snr = draw(0.0, 30.0)[condition] if rng.random() < 0.8 else np.full(n, np.nan)
    specimen, gearbox = unit // n_gearboxes, unit % n_gearboxes
    machines = fixed.get("machines", rng.choice(["crossed", "paired", "separate"]))
    if machines == "paired":  # two units share their gears
        specimen, gearbox = unit // 2, unit
    elif machines == "separate":
        specimen, gearbox = unit, unit
    return Plan(
        columns={
            "record_id": record_ids(n),
            "shard": shard,
            "row": row,
            "label": label,
            "unit_id": np.char.add("unit-", unit.astype(str)),
            "gearbox_id": np.char.add("gearbox-", gearbox.astype(str)),
            "specimen_id": np.char.add("specimen-", specimen.astype(str)),
            "faults_json": np.where(label == 0, "[]", '[{"kind": "crack"}]'),
            "severity": severity,
            "speed_set_rpm": speed,
            "torque_nm": torque,
            "snr_db": snr,
        }
    )


def changed(plan, **columns):
    return Plan(columns={**plan.columns, **columns})


PLANS = [random_plan(seed) for seed in range(60)]


@pytest.fixture(scope="module", params=range(len(PLANS)))
def made(request):
    return PLANS[request.param], make_splits(PLANS[request.param], request.param)


def test_random_plans_have_every_protocol_somewhere_and_lack_it_elsewhere():
    result = [set(make_splits(plan, seed)) for seed, plan in enumerate(PLANS)]
    for name in set(PROTOCOLS) - {"random_window_leaky"}:
        assert 5 < sum(name in names for names in result) < 60, name


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
        if name == "random_window_leaky":
            continue
        for column in ("record_id", "unit_id"):
            parts = [set(part.tolist()) for part in sides(table, plan, column)]
            assert all(parts)
            assert sum(map(len, parts)) == len(set.union(*parts))


def test_every_class_is_on_every_side_of_a_closed_set(made):
    plan, tables = made
    classes = set(plan.columns["label"].tolist())
    for name, table in tables.items():
        labels = sides(table, plan, "label")
        train, validation, test = (set(part.tolist()) for part in labels)
        assert test == classes
        assert train == validation
        if name == "healthy_only":
            assert train == {0} != classes
        elif name == "open_set":
            assert 0 in train
            assert len(classes - train) == 1 < len(train)
        else:
            assert train == classes


def test_held_out_conditions_lie_beyond_those_of_training(made):
    plan, tables = made
    for name in set(RANGES) & set(tables):
        sign = {"cross_snr": -1.0}.get(name, 1.0)  # tested where there is more noise
        parts = [sign * part for part in sides(tables[name], plan, RANGES[name])]
        train, validation, test = parts
        assert max(train.max(), validation.max()) < test.min()


def test_held_out_severities_are_in_no_training(made):
    plan, tables = made
    label, severity = plan.columns["label"], plan.columns["severity"]
    for name in set(SEVERITIES) & set(tables):
        is_inner = name == "unseen_severity_inner"
        labels = sides(tables[name], plan, "label")
        values = sides(tables[name], plan, "severity")
        n_held = 0
        for number in np.unique(label).tolist():
            distinct = np.unique(severity[label == number])
            if len(distinct) < 2 + is_inner:
                continue
            n_held += 1
            both = zip(values, labels, strict=True)
            *learnt, test = (part[own == number] for part, own in both)
            learnt = np.concatenate(learnt)
            assert not ((learnt >= test.min()) & (learnt <= test.max())).any()
            assert test.max() < distinct[-1] or not is_inner
            assert learnt.max() < test.min() or is_inner
        assert n_held


def test_one_condition_a_unit_loses_no_record():
    plan = random_plan(3, n_units=40, n_classes=4, n_records=160)
    speed = np.repeat(np.random.default_rng(0).permutation(40) + 1000.0, 4)
    table = make_splits(changed(plan, speed_set_rpm=speed), 0)["cross_speed"]
    sizes = [np.sum(table.subset == subset) for subset in SUBSETS]
    assert sizes == [22 * 4, 8 * 4, 10 * 4]


SIZES = {
    5: (3, 1, 1),
    10: (6, 2, 2),
    39: (23, 8, 8),
    40: (22, 8, 10),
    100: (60, 20, 20),
}


@pytest.mark.parametrize("n_units", SIZES)
def test_ten_units_are_tested_on_where_a_quarter_is_ten(n_units):
    plan = random_plan(3, n_units=n_units, n_classes=4, n_records=800)
    units = sides(make_splits(plan, 0)["by_unit"], plan, "unit_id")
    assert tuple(len(set(part.tolist())) for part in units) == SIZES[n_units]


@pytest.mark.parametrize(("kind", "held"), [("inner", 0.3), ("outer", 0.5)])
def test_levels_are_held_out_whole(kind, held):
    plan = random_plan(3, n_units=20, n_classes=2, n_records=400)
    levels = np.array([0.2, 0.3, 0.4, 0.5])
    drawn = np.repeat(levels[np.arange(200) // 20 % 4], 2)
    severity = np.where(plan.columns["label"] == 0, 0.0, drawn)
    poorer = changed(plan, severity=severity)
    table = make_splits(poorer, 0)[f"unseen_severity_{kind}"]
    values = sides(table, poorer, "severity")
    train, validation, test = (set(part[part > 0].tolist()) for part in values)
    assert test == {held}
    assert train == validation == set(levels.tolist()) - {held}


def test_why_is_precise():
    plan = random_plan(5, n_units=12, n_classes=2, n_records=100)
    poor = dict(plan.columns)
    del poor["torque_nm"]
    poor["gearbox_id"] = np.full(100, "gearbox-0")
    for name, value in (("speed_set_rpm", 1800), ("snr_db", np.nan), ("severity", 0)):
        poor[name] = np.full(100, float(value))
    reasons = why_left_out(Plan(columns=poor), 0)
    expected = {
        "cross_speed": "speed_set_rpm is 1800 in all records",
        "cross_torque": "the plan has no column torque_nm",
        "cross_snr": "snr_db is not a number in 100 of 100 records",
        "cross_gearbox": "the plan has 1 gearbox, and at least 3 are needed",
        "unseen_severity_inner": "no class has enough different severities",
        "open_set": "three classes",
    }
    assert {name: text in reasons[name] for name, text in expected.items()} == (
        dict.fromkeys(expected, True)
    )
    assert "healthy_only" not in reasons


@pytest.fixture(scope="module")
def plan():
    """A plan that has every protocol."""
    return random_plan(7, n_units=24, n_classes=4, n_records=384)


def test_each_protocol_draws_from_its_own_stream(plan):
    assert len({protocol.stream for protocol in PROTOCOLS.values()}) == len(PROTOCOLS)
    first, same, other = (
        {name: table.to_csv() for name, table in make_splits(plan, seed).items()}
        for seed in (1, 1, 2)
    )
    assert first == same
    assert all(first[name] != other[name] for name in first)


def moved(table, row, **change):
    """The table with one row more: a copy of another one, changed."""
    names = ("record_id", "start_fraction", "stop_fraction", "subset")
    columns = {name: getattr(table, name) for name in names}
    more = {name: change.get(name, values[row]) for name, values in columns.items()}
    return SplitTable(
        **{name: np.append(columns[name], [more[name]]) for name in names}
    )


def test_the_check_finds_what_is_on_two_sides(plan):
    tables = make_splits(plan, 1)
    table, leaky = tables["by_unit"], tables["random_window_leaky"]
    train = int(np.flatnonzero(table.subset == "train")[0])
    name = table.record_id[train]
    lines = split_problems("by_unit", moved(table, train, subset="test"), plan)
    assert [line.partition(":")[0] for line in lines] == ["by_unit"] * 3
    assert f"a part of record {name} is given twice" in lines[0]
    assert f"record_id {name} is in more than one subset (1 such)" in lines[1]
    assert "unit_id unit-" in lines[2]
    torn = replace(table, subset=table.subset.copy())
    torn.subset[train] = "test"
    assert len(split_problems("by_unit", torn, plan)) == 1
    assert split_problems("a_later_protocol", torn, plan) == []
    (line, *_) = split_problems("by_unit", moved(table, 0, record_id="r999999"), plan)
    assert "'r999999' is not in the plan" in line
    twice = moved(leaky, 0, start_fraction=0.1)
    assert "given twice" in split_problems("random_window_leaky", twice, plan)[0]


def test_every_record_has_its_own_windows_in_every_subset_of_the_leaky_split(plan):
    leaky = make_splits(plan, 0)["random_window_leaky"]
    subset = leaky.subset.reshape(plan.n_records, -1)
    counts = np.array([(subset == name).sum(axis=1) for name in SUBSETS])
    assert np.all(counts[0] == 5)
    assert {tuple(pair) for pair in counts[1:].T} == {(1, 2), (2, 1)}
    assert len({tuple(row) for row in subset}) > 50
