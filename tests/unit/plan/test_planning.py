"""Plans: balanced, reproducible, and only the label tells the class."""

import json
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.dataset.plan import plan_text
from gensig.errors import ConfigError, ExtrapolationError, FaultError, GeometryError
from gensig.plan.make import make_plan, record_bytes, records_per_shard
from gensig.plan.request import read_request

CLASSES = ("healthy", "crack", "pitting", "missing_tooth")
SHARED = (
    "unit_id",
    "gearbox_id",
    "specimen_id",
    "condition_id",
    "speed_set_rpm",
    "torque_nm",
    "snr_db",
)


@pytest.fixture(scope="module")
def quickstart():
    return read_request(["experiment=quickstart"]).config


@pytest.fixture(scope="module")
def planned(quickstart):
    def make(**changes):
        config = quickstart.with_keys("plan", **changes.pop("plan", {}))
        for key, value in changes.items():
            if isinstance(value, dict):
                config = config.with_keys(key, **value)
            else:
                config = config.with_entries(**{key: value})
        return make_plan(config)

    return make


@pytest.fixture(scope="module")
def plan(planned):
    return planned(plan={"n_records": 240})


def groups(plan, key):
    return plan.columns[key].reshape(-1, len(CLASSES))


@pytest.mark.parametrize("key", SHARED)
def test_a_group_shares_unit_and_condition(plan, key):
    values = groups(plan, key)
    assert (values == values[:, :1]).all()
    assert len(set(values[:, 0].tolist())) > 1


def test_a_group_holds_every_class_once(plan):
    assert (np.sort(groups(plan, "label"), axis=1) == np.arange(4)).all()
    assert all(
        CLASSES[label] == name
        for label, name in zip(
            *(plan.columns[k].tolist() for k in ("label", "label_name")), strict=True
        )
    )


def position_chi_square(labels):
    """Departure of the (position, class) table from even, chi-square with 9 degrees of freedom.

    Every group is a permutation, so cells of a row exclude each other: the plain sum is 4/3 too
    large.
    """
    table = np.array([np.bincount(column, minlength=4) for column in labels.T])
    expected = len(labels) / 4
    return 0.75 * ((table - expected) ** 2 / expected).sum()


class TestPosition:
    def test_it_does_not_tell_the_class(self, plan):
        assert position_chi_square(groups(plan, "label")) < 27.9  # 99.9 % of chi-square

    def test_a_fixed_order_would_show(self, plan):
        assert position_chi_square(np.sort(groups(plan, "label"), axis=1)) > 100


@pytest.mark.parametrize(
    "key", ["start_tooth_pinion", "start_tooth_wheel", "start_phase"]
)
def test_starts_do_not_tell_the_class(plan, key):
    values, labels = plan.columns[key].astype(float), plan.columns["label"]
    spread = values.std() / np.sqrt(len(values) / 4)
    for label in range(4):
        assert abs(values[labels == label].mean() - values.mean()) < 4 * spread


def test_the_same_configuration_gives_the_same_plan(planned):
    one, two, other = (planned(seed=seed, plan={"n_records": 20}) for seed in (3, 3, 4))
    assert plan_text(one) == plan_text(two)
    assert plan_text(one) != plan_text(other)


def test_drawn_values_lie_in_their_ranges(plan, quickstart):
    for key, spec in quickstart["plan"]["vary"].items():
        values = plan.columns[f"params/{key}"]
        assert values.min() >= spec["low"]
        assert values.max() <= spec["high"]
        assert np.ptp(values) > 0.8 * (spec["high"] - spec["low"])
    assert_allclose(
        plan.columns["speed_set_rpm"],
        plan.columns["params/operating.speed_rpm"],
        rtol=1e-12,
        atol=0,
    )
    cracks = plan.columns["params/fault.crack_depth_mm"][
        plan.columns["label_name"] == "crack"
    ]
    spec = quickstart["classes"]["crack"]["vary"]["crack_depth_mm"]
    low, high = (2.0 * spec[end] for end in ("low", "high"))  # of the module
    assert low <= cracks.min() <= cracks.max() <= high
    assert np.ptp(cracks) > 0.9 * (high - low)


def test_faults_are_recorded_whole(plan):
    for index in range(16):
        record = plan.record(index)
        faults = json.loads(record["faults_json"])
        if record["label_name"] == "healthy":
            assert faults == []
            assert (
                record["fault_tooth"],
                record["fault_gear"],
                record["severity"],
            ) == (
                -1,
                "",
                pytest.approx(0.0),
            )
        else:
            assert [fault["kind"] for fault in faults] == [record["label_name"]]
            assert faults[0]["tooth"] == record["fault_tooth"]
            assert 0 < record["severity"] <= 1


def test_teeth_are_drawn_over_the_whole_gear(plan):
    teeth = plan.columns["fault_tooth"][plan.columns["label_name"] == "missing_tooth"]
    assert set(teeth.tolist()) == set(range(23))


