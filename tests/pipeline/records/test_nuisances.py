"""Nuisances in records: the same for every class of a unit, whatever they are made beside; none
changes no bit."""

from dataclasses import replace

import numpy as np
import pytest

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.production.reproduction import simulate_twin
from gensig.record.inputs import InputReader
from gensig.record.simulate import forget_twins, simulate_record, simulate_records
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
        np.testing.assert_allclose(clean, difference, rtol=0, atol=1e-4 * own.max())


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


def test_bits_do_not_depend_on_what_a_record_is_made_beside(shaking, both):
    rows = rows_of(shaking)
    for place in (1, 3):
        (alone,) = made(shaking, [rows[place]])
        for name, values in both[0][place].signals.items():
            np.testing.assert_array_equal(alone.signals[name], values)
        np.testing.assert_equal(alone.values, both[0][place].values)


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


def test_a_part_more_leaves_the_others_alone(shaking, still):
    nuisances = shaking["sensing"]["nuisances"]
    fewer = shaking.with_keys("sensing", nuisances=nuisances[:-1])
    row = rows_of(shaking)[0]
    rest = added(made(fewer, [row])[0], made(still, [row])[0])
    whole = added(made(shaking, [row])[0], made(still, [row])[0])
    of_the_last = whole - rest
    assert (
        of_the_last[2].std() > 0.1 * whole[2].std()
    )  # the neighbour's mesh, on the wheel
    np.testing.assert_allclose(
        of_the_last[0], 0.0, rtol=0, atol=1e-3 * np.abs(whole[0]).max()
    )


def test_a_twin_made_later_has_the_nuisances_of_its_record(shaking):
    """Also where its noise is that of the original, not its own."""
    config = shaking.with_keys("sensing", snr_reference="record")
    row = rows_of(config)[1]
    twin, original = simulate_twin(config, row), simulate_record(config, row)
    noise = (
        twin.signals["acceleration"].astype(float) - twin.signals["acceleration_clean"]
    )
    np.testing.assert_allclose(
        noise.var(axis=1), original.signals["noise_power"], rtol=0.1, atol=0
    )
    same = (
        original.signals["acceleration"].astype(float)
        - original.signals["acceleration_clean"]
    )
    np.testing.assert_allclose(noise, same, rtol=0, atol=1e-3 * same.std())
