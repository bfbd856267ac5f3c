"""Grids, repeats and counts of a plan: nested and balanced at every level."""

import itertools
from collections import Counter, defaultdict

import numpy as np
import pytest
from crossed_plan import CROSSED
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.dataset.plan import plan_text
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.plan.make import describe_design, make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_records
from gensig.record.streams import Stream, stream

CLASSES = ("healthy", "crack", "pitting", "missing_tooth")
SPEED = {"distribution": "choice", "values": [1200, 1800, 2400]}
TORQUE = {"distribution": "uniform", "low": 10, "high": 40, "levels": 4}
DEPTH = {"distribution": "uniform", "low": 1.0, "high": 3.0, "levels": 3}
LENGTH = {"distribution": "choice", "values": [0.5, 1.0]}
WITHOUT = {"distribution": "uniform", "low": 1000, "high": 2000}
MANY = {**WITHOUT, "levels": 100_000}
GRID = {"design": "grid", "n_records": None, "n_units": 5, "n_gearboxes": 2}
VARY = {"operating.speed_rpm": SPEED, "operating.torque_nm": TORQUE}


@pytest.fixture(scope="module")
def quickstart():
    return read_request(["experiment=quickstart", *CROSSED]).config


@pytest.fixture(scope="module")
def configured(quickstart):
    """The quickstart with keys of its plan and of the ``vary`` of its faults replaced."""

    def make(faults=None, **plan):
        config = quickstart.with_keys("plan", **plan).plain()
        for name, vary in (faults or {}).items():
            config["classes"][name]["vary"].update(vary)
        return Configuration(config)

    return make


@pytest.fixture(scope="module")
def planned(configured):
    return lambda *args, **kwargs: make_plan(configured(*args, **kwargs))


def speed(distribution):
    return {"operating.speed_rpm": distribution}


def rows(plan, *names):
    """(record,) tuples of some columns."""
    return list(zip(*(plan.columns[name].tolist() for name in names), strict=True))


SET_POINT = ("params/operating.speed_rpm", "params/operating.torque_nm")


class TestGrid:
    @pytest.fixture(scope="class")
    @classmethod
    def plan(cls, planned):
        return planned(**GRID, vary=VARY)

    @pytest.fixture(scope="class")
    @classmethod
    def crossed(cls, planned):
        """Three depths of cracks, two lengths of pits: six faults at every set-point."""
        faults = {
            "crack": {"crack_depth_mm": DEPTH},
            "pitting": {"pit_length_mm": LENGTH},
        }
        return planned(
            faults, **{**GRID, "n_units": 3}, vary={"operating.speed_rpm": SPEED}
        )

    def test_every_unit_runs_every_combination_with_every_class_once(self, plan):
        result = Counter(rows(plan, "unit_id", *SET_POINT, "label_name"))
        units = [f"unit-{number:04d}" for number in range(5)]
        speeds, torques = (1200.0, 1800.0, 2400.0), (10.0, 20.0, 30.0, 40.0)
        expected = itertools.product(units, speeds, torques, CLASSES)
        assert result == dict.fromkeys(expected, 1)

    def test_what_has_no_levels_is_drawn(self, plan):
        cracks = plan.columns["label_name"] == "crack"
        depths = plan.columns["params/fault.crack_depth_mm"][cracks]
        assert len(set(depths.tolist())) == cracks.sum() == 60
        assert len(set(plan.columns["fault_tooth"][cracks].tolist())) > 15

    def test_null_levels_leave_a_key_of_the_conditions_to_chance(self, planned):
        noise = {"distribution": "uniform", "low": 10, "high": 30, "levels": None}
        vary = {"operating.speed_rpm": SPEED, "sensing.snr_db": noise}
        result = dict(rows(planned(**GRID, vary=vary), "condition_id", "snr_db"))
        assert len(result) == len(set(result.values())) == 15
        assert min(result.values()) < 12 < 28 < max(result.values())

    @pytest.mark.parametrize(
        ("size", "levels", "n"),
        [("crack_depth_mm", {1.0, 2.0, 3.0}, 2), ("pit_length_mm", {0.5, 1.0}, 3)],
    )
    def test_faults_with_levels_are_crossed_with_all_else(
        self, crossed, size, levels, n
    ):
        names = ("unit_id", "params/operating.speed_rpm", f"params/fault.{size}")
        result = Counter(key for key in rows(crossed, *names) if key[2] == key[2])
        assert {key[2] for key in result} == levels
        assert len(result) == 3 * 3 * len(levels)
        assert set(result.values()) == {n}

    def test_a_tooth_may_have_levels(self, planned):
        tooth = {"distribution": "tooth", "levels": 3}
        columns = planned({"crack": {"tooth": tooth}}, **GRID, vary={}).columns
        teeth = columns["fault_tooth"][columns["label_name"] == "crack"]
        assert Counter(teeth.tolist()) == {0: 5, 11: 5, 22: 5}

    def test_the_right_number_of_records_may_be_typed(self, planned, plan):
        same = planned(**{**GRID, "n_records": 240}, vary=VARY)
        assert plan_text(same) == plan_text(plan)

    def test_it_can_be_told_in_words(self, configured):
        config = configured({"crack": {"crack_depth_mm": DEPTH}}, **GRID, vary=VARY)
        grid, drawn = describe_design(InputReader(config)).split("; ")
        sizes = "operating.speed_rpm 3 x operating.torque_nm 4 x crack.crack_depth_mm 3"
        assert grid == f"grid of {sizes}"
        keys = "crack.tooth, pitting.tooth, pitting.pit_length_mm, pitting.pit_width_mm"
        assert drawn == f"drawn: {keys}, missing_tooth.tooth"
        bare = describe_design(InputReader(configured(**GRID, vary={})))
        assert bare.startswith("grid of no key; drawn: ")
        assert describe_design(InputReader(configured(design="sobol"))) == "sobol"

    @pytest.mark.parametrize(
        ("plan", "text"),
        [
            (
                {"n_records": 400},
                "plan.n_records = 400, but the plan has 60 records (5 machines x 3 conditions x 4 "
                "classes); plan.n_records=null takes them",
            ),
            (
                {"vary": speed(WITHOUT)},
                "plan.vary.operating.speed_rpm: a grid needs its levels",
            ),
            (
                {"vary": speed({**SPEED, "levels": 3})},
                "plan.vary.operating.speed_rpm: the levels of a choice are its values",
            ),
            (
                {"vary": speed(MANY)},
                "the grid has 2,000,000 records (5 machines x 100,000 conditions x 4 classes), "
                "more than 1,000,000; take fewer levels, machines or repeats",
            ),
            (
                {"conditions_per_unit": 2},
                "plan.conditions_per_unit = 2: a grid's levels say how many",
            ),
        ],
    )
    def test_mistakes_are_one_line(self, planned, plan, text):
        with refused(text):
            planned(**{**GRID, "vary": speed(SPEED), **plan})

    @pytest.mark.parametrize(
        ("levels", "text"),
        [
            (1, "fault.vary.crack_depth_mm: levels = 1"),
            (
                10**6,
                r"20,000,000 records \(5 machines x 1,000,000 faults x 4 classes\)",
            ),
        ],
    )
    def test_mistakes_in_a_fault_are_named(self, planned, levels, text):
        vary = {"crack_depth_mm": {**DEPTH, "levels": levels}}
        with pytest.raises(ConfigError, match=text):
            planned({"crack": vary}, **GRID, vary={})


