"""Data sets of whole lives: planned from laws, split by lives, the same whatever their shards."""

import functools
import json
import operator
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gensig import generate, stream
from gensig.cli import main
from gensig.dataset.columns import LIFE_COLUMNS
from gensig.dataset.plan import plan_text
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

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
    columns = plan.columns
    assert plan.n_records == 12 * 8
    shared = (
        "unit_id",
        "specimen_id",
        "gearbox_id",
        "label_name",
        "life_failed",
        "fault_tooth",
    )
    for rows in lives(plan).values():
        assert len(rows) == 8
        for name in shared:
            assert len(set(columns[name][rows].tolist())) == 1, name
    assert len(set(columns["specimen_id"].tolist())) == 12
    names, counts = np.unique(columns["label_name"], return_counts=True)
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
    counts = ("plan.n_units=160", "plan.n_gearboxes=2", "life.snapshot_count=3")
    columns = planned(*counts, "plan.classes=[healthy,crack]").columns
    first = columns["life_time_h"] == 0.0
    boxes = np.unique(columns["gearbox_id"][first], return_inverse=True)[1]
    table = np.bincount(2 * columns["label"][first] + boxes)
    # 1 degree of freedom, p = 0.001; dealt in turn it would be 160
    assert ((table - 40) ** 2 / 40).sum() < 10.8


def test_below_the_threshold_nothing_grows_and_the_life_is_censored():
    low = "plan.vary={operating.torque_nm: {distribution: uniform, low: 10, high: 20}}"
    plan = planned("life=crack_growth", "plan.classes=[crack]", low)
    columns = plan.columns
    assert not columns["life_failed"].any()
    assert not columns["life_growing"].any()
    assert columns["params/fault.stress_intensity_range_mpa_sqrt_m"].max() < 5.0
    whole = columns["life_time_h"][7] + columns["remaining_life_h"][7]
    assert_allclose(whole, 500.0, rtol=0.05)
    for rows in lives(plan).values():
        assert np.ptp(columns["severity"][rows]) == 0.0


def test_a_healthy_unit_lives_to_the_horizon():
    plan = planned("plan.classes=[healthy,crack]")
    healthy = plan.columns["label_name"] == "healthy"
    assert (plan.columns["severity"][healthy] == 0.0).all()
    assert (plan.columns["life_failed"][healthy] == 0).all()
    assert (plan.columns["faults_json"][healthy] == "[]").all()


def test_a_drift_moves_the_machine_of_every_class_alike():
    drift = "{mesh.friction_coefficient: {change: 1.0, time_h: 5, scatter: 0.0}}"
    words = ("plan.classes=[healthy,crack]", "life=crack_growth")
    columns = planned(*words, f"life.drift={drift}").columns
    friction, time = columns["params/mesh.friction_coefficient"], columns["life_time_h"]
    assert_allclose(friction[time == 0.0], 0.05)
    assert (friction[time > 300.0] > 0.0999).all()
    assert len(set(columns["condition_id"].tolist())) == len(time)


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


def drift(key="mesh.damping_ratio", change=1):
    return {key: {"change": change, "time_h": 5, "scatter": 0}}


UNIFORM = {"distribution": "uniform", "low": 1, "high": 2}
REFUSED = [
    ("plan.n_records", 8, "plan.n_records = 8"),
    ("plan.conditions_per_unit", 8, "plan.conditions_per_unit = 8"),
    ("plan.n_repeats", 2, "plan.n_repeats=1"),
    ("plan.design", "grid", "no grid"),
    ("plan.n_units", 0, "plan.n_units"),
    ("life.crack", None, "nothing makes crack grow"),
    ("life.kind", "long", "life.kind = 'long'"),
    ("life.horizon_h", 0, "life.horizon_h = 0"),
    ("life.snapshot_count", 2, "3 snapshots"),
    ("life.snapshot_spacing", "often", "allowed: linear, logarithmic, adaptive"),
    ("life.snapshot_every_h", -1.0, "must be positive"),
    ("life.block_low_h", 9, "in order"),
    ("life.block_low_h", 1e-4, "more than 200,000"),
    ("life.gap_chance", 1, "life.gap_chance"),
    ("life.gap_chance", "often", "life.gap_chance = 'often' is not a number"),
    ("life.n_setpoints", 0, "life.n_setpoints"),
    ("life.crack.end_share", 0.9, "known up to 0.8"),
    ("life.crack.start_share", 0.6, "spreads from"),
    ("life.crack.coefficient", 0.0, "life.crack.coefficient"),
    ("life.crack.threshold_mpa_sqrt_m", -1.0, "must not be negative"),
    ("life.crack.width_share", 2.0, "width_share"),
    ("life.distributed_pitting.end_share", 0.5, "0.35 or less"),
    ("life.distributed_pitting.strength_mpa", 0.0, "strength"),
    ("life.wear.rate_scatter", -1.0, "rate_scatter"),
    ("life.blocks", [[0, 1, 1800, 90]], "pin it, or take plan.vary"),
    ("life.drift", drift("mesh.friction"), "is no key"),
    ("life.drift", drift("operating.torque_nm"), "drawn for each set-point"),
    ("life.drift", drift(change=-2), "change = -2"),
    ("life.drift", 3, "life.drift = 3"),
    ("plan.vary", {"life.horizon_h": UNIFORM}, "a whole data set"),
    ("life.crack", 3, "group of keys"),
    ("life.colour", "red", "unknown key 'colour'"),
]


@pytest.mark.parametrize(("key", "value", "message"), REFUSED)
def test_what_makes_no_lives_is_refused_in_one_line(lived, key, value, message):
    *parents, leaf = key.split(".")
    config = lived.plain()
    functools.reduce(operator.getitem, parents, config)[leaf] = value
    with pytest.raises(ConfigError, match=re.escape(message)) as caught:
        make_plan(Configuration(config))
    assert "\n" not in str(caught.value)


def test_a_data_set_of_lives_whatever_its_shards(tmp_path):
    data, other = (
        generate(*SMALL, f"dataset.records_per_shard={n}", out=tmp_path / f"{n}")
        for n in (3, 2)
    )
    assert set(LIFE_COLUMNS) <= set(data.column_names)
    for name in (*LIFE_COLUMNS, "severity", "torque_nm"):
        assert_array_equal(data.column(name), other.column(name))
    for k, record in enumerate(stream(*SMALL)):
        assert_array_equal(data.signals(k), other.signals(k))
        assert_array_equal(data.signals(k), record.signals["acceleration"])
    assert_array_equal(data.column("status"), "ok")
    assert main(["verify", str(tmp_path / "3")]) == 0
    assert main(["reproduce", str(tmp_path / "2"), "--records", "2"]) == 0


def test_the_worn_flank_of_a_record_is_that_of_its_life(plan):
    columns = plan.columns
    for row in np.flatnonzero(columns["label_name"] == "wear"):
        parts = json.loads(columns["faults_json"][row])
        assert [part["gear"] for part in parts] == ["pinion", "wheel"]
        depths = [part["wear_depth_um"] * max(part["wear_profile"]) for part in parts]
        severity = columns["severity"][row]
        assert_allclose(severity, max(depths) / 100.0, rtol=1e-6, atol=1e-9)
