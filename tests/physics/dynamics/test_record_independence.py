"""A record depends only on its row; noise depends on the healthy twin and not on the motion."""

import pickle

import numpy as np
import pytest
from closeness import assert_close

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record import simulate as records
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record, simulate_records

ORDER = (5, 0, 3, 6, 1, 7, 2, 4)
WORDS = [
    "experiment=quickstart",
    "plan.n_records=8",
    "plan.n_units=2",
    "operating.duration_s=0.05",
]


@pytest.fixture(scope="module")
def config():
    return read_request(WORDS).config.with_keys("dataset", store_clean=True)


@pytest.fixture(scope="module")
def rows(config):
    plan = make_plan(config)
    return [plan.record(index) for index in range(8)]


def simulated(config, rows):
    """Records of rows, one after the other, in a process without any twin."""
    records.forget_twins()
    return [simulate_record(InputReader(config), row) for row in rows]


@pytest.fixture(scope="module")
def in_order(config, rows):
    return simulated(config, rows)


def bits(record):
    signals = {name: values.tobytes() for name, values in record.signals.items()}
    return signals, str(record.values)


def assert_same(records, expected):
    assert [bits(record) for record in records] == [bits(record) for record in expected]


def clean(record):
    return record.signals["acceleration_clean"]


@pytest.mark.parametrize("size", [1, 3, 16])
def test_records_are_independent_in_any_order_and_block(config, rows, in_order, size):
    """With known and with unknown twins."""
    expected = [in_order[index] for index in ORDER]
    for _ in range(2):
        result = []
        for first in range(0, 8, size):
            block = [rows[index] for index in ORDER[first : first + size]]
            result += simulate_records(InputReader(config), block)
        assert_same(result, expected)
        records.forget_twins()
    assert bits(in_order[5]) != bits(in_order[4])
    assert_same(simulated(config, [rows[5]]), [in_order[5]])


@pytest.mark.parametrize(
    "word", ["seed=1", "quality.iso1328_grade=9", "gear=fzg_c_16_24"]
)
def test_what_was_read_before_leaves_another_set_as_it_is(config, rows, word):
    """One process reads several sets: one by one, and those of a sweep."""

    def teeth(given):
        return pickle.dumps(InputReader(given).inputs(rows[0]).run.specimen)

    another = read_request([*WORDS, word]).config
    first, other = teeth(config), teeth(another)
    assert other != first
    assert teeth(config) == first
    simulate_record(InputReader(config), rows[0])  # with the twin that sets its noise
    row = make_plan(another).record(0)
    assert row["condition_id"] == rows[0]["condition_id"]
    assert_same([simulate_record(InputReader(another), row)], simulated(another, [row]))


def test_a_failure_leaves_its_block(config, rows, in_order):
    """A row with a too long step is a failed record."""
    stiff = {
        **rows[2],
        "params/operating.drive_frequency_hz": 1e6,
    }
    records.forget_twins()
    result = simulate_records(InputReader(config), [*rows[:2], stiff, rows[3]])
    failed = result.pop(2)

    assert_same(result, [in_order[index] for index in (0, 1, 3)])
    assert failed.values["status"] == "failed"
    assert "solver.oversampling" in failed.values["status_reason"]
    assert np.isnan(failed.signals["acceleration"]).all()


def test_a_row_keeps_its_record_in_a_longer_plan(config, rows, in_order):
    row = {**rows[2], "shard": 7, "row": 3}
    assert_same([simulate_record(InputReader(config), row)], [in_order[2]])


class TestNoise:
    def test_its_level_leaves_the_clean_signal(self, config, rows, in_order):
        louder = {
            **rows[3],
            "params/sensing.snr_db": 0.0,
            "snr_db": 0.0,
        }
        loud = simulate_record(InputReader(config), louder)
        quiet = in_order[3]

        assert clean(loud).tobytes() == clean(quiet).tobytes()

        noisy = loud.signals["acceleration"]
        assert noisy.tobytes() != quiet.signals["acceleration"].tobytes()

    def test_every_class_of_a_condition_has_its_floor(self, config, rows, in_order):
        floors = np.array([record.signals["noise_power"] for record in in_order])
        floors = floors.reshape(2, 4, -1)
        assert_close(
            floors,
            np.broadcast_to(floors[:, :1], floors.shape),
            1e-12,
        )
        assert np.abs(floors[0] / floors[1] - 1).max() > 0.01

        # floors relative to the record would reveal the class
        relative = config.with_keys("sensing", snr_reference="record")
        floors = [each.signals["noise_power"] for each in simulated(relative, rows[:4])]
        assert np.abs(np.array(floors) / floors[0] - 1).max() > 0.05

    def test_the_signal_to_noise_ratio_is_reached(self, config, rows):
        """Relative to the healthy twin, which has another start: the mean over the channels."""
        ratio = {"params/sensing.snr_db": 12.0, "snr_db": 12.0}
        healthy = {
            **rows[0],
            **ratio,
            "label": 0,
            "faults_json": "[]",
        }
        result = simulate_record(
            InputReader(config.with_keys("operating", duration_s=0.5)), healthy
        )
        noise = result.signals["acceleration"].astype(float) - clean(result)
        power = np.var(noise, axis=1)

        assert_close(power, result.signals["noise_power"], 0.02)

        decibels = 10 * np.log10(result.signals["signal_power"] / power)
        assert_close(decibels.mean(), 12.0, atol=0.1)

    def test_without_noise_it_is_the_clean_signal(self, config, rows):
        row = dict(rows[1])
        del row["params/sensing.snr_db"]
        result = simulate_record(
            InputReader(config.with_keys("sensing", snr_db=None)), row
        )
        assert result.signals["acceleration"].tobytes() == clean(result).tobytes()


def test_a_sham_record_is_healthy_under_its_label(config, rows, in_order):
    index = next(k for k in range(8) if rows[k]["label_name"] == "missing_tooth")
    sham = simulate_record(
        InputReader(config.with_keys("plan", sham=True)), rows[index]
    )
    labels = [
        result.signals["fault_multihot"].tolist() for result in (sham, in_order[index])
    ]

    assert labels[0] == labels[1]
    assert np.abs(clean(sham)).max() < np.abs(clean(in_order[index])).max()


def test_values_of_a_record(rows, in_order):
    values = in_order[0].values
    assert_close(values["speed_rpm"], rows[0]["speed_set_rpm"], 1e-4)
    assert_close(
        values["mesh_frequency_hz"],
        values["speed_rpm"] / 60 * 23,
        1e-12,
    )
    assert in_order[0].signals["acceleration"].dtype == np.float32


def test_all_records_of_a_unit_have_one_specimen(config, rows):
    """Sound or faulty, and of the healthy twin."""
    drawn = {}
    for row in rows:
        specimen = InputReader(config).inputs(row).run.specimen
        assert len(specimen.forms) == 2
        drawn.setdefault(row["specimen_id"], set()).add(repr(specimen))
    assert all(len(specimens) == 1 for specimens in drawn.values())
    assert len({row["label_name"] for row in rows}) == 4