class TestRepeats:
    N = 3

    @pytest.fixture(scope="class")
    @classmethod
    def plan(cls, planned):
        return planned(n_records=20 * 4 * cls.N, n_units=5, n_repeats=cls.N)

    @pytest.fixture(scope="class")
    @classmethod
    def families(cls, plan):
        """Repeats of one unit, condition and class, in order."""
        result = defaultdict(list)
        for index in range(plan.n_records):
            record = plan.record(index)
            result[record["condition_id"], record["label_name"]].append(record)
        return result

    def test_each_class_has_all_repeats_at_every_condition(self, families):
        assert len(families) == 20 * 4
        for records in families.values():
            assert [record["repeat"] for record in records] == list(range(self.N))

    def test_they_share_all_but_their_start(self, families):
        names = (
            "record_id",
            "shard",
            "row",
            "repeat",
            "start_tooth_pinion",
            "start_tooth_wheel",
            "start_phase",
        )
        phases = []
        for first, *others in families.values():
            phases += [record["start_phase"] for record in (first, *others)]
            for other in others:
                same = {key for key in first if str(first[key]) == str(other[key])}
                assert set(first) - same <= set(names)
        assert len(set(phases)) == len(phases)

    def test_repeats_come_one_after_another_in_random_order(self, plan):
        labels = plan.columns["label"].reshape(-1, 4)
        assert (np.sort(labels, axis=1) == np.arange(4)).all()
        assert len({tuple(order) for order in labels.tolist()}) > 15
        assert_array_equal(
            plan.columns["repeat"], np.tile(np.repeat(np.arange(self.N), 4), 20)
        )

    @pytest.mark.parametrize("n_records", [4, 11, 50])
    @pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
    def test_classes_are_balanced_to_one(self, planned, design, n_records):
        plan = planned(n_records=n_records, n_repeats=2, design=design)
        counts = np.bincount(plan.columns["label"], minlength=4)
        assert np.ptp(counts) <= 1

    def test_a_grid_repeats_too(self, planned):
        plan = planned(**GRID, vary={"operating.speed_rpm": SPEED}, n_repeats=2)
        result = Counter(rows(plan, "unit_id", "speed_set_rpm", "label_name", "repeat"))
        assert len(result) == plan.n_records == 5 * 3 * 4 * 2
        assert set(result.values()) == {1}

    def test_they_are_told_apart_by_start_and_noise_alone(self, quickstart):
        counts = {"n_records": 2, "n_repeats": 2, "classes": ["crack"]}
        config = quickstart.with_keys("plan", **counts)
        config = config.with_entries(classes={"crack": config["classes"]["crack"]})
        config = config.with_keys("operating", duration_s=0.02)
        config = config.with_keys("dataset", store_clean=True)
        plan = make_plan(config)
        records = simulate_records(
            InputReader(config), [plan.record(index) for index in range(2)]
        )
        powers, signals, clean = (
            [record.signals[name] for record in records]
            for name in ("noise_power", "acceleration", "acceleration_clean")
        )
        assert_array_equal(*powers)
        noise = np.subtract(signals, clean).reshape(2, -1)
        assert abs(np.corrcoef(noise)[0, 1]) < 0.1
        one, other = (channels[0] for channels in clean)
        assert np.std(one - other) > 0.1 * np.std(one)
        assert_allclose(np.std(one), np.std(other), rtol=0.5, atol=0)


