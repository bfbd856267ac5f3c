"""Data sets of whole lives: planned from laws, split by lives, the same whatever their shards."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gensig import generate, open_dataset, stream
from gensig.cli import main
from gensig.dataset.columns import LIFE_COLUMNS
from gensig.dataset.plan import plan_text
from gensig.dataset.splitting.protocols import make_splits
from gensig.dataset.splitting.split_check import split_problems
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_records

LIVES = (
    "experiment=run_to_failure",
    "plan.n_units=12",
    "plan.n_gearboxes=3",
    "life.snapshot_count=8",
)
SMALL = (
    "experiment=run_to_failure",
    "plan.n_units=2",
    "plan.classes=[crack,wear]",
    "life.snapshot_count=3",
    "operating.duration_s=0.02",
    "executor.n_workers=1",
)


def planned(*overrides):
    return make_plan(read_request([*LIVES, *overrides]).config)


@pytest.fixture(scope="module")
def plan():
    return planned()


def lives(plan):
    """Rows of each life, by its id."""
    return {
        name: np.flatnonzero(plan.columns["life_id"] == name)
        for name in np.unique(plan.columns["life_id"])
    }


def test_a_life_is_one_unit_with_gears_of_its_own_and_one_class(plan):
    assert plan.n_records == 12 * 8
    assert all(len(rows) == 8 for rows in lives(plan).values())
    for name in (
        "unit_id",
        "specimen_id",
        "gearbox_id",
        "label_name",
        "life_failed",
        "fault_tooth",
    ):
        assert all(
            len(set(plan.columns[name][rows].tolist())) == 1
            for rows in lives(plan).values()
        ), name
    assert len(set(plan.columns["specimen_id"].tolist())) == 12
    names, counts = np.unique(plan.columns["label_name"], return_counts=True)
    assert names.tolist() == ["crack", "distributed_pitting", "wear"]
    assert set(counts.tolist()) == {32}


def test_time_cycles_and_severity_only_rise_and_the_rest_of_the_life_falls_to_nothing(
    plan,
):
    columns = plan.columns
    for rows in lives(plan).values():
        assert (np.diff(columns["life_time_h"][rows]) > 0.0).all()
        assert (np.diff(columns["life_cycles"][rows]) > 0.0).all()
        assert (np.diff(columns["severity"][rows]) >= 0.0).all()
        whole = columns["life_time_h"][rows] + columns["remaining_life_h"][rows]
        assert_allclose(whole, whole[0], rtol=1e-12)
        assert columns["life_time_h"][rows[0]] == columns["life_cycles"][rows[0]] == 0.0
        assert columns["remaining_life_h"][rows[-1]] == 0.0


def test_failure_is_the_declared_size(plan):
    ends = {"crack": 0.7, "distributed_pitting": 0.15, "wear": 1.0}
    for rows in lives(plan).values():
        if plan.columns["life_failed"][rows[0]]:
            end = ends[plan.columns["label_name"][rows[-1]]]
            # a worn profile is told at 65 places, which may miss the deepest by a little
            assert_allclose(plan.columns["severity"][rows[-1]], end, rtol=2e-3)
    assert plan.columns["life_failed"].any()


def test_the_same_seed_gives_the_same_lives_and_another_seed_others(plan):
    assert plan_text(planned()) == plan_text(plan)
    other = planned("seed=1")
    assert not np.array_equal(
        other.columns["remaining_life_h"], plan.columns["remaining_life_h"]
    )


def test_number_of_unit_and_gearbox_do_not_tell_the_class():
    plan = planned(
        "plan.n_units=160",
        "plan.n_gearboxes=2",
        "life.snapshot_count=3",
        "plan.classes=[healthy,crack]",
    )
    first = np.array([rows[0] for rows in lives(plan).values()])
    labels = plan.columns["label"][first]
    boxes = np.unique(plan.columns["gearbox_id"][first], return_inverse=True)[1]
    table = np.array(
        [[np.sum((labels == a) & (boxes == b)) for a in range(2)] for b in range(2)]
    )
    chi_square = ((table - 40) ** 2 / 40).sum()
    assert (
        chi_square < 10.8
    )  # 1 degree of freedom, p = 0.001; dealt in turn it would be 160


def test_splits_keep_a_life_whole_on_one_side():
    plan = planned("plan.n_units=30", "life.snapshot_count=4")
    tables = make_splits(plan, 0)
    assert {"by_unit", "cross_specimen", "cross_gearbox"} <= set(tables)
    for name in ("by_unit", "cross_specimen", "cross_gearbox"):
        assert split_problems(name, tables[name], plan) == []
        table = tables[name]
        sides = dict(zip(table.record_id.tolist(), table.subset.tolist(), strict=True))
        ids = plan.columns["record_id"]
        assert all(
            len({sides[ids[row]] for row in rows}) == 1 for rows in lives(plan).values()
        )


def test_below_the_threshold_the_records_say_that_nothing_grows_and_the_life_is_censored():
    low = "plan.vary={operating.torque_nm: {distribution: uniform, low: 10, high: 20}}"
    plan = planned("life=crack_growth", "plan.classes=[crack]", low)
    assert not plan.columns["life_failed"].any()
    assert not plan.columns["life_growing"].any()
    ranges = plan.columns["params/fault.stress_intensity_range_mpa_sqrt_m"]
    assert (ranges < 5.0).all()
    assert_allclose(
        plan.columns["life_time_h"][7] + plan.columns["remaining_life_h"][7],
        500.0,
        rtol=0.05,
    )
    for rows in lives(plan).values():
        assert len(set(plan.columns["severity"][rows].tolist())) == 1


def test_a_healthy_unit_lives_to_the_horizon():
    plan = planned("plan.classes=[healthy,crack]")
    healthy = plan.columns["label_name"] == "healthy"
    assert (plan.columns["severity"][healthy] == 0.0).all()
    assert (plan.columns["life_failed"][healthy] == 0).all()
    assert (plan.columns["faults_json"][healthy] == "[]").all()


def test_a_drift_moves_the_machine_of_every_class_alike():
    drift = (
        "life.drift={mesh.friction_coefficient: {change: 1.0, time_h: 5, scatter: 0.0}}"
    )
    plan = planned("plan.classes=[healthy,crack]", "life=crack_growth", drift)
    friction, time = (
        plan.columns["params/mesh.friction_coefficient"],
        plan.columns["life_time_h"],
    )
    assert_allclose(friction[time == 0.0], 0.05)
    assert (friction[time > 300.0] > 0.0999).all()
    assert len(set(plan.columns["condition_id"].tolist())) == plan.n_records


def test_a_given_history_is_everybodys():
    blocks = "life.blocks=[[0, 2, 1800, 90], [5, 400, 1500, 110]]"
    plan = planned(blocks, "plan.vary={}")
    time, torque = plan.columns["life_time_h"], plan.columns["torque_nm"]
    assert_array_equal(torque[time < 2.0], 90.0)
    assert_array_equal(torque[time >= 5.0], 110.0)
    assert not ((time > 2.0) & (time < 5.0)).any()
    assert_allclose(plan.columns["speed_set_rpm"][time >= 5.0], 1500.0)


@pytest.fixture(scope="module")
def lived():
    return read_request(LIVES).config


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("plan.n_records", 8, r"plan\.n_records = 8"),
        ("plan.conditions_per_unit", 8, r"plan\.conditions_per_unit = 8"),
        ("plan.n_repeats", 2, r"plan\.n_repeats=1"),
        ("plan.design", "grid", "no grid"),
        ("plan.n_units", 0, r"plan\.n_units"),
        ("life.crack", None, "nothing makes crack grow"),
        ("life.kind", "long", r"life\.kind = 'long'"),
        ("life.horizon_h", 0, r"life\.horizon_h = 0"),
        ("life.snapshot_count", 2, "3 snapshots"),
        ("life.snapshot_spacing", "often", "allowed: linear, logarithmic, adaptive"),
        ("life.snapshot_every_h", -1.0, "must be positive"),
        ("life.block_low_h", 9, "in order"),
        ("life.block_low_h", 1e-4, "more than 200,000"),
        ("life.gap_chance", 1, r"life\.gap_chance"),
        ("life.gap_chance", "often", r"life\.gap_chance = 'often' is not a number"),
        ("life.n_setpoints", 0, r"life\.n_setpoints"),
        ("life.crack.end_share", 0.9, "known up to 0.8"),
        ("life.crack.start_share", 0.6, "spreads from"),
        ("life.crack.coefficient", 0.0, r"life\.crack\.coefficient"),
        ("life.crack.threshold_mpa_sqrt_m", -1.0, "must not be negative"),
        ("life.crack.width_share", 2.0, "width_share"),
        ("life.distributed_pitting.end_share", 0.5, "0.35 or less"),
        ("life.distributed_pitting.strength_mpa", 0.0, "strength"),
        ("life.wear.rate_scatter", -1.0, "rate_scatter"),
        ("life.blocks", [[0, 1, 1800, 90]], r"pin it, or take plan\.vary"),
        (
            "life.drift",
            {"mesh.friction": {"change": 1, "time_h": 5, "scatter": 0}},
            "is no key",
        ),
        (
            "life.drift",
            {"operating.torque_nm": {"change": 1, "time_h": 5, "scatter": 0}},
            "drawn for each set-point",
        ),
        (
            "life.drift",
            {"mesh.damping_ratio": {"change": -2, "time_h": 5, "scatter": 0}},
            "change = -2",
        ),
        ("life.drift", 3, r"life\.drift = 3"),
        (
            "plan.vary",
            {"life.horizon_h": {"distribution": "uniform", "low": 1, "high": 2}},
            "a whole data set",
        ),
        ("life.crack", 3, "group of keys"),
        ("life.colour", "red", "unknown key 'colour'"),
    ],
)
def test_what_makes_no_lives_is_refused_in_one_line(lived, key, value, said):
    config = lived.plain()
    *parents, leaf = key.split(".")
    node = config
    for name in parents:
        node = node[name]
    node[leaf] = value
    with pytest.raises(ConfigError, match=said) as caught:
        make_plan(Configuration(config))
    assert "\n" not in str(caught.value)


def test_a_class_that_no_law_makes_grow_is_refused(capsys):
    assert main(["plan", *LIVES, "plan.classes=[crack,missing_tooth]"]) != 0
    assert "nothing makes missing_tooth grow" in capsys.readouterr().err


def test_snapshots_come_out_the_same_alone_and_together():
    config = read_request([*SMALL, "plan.n_units=1", "plan.classes=[crack]"]).config
    plan = make_plan(config)
    rows = [plan.record(k) for k in range(plan.n_records)]
    together = simulate_records(config, rows)
    for row, record in zip(rows, together, strict=True):
        alone = simulate_records(config, [row])[0]
        assert_array_equal(
            alone.signals["acceleration"], record.signals["acceleration"]
        )


def test_a_data_set_of_lives_whatever_its_shards(tmp_path):
    data = generate(*SMALL, "dataset.records_per_shard=3", out=tmp_path / "a")
    other = generate(*SMALL, "dataset.records_per_shard=2", out=tmp_path / "b")
    assert set(LIFE_COLUMNS) <= set(data.column_names)
    for name in (*LIFE_COLUMNS, "severity", "torque_nm"):
        assert_array_equal(data.column(name), other.column(name))
    for k in range(data.n_records):
        assert_array_equal(data.signals(k), other.signals(k))
    assert_array_equal(data.column("status"), "ok")
    streamed = [record.signals["acceleration"] for record in stream(*SMALL)]
    assert_array_equal(streamed[1], data.signals(1))
    assert main(["verify", str(tmp_path / "a")]) == 0
    assert main(["reproduce", str(tmp_path / "b"), "--records", "2"]) == 0


def test_other_data_sets_have_no_columns_of_lives(tmp_path):
    tiny = (
        "plan.n_records=2",
        "plan.n_units=1",
        "operating.duration_s=0.02",
        "executor.n_workers=1",
    )
    generate(*tiny, "sensing.channels=[pinion_y]", out=tmp_path / "a")
    assert not set(LIFE_COLUMNS) & set(open_dataset(tmp_path / "a").column_names)


def test_the_worn_flank_of_a_record_is_that_of_its_life(plan):
    for name, rows in lives(plan).items():
        if plan.columns["label_name"][rows[0]] != "wear":
            continue
        for row in rows:
            parts = json.loads(plan.columns["faults_json"][row])
            assert [part["gear"] for part in parts] == ["pinion", "wheel"], name
            deepest = max(
                part["wear_depth_um"] * max(part["wear_profile"]) for part in parts
            )
            assert_allclose(
                plan.columns["severity"][row], deepest / 100.0, rtol=1e-6, atol=1e-9
            )
