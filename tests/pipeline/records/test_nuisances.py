"""Nuisances in records: the same for every class of a unit, whatever they are made beside; none
changes no bit."""

from dataclasses import replace

import numpy as np
import pytest

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import forget_twins, simulate_records
from gensig.systems.nuisances import with_nuisances
from gensig.systems.run import CleanRecord

BASE = (
    "plan.n_records=4",
    "plan.n_units=1",
    "plan.classes=[healthy,missing_tooth]",
    "operating.duration_s=0.1",
    "dataset.store_source=true",
    "dataset.store_clean=true",
    "dataset.store_shaft_angle=true",
    "sensing.noise.band_hz=null",
    "quality.iso1328_grade=null",
)


@pytest.fixture(scope="module")
def shaking():
    """A machine's nuisances on ideal bearing sensors."""
    listed = read_request(["sensing=machine"]).config["sensing"]["nuisances"]
    config = read_request(
        [*BASE, "sensing=bearing", "dataset.store_detectability=true"]
    ).config
    return config.with_keys("sensing", nuisances=listed)


@pytest.fixture(scope="module")
def still(shaking):
    return shaking.with_keys("sensing", nuisances=[])


def rows_of(config):
    plan = make_plan(config)
    return [plan.record(place) for place in range(plan.n_records)]


def made(config, rows=None):
    forget_twins()
    return simulate_records(config, rows_of(config) if rows is None else rows)


@pytest.fixture(scope="module")
def both(shaking, still):
    return made(shaking), made(still)


def added(one, other):
    return (
        one.signals["acceleration_source"].astype(float)
        - other.signals["acceleration_source"]
    )


def test_without_any_a_record_is_the_same_object(still):
    row = rows_of(still)[0]
    run = InputReader(still).inputs(row).run
    record = run.system.simulate(start=run.start, gearbox=run.gearbox)
    rng = np.random.default_rng(0)
    assert with_nuisances(run, record, {"gearbox": rng, "specimen": rng}, rng) is record


def test_every_record_has_them_before_path_and_sensor(both):
    for one, other in zip(*both, strict=True):
        difference = added(one, other)
        level, own = (
            difference.std(axis=1),
            other.signals["acceleration_source"].std(axis=1),
        )
        assert np.all(level > 1e-4 * own)
        assert np.all(level < own)
        np.testing.assert_allclose(
            one.signals["shaft_angle"], other.signals["shaft_angle"], rtol=0, atol=0
        )
        clean = (
            one.signals["acceleration_clean"].astype(float)
            - other.signals["acceleration_clean"]
        )
        np.testing.assert_allclose(clean, difference, atol=1e-4 * own.max())


def with_nuisances_of(inputs, motion):
    return with_nuisances(inputs.run, motion, *inputs.nuisance_streams()).acceleration


def test_no_class_has_others(shaking):
    """At the same angle of the shaft a faulty machine and a sound one are shaken by the same
    bits."""
    faulty = next(
        row for row in rows_of(shaking) if row["label_name"] == "missing_tooth"
    )
    reader = InputReader(shaking)
    system = reader.inputs(faulty).machine
    angle = system.operating.speed * np.arange(5120) / system.sensing.sampling_rate
    motion = CleanRecord(
        acceleration=np.zeros((4, 5120)),
        shaft_angle=angle,
        mean_speed=system.operating.speed,
        contact_loss_fraction=0.0,
        integration_error=0.0,
        integration_check="none",
    )
    found = []
    for row in (faulty, {**faulty, "faults_json": "[]", "label_name": "healthy"}):
        inputs = reader.inputs(row)
        found.append((bool(inputs.run.faults), with_nuisances_of(inputs, motion)))
    assert [faults for faults, _ in found] == [True, False]
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert np.all(found[0][1].std(axis=1) > 0.0)
    other = replace(
        reader.inputs(faulty), numbers=replace(reader.inputs(faulty).numbers, gearbox=7)
    )
    assert not np.array_equal(with_nuisances_of(other, motion), found[0][1])


def test_the_floor_of_a_condition_counts_them_and_is_one(shaking, both):
    rows = rows_of(shaking)
    floors = {}
    for row, one, other in zip(rows, *both, strict=True):
        floors.setdefault(row["condition_id"], []).append(one.signals["noise_power"])
        assert np.all(one.signals["noise_power"] != other.signals["noise_power"])
    assert max(len(found) for found in floors.values()) > 1
    for found in floors.values():
        for floor in found:
            np.testing.assert_array_equal(floor, found[0])


def test_what_a_fault_adds_is_told_from_what_the_machine_has_anyway(both):
    for one, other in zip(*both, strict=True):
        if one.values["label_name"] != "healthy":
            ratio = one.values["detectability"] / other.values["detectability"]
            assert (
                0.7 < ratio < 1.01
            )  # the floor has risen a little with the twin, the residual has not
        else:
            assert one.values["detectability"] == 0.0
