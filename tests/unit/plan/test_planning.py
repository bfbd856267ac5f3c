"""Plans: balanced, reproducible, and only the label tells the class."""

import functools
import json
import operator

import numpy as np
import pytest
from crossed_plan import CROSSED
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.dataset.plan import plan_text
from gensig.errors import GensigError
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan, record_bytes, records_per_shard
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader

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
    return read_request(["experiment=quickstart", *CROSSED]).config


@pytest.fixture(scope="module")
def planned(quickstart):
    """A quickstart plan with keys of sections replaced."""

    def make(**sections):
        config = quickstart
        for section, changes in sections.items():
            if isinstance(changes, dict):
                config = config.with_keys(section, **changes)
            else:
                config = config.with_entries(**{section: changes})
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
    names = np.array(CLASSES)[plan.columns["label"]]
    assert_array_equal(names, plan.columns["label_name"])


def position_chi_square(labels):
    """Departure of the (position, class) table from even, chi-square with 9 degrees of freedom.

    Every group is a permutation, so cells of a row exclude each other: the plain sum is 4/3 too
    large.
    """
    table = np.array([np.bincount(column, minlength=4) for column in labels.T])
    expected = len(labels) / 4
    return 0.75 * ((table - expected) ** 2 / expected).sum()


def test_position_does_not_tell_the_class_and_a_fixed_order_would_show(plan):
    labels = groups(plan, "label")
    assert position_chi_square(labels) < 27.9  # 99.9 % of chi-square
    assert position_chi_square(np.sort(labels, axis=1)) > 100


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
    columns = plan.columns
    for key, spec in quickstart["plan"]["vary"].items():
        values = columns[f"params/{key}"]
        assert spec["low"] <= values.min() <= values.max() <= spec["high"]
        assert np.ptp(values) > 0.8 * (spec["high"] - spec["low"])
    speeds = columns["speed_set_rpm"], columns["params/operating.speed_rpm"]
    assert_allclose(*speeds, rtol=1e-12, atol=0)
    is_crack = columns["label_name"] == "crack"
    cracks = columns["params/fault.crack_depth_mm"][is_crack]
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
            assert (record["fault_tooth"], record["fault_gear"]) == (-1, "")
            assert record["severity"] == 0.0
        else:
            (fault,) = faults
            assert fault["kind"] == record["label_name"]
            assert fault["tooth"] == record["fault_tooth"]
            assert 0 < record["severity"] <= 1


def test_teeth_are_drawn_over_the_whole_gear(plan):
    teeth = plan.columns["fault_tooth"][plan.columns["label_name"] == "missing_tooth"]
    assert set(teeth.tolist()) == set(range(23))


def test_units_are_specimens_in_gearboxes(plan, quickstart):
    names = ("unit_id", "gearbox_id", "specimen_id")
    columns = (plan.columns[name].tolist() for name in names)
    whole = set(zip(*columns, strict=True))
    units, gearboxes, specimens = map(set, zip(*whole, strict=True))
    counts = quickstart["plan"]
    assert len(whole) == len(units) == counts["n_units"]
    assert len({(gearbox, specimen) for _, gearbox, specimen in whole}) == len(units)
    assert len(gearboxes) == counts["n_gearboxes"]
    assert len(specimens) * len(gearboxes) == len(units)


NEGATIVE = {"distribution": "uniform", "low": -20, "high": -10}


