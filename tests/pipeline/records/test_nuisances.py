"""Nuisances in records: the same for every class of a unit, whatever they are made beside; none
changes no bit."""

from dataclasses import replace

import numpy as np
import pytest
from record_sets import rows_of, simulated

from gensig.plan.request import read_request
from gensig.record.inputs import InputReader, simulate_motions
from gensig.systems import nuisances
from gensig.systems.nuisances import nuisance_acceleration, with_nuisances
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


@pytest.fixture(scope="module")
def both(shaking, still):
    return simulated(shaking), simulated(still)


def added(one, other, name):
    return one.signals[name].astype(float) - other.signals[name]


def test_without_any_a_record_is_the_same_object(still):
    row = rows_of(still)[0]
    run = InputReader(still).inputs(row).run
    record = run.system.simulate(start=run.start, gearbox=run.gearbox)
    rng = np.random.default_rng(0)
    assert with_nuisances(run, record, {"gearbox": rng, "specimen": rng}, rng) is record


def test_every_record_has_them_before_path_and_sensor(both):
    for one, other in zip(*both, strict=True):
        difference = added(one, other, "acceleration_source")
        motion = other.signals["acceleration_source"].std(axis=1)
        level = difference.std(axis=1)
        assert np.all((1e-4 * motion < level) & (level < motion))
        angles = [record.signals["shaft_angle"] for record in (one, other)]
        np.testing.assert_array_equal(*angles)
        clean = added(one, other, "acceleration_clean")
        np.testing.assert_allclose(clean, difference, atol=1e-4 * motion.max())


def test_no_class_has_others(shaking):
    """At the same angle of the shaft a faulty machine and a sound one are shaken by the same
    bits."""
    rows = rows_of(shaking)
    (faulty, *_) = [row for row in rows if row["label_name"] == "missing_tooth"]
    reader = InputReader(shaking)
    system = reader.inputs(faulty).machine
    times = np.arange(5120) / system.sensing.sampling_rate
    motion = CleanRecord(
        acceleration=np.zeros((4, 5120)),
        shaft_angle=system.operating.speed * times,
        mean_speed=system.operating.speed,
        contact_loss_fraction=0.0,
        integration_error=0.0,
        integration_check="none",
    )

    def shaken_by(row, **numbers):
        inputs = reader.inputs(row)
        inputs = replace(inputs, numbers=replace(inputs.numbers, **numbers))
        streams = inputs.nuisance_streams()
        shaken = with_nuisances(inputs.run, motion, *streams).acceleration
        return bool(inputs.run.faults), shaken

    sound = {**faulty, "faults_json": "[]", "label_name": "healthy"}
    (has_fault, shaken), (still_has, same) = shaken_by(faulty), shaken_by(sound)
    assert (has_fault, still_has) == (True, False)
    np.testing.assert_array_equal(shaken, same)
    assert np.all(shaken.std(axis=1) > 0.0)
    assert not np.array_equal(shaken_by(faulty, gearbox=7)[1], shaken)


def test_the_floor_of_a_condition_counts_them_and_is_one(shaking, both):
    floors = {}
    for row, one, other in zip(rows_of(shaking), *both, strict=True):
        floor = one.signals["noise_power"]
        assert np.all(floor != other.signals["noise_power"])
        floors.setdefault(row["condition_id"], []).append(floor)
    assert max(map(len, floors.values())) > 1
    for of_one_condition in floors.values():
        assert np.ptp(of_one_condition, axis=0).max() == 0.0


def test_what_a_fault_adds_is_told_from_what_the_machine_has_anyway(both):
    for one, other in zip(*both, strict=True):
        value = one.values["detectability"]
        if one.values["label_name"] == "healthy":
            assert value == 0.0
        else:
            # the floor has risen a little with the twin, the residual has not
            assert 0.7 < value / other.values["detectability"] < 1.01


MACHINE = read_request(["sensing=machine"]).config["sensing"]
NUISANCES = {part["kind"]: part for part in MACHINE["nuisances"]}


@pytest.mark.parametrize("place", ["bearing", "housing"])
@pytest.mark.parametrize("kind", list(NUISANCES))
def test_any_nuisance_may_be_alone_at_any_sensor(kind, place):
    """Low orders alone are made at a few samples and interpolated, in columns."""
    base = ["plan.n_records=1", "operating.duration_s=0.05", f"sensing={place}"]
    config = read_request(base).config
    alone = config.with_keys("sensing", nuisances=[NUISANCES[kind]])
    (record,) = simulated(alone)
    (without,) = simulated(config)
    assert record.values.get("status") != "failed"
    assert np.any(added(record, without, "acceleration"))


def test_low_orders_alone_lie_in_columns_and_what_they_shake_in_rows(
    still, monkeypatch
):
    """Sums along a record round as its order in memory says, so that order is always one."""
    alone = still.with_keys("sensing", nuisances=[NUISANCES["unbalance"]])
    heard = []

    def keeping(*arguments):
        heard.append(nuisance_acceleration(*arguments))
        return heard[-1]

    monkeypatch.setattr(nuisances, "nuisance_acceleration", keeping)
    inputs = InputReader(alone).inputs(rows_of(alone)[0])
    (motion,) = simulate_motions([inputs])
    assert not heard[0].flags.c_contiguous
    assert motion.acceleration.flags.c_contiguous