def test_units_are_specimens_in_gearboxes(plan, quickstart):
    units = set(
        zip(
            *(
                plan.columns[key].tolist()
                for key in ("unit_id", "gearbox_id", "specimen_id")
            ),
            strict=True,
        )
    )
    assert (
        len(units)
        == quickstart["plan"]["n_units"]
        == len({unit for unit, _, _ in units})
    )
    assert (
        len({gearbox for _, gearbox, _ in units}) == quickstart["plan"]["n_gearboxes"]
    )
    assert len({(gearbox, specimen) for _, gearbox, specimen in units}) == len(units)
    assert len({specimen for _, _, specimen in units}) * quickstart["plan"][
        "n_gearboxes"
    ] == len(units)


class TestRefusals:
    WHOLE = "is one value for a whole data set"

    @pytest.mark.parametrize(
        ("key", "text"),
        [
            ("gear.pinion.n_teeth", WHOLE),
            ("seed", WHOLE),
            ("operating.duration_s", WHOLE),
            ("operating.turns", WHOLE),
            ("plan.n_records", WHOLE),
            ("sensing.sampling_rate_hz", WHOLE),
            ("system.kind", WHOLE),
            ("executor.n_workers", WHOLE),
            ("operating.sped_rpm", "is no key"),
            ("mesh.law", "is no key"),
            ("mesh", "is no key"),
            ("mesh.allow_extrapolation", "is no key"),
            ("fault.tooth", "is no key"),
        ],
    )
    def test_keys_that_cannot_be_varied(self, planned, key, text):
        vary = {key: {"distribution": "uniform", "low": 1, "high": 2}}
        with pytest.raises(ConfigError, match=re.escape(f"plan.vary: '{key}' {text}")):
            planned(plan={"vary": vary})

    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            (
                {"n_records": 3},
                "plan.n_records = 3 must be a whole number of at least 4",
            ),
            ({"n_records": 0}, "plan.n_records = 0"),
            ({"n_records": 8.0}, "plan.n_records = 8.0"),
            ({"n_units": 0}, "plan.n_units = 0"),
            ({"n_gearboxes": -1}, "plan.n_gearboxes = -1"),
            ({"n_gearboxes": 0}, "plan.n_gearboxes = 0"),
            (
                {"design": "factorial"},
                "plan.design = 'factorial'; allowed: latin_hypercube, sobol, grid",
            ),
            (
                {"n_repeats": 0},
                "plan.n_repeats = 0 must be a whole number of at least 1",
            ),
            ({"n_repeats": 1.5}, "plan.n_repeats = 1.5"),
            (
                {"n_records": None},
                "plan.n_records = null: give a number, plan.conditions_per_unit, or "
                "plan.design=grid",
            ),
            ({"conditions_per_unit": 0}, "plan.conditions_per_unit = 0"),
            (
                {"conditions_per_unit": 3, "n_repeats": 2},
                "plan.n_records = 8, but the plan has 960 records (40 units x 3 conditions x 4 "
                "classes x 2 repeats); plan.n_records=null takes them",
            ),
            (
                {"n_reports": 3},
                "plan: unknown key 'n_reports'; it has n_records, n_units",
            ),
            ({"sham": 3}, "plan.sham = 3"),
        ],
    )
    def test_counts_and_choices(self, planned, changes, text):
        with pytest.raises(ConfigError, match=re.escape(text)):
            planned(plan={"n_records": 8, **changes})

    def test_an_option_of_ones_own_that_lacks_a_key(self, quickstart):
        plan = quickstart["plan"].without("n_repeats")
        with pytest.raises(
            ConfigError,
            match="plan: missing key 'n_repeats'; it has n_records, n_units",
        ):
            make_plan(quickstart.with_entries(plan=plan))

    def test_values_are_checked_before_anything_runs(self, planned):
        vary = {
            "operating.torque_nm": {"distribution": "uniform", "low": -20, "high": -10}
        }
        with pytest.raises(
            ConfigError, match=r"operating.torque_nm = -1\d.* must be positive"
        ):
            planned(plan={"n_records": 8, "vary": vary})

    def test_channels_are_checked_before_anything_runs(self, planned):
        with pytest.raises(ConfigError, match="no channel housing"):
            planned(plan={"n_records": 8}, sensing={"channels": ["housing"]})

    def test_bodies_outside_the_fit_are_refused_before_anything_runs(
        self, planned, quickstart
    ):
        gear = quickstart["gear"].plain()
        gear["wheel"]["bore_radius_mm"] = 1
        with pytest.raises(ExtrapolationError, match="bore_radius_mm"):
            planned(plan={"n_records": 8}, gear=gear)

    def test_a_gear_that_is_none(self, planned, quickstart):
        classes = quickstart["classes"].plain()
        classes["crack"]["gear"] = "ring"
        with pytest.raises(
            FaultError, match=r"fault.gear = 'ring'; allowed: pinion, wheel"
        ):
            planned(plan={"n_records": 8}, classes=classes)

    def test_interrupted_drive(self, planned, quickstart):
        gear = quickstart["gear"].plain()
        gear["addendum_coefficient"] = 0.5
        with pytest.raises(GeometryError, match="below 1"):
            planned(plan={"n_records": 8}, gear=gear)


def test_shards_hold_about_64_mb(config_with):
    assert record_bytes(config_with()) == 4 * 4 * 51200
    assert records_per_shard(config_with()) == 80
    assert records_per_shard(config_with({"dataset.store_clean": True})) == 40
    assert records_per_shard(config_with({"dataset.records_per_shard": 7})) == 7