class TestRefusals:
    @pytest.mark.parametrize(
        ("keys", "text"),
        [
            (
                [
                    "gear.rated_torque_nm",
                    "seed",
                    "operating.turns",
                    "plan.n_records",
                    "sensing.sampling_rate_hz",
                    "system.kind",
                    "executor.n_workers",
                ],
                "is one value for a whole data set",
            ),
            (
                ["operating.sped_rpm", "mesh.law", "mesh", "fault.tooth"],
                "is no key",
            ),
        ],
    )
    def test_keys_that_cannot_be_varied(self, planned, keys, text):
        for key in keys:
            vary = {key: {"distribution": "uniform", "low": 1, "high": 2}}
            with refused(f"plan.vary: '{key}' {text}"):
                planned(plan={"vary": vary})

    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            ({"n_records": 3}, "= 3 must be a whole number of at least 4"),
            ({"n_records": 8.0}, "plan.n_records = 8.0"),
            ({"n_units": 0}, "plan.n_units = 0"),
            ({"n_gearboxes": 0}, "plan.n_gearboxes = 0"),
            ({"design": "factorial"}, "allowed: latin_hypercube, sobol, grid"),
            ({"n_repeats": 0}, "= 0 must be a whole number of at least 1"),
            (
                {"n_records": None},
                "plan.n_records = null: give a number, plan.conditions_per_unit, or "
                "plan.design=grid",
            ),
            ({"conditions_per_unit": 0}, "plan.conditions_per_unit = 0"),
            (
                {"conditions_per_unit": 3, "n_repeats": 2},
                "plan.n_records = 8, but the plan has 960 records (40 machines x 3 conditions x 4 "
                "classes x 2 repeats); plan.n_records=null takes them",
            ),
            ({"n_reports": 3}, "unknown key 'n_reports'; it has n_records, n_units"),
            ({"sham": 3}, "plan.sham = 3"),
        ],
    )
    def test_counts_and_choices(self, planned, changes, text):
        with refused(text):
            planned(plan={"n_records": 8, **changes})

    def test_an_option_of_ones_own_that_lacks_a_key(self, planned, quickstart):
        text = "plan: missing key 'n_repeats'; it has n_records, n_units"
        with refused(text):
            planned(plan=quickstart["plan"].without("n_repeats"))

    @pytest.mark.parametrize(
        ("key", "value", "text"),
        [
            ("sensing.channels", ["housing"], "no channel housing"),
            ("gear.wheel.bore_radius_mm", 1, "bore_radius_mm"),
            ("gear.addendum_coefficient", 0.5, "below 1"),
            (
                "classes.crack.gear",
                "ring",
                "fault.gear = 'ring'; allowed: pinion, wheel",
            ),
            ("plan.vary", {"operating.torque_nm": NEGATIVE}, "torque_nm = -1"),
        ],
    )
    def test_values_are_checked_before_anything_runs(
        self, quickstart, key, value, text
    ):
        config = quickstart.plain()
        *parents, leaf = key.split(".")
        functools.reduce(operator.getitem, parents, config)[leaf] = value
        with refused(text, GensigError):
            make_plan(Configuration(config))


@pytest.mark.parametrize(
    ("n_records", "together"),
    [(1, 24), (400, 24), (24_000, 24), (24_001, 32), (100_000, 104), (600_000, 600)],
)
def test_shards_grow_with_the_set(config_with, n_records, together):
    assert records_per_shard(InputReader(config_with()), n_records) == together
    assert n_records <= 1000 * together
    given = config_with({"dataset.records_per_shard": 7})
    assert records_per_shard(InputReader(given), n_records) == 7


@pytest.mark.parametrize("n_records", [400, 10**8])
def test_a_shard_holds_at_most_500_mb_of_samples(config_with, n_records):
    long = config_with({"operating.duration_s": 100.0, "dataset.store_clean": True})
    assert record_bytes(InputReader(config_with())) == 4 * 4 * 51200
    assert record_bytes(InputReader(long)) == 2 * 100 * 4 * 4 * 51200
    for config in (config_with(), long):
        n_bytes = record_bytes(InputReader(config))
        together = records_per_shard(InputReader(config), n_records)
        assert together * n_bytes <= 5 * 10**8
        assert together == 24 or (together + 8) * n_bytes > 5 * 10**8
    million = records_per_shard(InputReader(config_with()), 10**6)
    assert 1000 <= 10**6 / million <= 2000
