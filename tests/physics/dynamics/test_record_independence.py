"""A record depends on its own row only; noise depends on the healthy twin, and leaves the physics alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record import simulate as records
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record, simulate_records

ORDER = (5, 0, 3, 6, 1, 7, 2, 4)


@pytest.fixture(scope="module")
def config():
    request = read_request(
        [
            "experiment=quickstart",
            "plan.n_records=8",
            "plan.n_units=2",
            "operating.duration_s=0.05",
        ]
    )
    return request.config.with_keys("dataset", store_clean=True)


@pytest.fixture(scope="module")
def plan(config):
    return make_plan(config)


def simulated(config, plan, indices):
    """Records by index, from a process that has simulated nothing before."""
    records._TWINS.clear()
    return {index: simulate_record(config, plan.record(index)) for index in indices}


@pytest.fixture(scope="module")
def in_order(config, plan):
    return simulated(config, plan, range(8))


def same(one, two):
    return all(
        one.signals[key].tobytes() == two.signals[key].tobytes() for key in one.signals
    ) and str(one.values) == str(two.values)


def test_alone_or_after_others_the_bits_are_the_same(config, plan, in_order):
    shuffled = simulated(config, plan, ORDER)
    assert all(same(in_order[index], shuffled[index]) for index in ORDER)
    assert same(in_order[5], simulated(config, plan, [5])[5])
    assert not same(in_order[5], in_order[4])


@pytest.mark.parametrize("size", [1, 3, 16])
def test_in_blocks_the_bits_are_the_same(config, plan, in_order, size):
    """However many are simulated side by side, twins with them, from a process that knows no twin or some."""
    for known in (False, True):
        if not known:
            records._TWINS.clear()
        rows = [plan.record(index) for index in ORDER]
        found = [
            one
            for first in range(0, 8, size)
            for one in simulate_records(config, rows[first : first + size])
        ]
        assert [
            index
            for index, one in zip(ORDER, found, strict=True)
            if not same(one, in_order[index])
        ] == []


def test_one_that_cannot_be_leaves_its_block_alone(config, plan, in_order):
    """A row whose step would be too long is a failed record, its neighbours' bits are theirs."""
    rows = [plan.record(index) for index in range(4)]
    rows[2] = {**rows[2], "params/operating.drive_frequency_hz": 1e6}
    records._TWINS.clear()
    found = simulate_records(config, rows)
    assert [one.values.get("status") for one in found] == [None, None, "failed", None]
    assert "solver.oversampling" in found[2].values["status_reason"]
    assert all(same(found[index], in_order[index]) for index in (0, 1, 3))


def test_a_longer_plan_of_the_same_draws_keeps_a_row(config, plan, in_order):
    """The row alone decides: another shard or row number changes nothing."""
    row = {**plan.record(2), "shard": 7, "row": 3}
    assert same(in_order[2], simulate_record(config, row))


class TestNoise:
    def test_the_noise_level_leaves_the_clean_signal_alone(
        self, config, plan, in_order
    ):
        row = plan.record(3)
        loud = simulate_record(
            config, {**row, "params/sensing.snr_db": 0.0, "snr_db": 0.0}
        )
        assert (
            loud.signals["acceleration_clean"].tobytes()
            == in_order[3].signals["acceleration_clean"].tobytes()
        )
        assert (
            loud.signals["acceleration"].tobytes()
            != in_order[3].signals["acceleration"].tobytes()
        )

    def test_the_floor_is_the_same_for_every_class_of_a_group(self, plan, in_order):
        floors = np.array(
            [in_order[index].signals["noise_power"] for index in range(8)]
        ).reshape(2, 4, -1)
        assert_allclose(
            floors, np.broadcast_to(floors[:, :1], floors.shape), rtol=1e-12, atol=0
        )
        assert np.abs(floors[0] / floors[1] - 1).max() > 0.01

    def test_a_floor_that_follows_the_record_would_tell_the_class(self, config, plan):
        own = config.with_keys("sensing", snr_reference="record")
        floors = np.array(
            [
                found.signals["noise_power"]
                for found in simulated(own, plan, range(4)).values()
            ]
        )
        assert np.abs(floors / floors[0] - 1).max() > 0.05

    def test_achieved_signal_to_noise_ratio(self, config, plan):
        own = config.with_keys("operating", duration_s=0.5)
        row = {
            **plan.record(0),
            "params/sensing.snr_db": 12.0,
            "snr_db": 12.0,
            "label": 0,
            "faults_json": "[]",
        }
        found = simulate_record(own, row)
        noise = (
            found.signals["acceleration"].astype(float)
            - found.signals["acceleration_clean"]
        )
        assert_allclose(
            np.var(noise, axis=1), found.signals["noise_power"], rtol=0.04, atol=0
        )
        ratio = found.signals["signal_power"] / np.var(noise, axis=1)
        # against the healthy twin, which runs from another start: the mean over the channels
        assert_allclose(10 * np.log10(ratio).mean(), 12.0, rtol=0, atol=0.1)

    def test_no_noise_is_the_clean_signal(self, config, plan):
        own = config.with_keys("sensing", snr_db=None)
        row = {
            key: value
            for key, value in plan.record(1).items()
            if key != "params/sensing.snr_db"
        }
        found = simulate_record(own, row)
        assert (
            found.signals["acceleration"].tobytes()
            == found.signals["acceleration_clean"].tobytes()
        )


def test_a_sham_record_is_healthy_under_its_label(config, plan, in_order):
    sham = config.with_keys("plan", sham=True)
    index = next(k for k in range(8) if plan.record(k)["label_name"] == "missing_tooth")
    found, real = simulate_record(sham, plan.record(index)), in_order[index]
    assert (
        found.signals["fault_multihot"].tolist()
        == real.signals["fault_multihot"].tolist()
    )
    assert (
        np.abs(found.signals["acceleration_clean"]).max()
        < np.abs(real.signals["acceleration_clean"]).max()
    )


def test_values_of_a_record(config, plan, in_order):
    row, found = plan.record(0), in_order[0].values
    assert_allclose(found["speed_rpm"], row["speed_set_rpm"], rtol=1e-4, atol=0)
    assert_allclose(
        found["mesh_frequency_hz"], found["speed_rpm"] / 60 * 23, rtol=1e-12, atol=0
    )
    assert in_order[0].signals["acceleration"].dtype == np.float32


def test_a_run_that_cannot_be_is_a_failed_record(config, plan):
    coarse = config.with_keys("solver", oversampling=2).with_keys(
        "sensing", sampling_rate_hz=6_000
    )
    found = simulate_record(coarse, plan.record(0))
    assert found.values["status"] == "failed"
    assert "solver.oversampling" in found.values["status_reason"]
    assert np.isnan(found.signals["acceleration"]).all()


def test_a_specimen_is_the_same_whatever_its_record_is_told_to_have(config, plan):
    """Gears of a unit have one set of deviations: sound or faulty, and of the healthy twin."""
    drawn = {}
    for row in (plan.record(index) for index in range(8)):
        run = InputReader(config).inputs(row).run
        assert len(run.specimen.forms) == 2
        drawn.setdefault(row["specimen_id"], set()).add(repr(run.specimen))
    assert all(len(some) == 1 for some in drawn.values())
    assert (
        len({row["label_name"] for row in (plan.record(index) for index in range(8))})
        == 4
    )