class TestStartOfTheSound:
    """The first sound record of a condition starts as the healthy twin that sets the noise level,
    so that it is it."""

    START = ("start_tooth_pinion", "start_tooth_wheel", "start_phase")

    @staticmethod
    def drawn(cause, index):
        rng = stream(0, cause, index)
        return int(rng.integers(23)), int(rng.integers(84)), float(rng.random())

    @pytest.mark.parametrize("changes", [{}, {"sham": True}, {"n_repeats": 3}])
    def test_streams(self, planned, changes):
        plan = planned(n_records=48, **changes)
        for index in range(plan.n_records):
            record = plan.record(index)
            stream = Stream.START, index
            if record["label_name"] == "healthy" and not record.get("repeat"):
                stream = Stream.TWIN, int(record["condition_id"].rpartition("-")[2])
            assert tuple(record[name] for name in self.START) == self.drawn(*stream)

    def test_of_two_sound_classes_one_is_the_twin(self, configured):
        config = configured(n_records=24, classes=["healthy", "again", "crack"])
        config = config.with_keys("classes", again=config["classes"]["healthy"])
        result = rows(make_plan(config), "label_name", "condition_id", *self.START)
        starts = [row[2:] for row in result if row[0] != "crack"]
        assert len(set(starts)) == len(starts) == 16

    def test_without_a_sound_class_nothing_changes(self, configured):
        config = configured(n_records=12, classes=["crack"])
        config = config.with_entries(classes={"crack": config["classes"]["crack"]})
        starts = rows(make_plan(config), *self.START)
        assert starts == [self.drawn(Stream.START, index) for index in range(12)]


class TestConditionsPerUnit:
    def test_counts_multiply(self, planned):
        plan = planned(n_records=None, n_units=5, conditions_per_unit=3, n_repeats=2)
        assert plan.n_records == 5 * 3 * 4 * 2
        units = [unit for unit, _ in set(rows(plan, "unit_id", "condition_id"))]
        assert list(Counter(units).values()) == [3] * 5

    def test_the_same_number_of_records_is_the_same_plan(self, planned):
        plan = planned(n_records=80, n_units=5)
        same = planned(n_records=80, n_units=5, conditions_per_unit=4)
        assert plan_text(same) == plan_text(plan)


class TestSobol:
    """A Sobol sequence has its number in its digits; units and faults are numbered as well."""

    @pytest.fixture(scope="class")
    @classmethod
    def plan(cls, planned):
        return planned(n_records=4 * 256, n_units=4, design="sobol")

    @staticmethod
    def n_cells(one, other):
        """Cells of 16 x 16 ranks that are hit; of 256 cells about 163 by chance."""
        ranks = [np.argsort(np.argsort(values)) for values in (one, other)]
        return len(np.unique(16 * np.stack(ranks) // len(one), axis=1).T)

    def test_speed_does_not_tell_the_size_of_the_fault(self, plan):
        cracks = plan.columns["label_name"] == "crack"
        depth = plan.columns["params/fault.crack_depth_mm"][cracks]
        torque = plan.columns["params/operating.torque_nm"][cracks]
        assert self.n_cells(depth, torque) > 130

    def test_the_unit_does_not_tell_the_speed(self, plan):
        speed, unit = plan.columns["speed_set_rpm"], plan.columns["unit_id"]
        for name in set(unit.tolist()):
            assert 0.3 < np.mean(speed[unit == name] < 1800.0) < 0.7

    def test_the_conditions_are_still_those_of_the_sequence(self, plan):
        speed = np.unique(plan.columns["speed_set_rpm"])
        assert_array_equal(np.floor((speed - 1200.0) / 1200.0 * 256), np.arange(256))
