"""Speed and load over time, in records: what the shaft does, what the teeth carry, what is stored of it."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_records
from gensig.systems.base import simulate_together
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.run import Run

RATE = 51200.0
# so that nothing but the course moves the shaft
PLAIN = {
    "solver.max_error": None,
    "mesh.friction_coefficient": 0,
    "quality.iso1328_grade": None,
}
SPEED, TORQUE = "operating.speed_profile", "operating.torque_profile"
WALK = {"kind": "random_walk", "scatter": 0.02, "correlation_time_s": 0.2}


@pytest.fixture(scope="module")
def run(machine):
    return lambda changes, **more: Run(
        system=machine({**PLAIN, **changes}), faults=(), **more
    )


def simulated(*runs):
    return simulate_together(runs)


def wave(values, frequency):
    """Amplitude of one frequency, over whole periods."""
    times = np.arange(len(values)) / RATE
    return 2 * abs(np.mean(values * np.exp(-2j * np.pi * frequency * times)))


def followed(frequency, drive=5.0, damping=0.7):
    """What the soft speed source lets through of a change of the set speed: a spring and a damper to it."""
    s = 1j * frequency / drive
    return abs((2 * damping * s + 1) / (s * s + 2 * damping * s + 1))


def test_a_walk_without_scatter_is_none(run):
    still, found = simulated(
        run({"operating.duration_s": 0.05}),
        run({"operating.duration_s": 0.05, SPEED: {**WALK, "scatter": 0.0}}),
    )
    assert_allclose(
        found.acceleration,
        still.acceleration,
        rtol=0,
        atol=1e-9 * still.acceleration.std(),
    )
    assert_allclose(found.mean_speed, still.mean_speed, rtol=1e-12, atol=0)


def test_the_mean_speed_is_that_of_the_course(run):
    """What the drive's 5 Hz leave of it: the records end where they have caught up."""
    ramp = [[-1.0, 0.5], [0.0, 0.5], [0.2, 1.0], [0.7, 1.0]]
    courses = {SPEED: ramp, "operating.duration_s": 0.7}
    one = run(courses)
    (found,) = simulated(one)
    turned = one.system.operating.nominal(np.array([0.7])).angle[0]
    assert_allclose(found.mean_speed * 0.7, turned, rtol=1e-4, atol=0)
    assert turned < 0.95 * one.system.operating.speed * 0.7


def test_the_shaft_follows_a_slow_walk(run):
    one = run({SPEED: {**WALK, "correlation_time_s": 4.0}, "operating.duration_s": 0.4})
    (found,) = simulated(one)
    times = np.arange(len(found.shaft_angle)) / RATE
    off = found.shaft_angle - one.system.operating.nominal(times).angle
    course = one.system.operating.nominal(times).speed
    assert np.ptp(course) > 2e-3 * one.system.operating.speed
    assert np.ptp(off) < 0.2 * np.abs(
        np.cumsum(course - one.system.operating.speed)[-1] / RATE
    )


@pytest.mark.parametrize(
    ("ripple", "frequency"), [({"order": 1}, 30.0), ({"frequency_hz": 10}, 10.0)]
)
def test_of_a_speed_ripple_comes_what_the_drive_lets_through(run, ripple, frequency):
    share, duration = 0.01, 0.2
    one = run(
        {
            "operating.speed_ripple": {"share": share, **ripple},
            "operating.duration_s": duration,
        }
    )
    still = run({"operating.duration_s": duration})
    found, plain = simulated(one, still)
    moved = found.shaft_angle - plain.shaft_angle
    speed = np.gradient(moved, 1 / RATE, edge_order=2) / one.system.operating.speed
    assert_allclose(
        wave(speed, frequency), share * followed(frequency), rtol=0.03, atol=0
    )
    assert followed(frequency) < 0.95


def test_a_torque_ripple_is_in_the_force_on_the_teeth(run):
    share, duration = 0.1, 0.2
    changes = {
        "operating.torque_ripple": {"share": share, "order": 2},
        "operating.duration_s": duration,
    }
    one = run(changes, tell_mesh=True)
    (found,) = simulated(one)
    force = found.mesh.force / pair_dynamics(one).mesh_force
    assert_allclose(wave(force, 60.0), share, rtol=0.05, atol=0)
    assert wave(force, 50.0) < 0.1 * share


def test_a_lead_in_changes_neither_walk_nor_ripple(run):
    """Perfect gears, so that the motion is the same from wherever it starts; see docs/theory/sensing.md."""
    courses = {SPEED: WALK, TORQUE: WALK, "operating.torque_ripple": {"share": 0.1, "order": 2},
               "operating.speed_ripple": {"share": 0.01, "order": 2}, "operating.duration_s": 0.2}  # fmt: skip
    led = run({**courses, "sensing.sensor.low_cutoff_hz": 5.0})
    n_lead = led.system.sensing.n_lead
    assert n_lead > 4000
    (found,) = simulate_with_lead_in([led])
    (expected,) = simulated(run(courses))
    still, other = simulated(
        run({"operating.duration_s": 0.2}), run({**courses, "operating.course_seed": 1})
    )
    speeds = [
        np.gradient(one.shaft_angle, 1 / RATE)
        for one in (found, expected, still, other)
    ]
    assert_allclose(speeds[0], speeds[1], rtol=0, atol=0.02 * speeds[1].std())
    assert_allclose(found.mean_speed, expected.mean_speed, rtol=2e-6, atol=0)
    for another in (still, other):
        assert abs(another.mean_speed / expected.mean_speed - 1) > 1e-4
    level = expected.acceleration.std(axis=1, keepdims=True)
    assert np.all(
        (found.acceleration[:, n_lead:] - expected.acceleration).std(axis=1)
        <= 0.02 * level[:, 0]
    )


@pytest.fixture(scope="module")
def stored():
    words = ["operating=drifting", "plan.n_records=4", "plan.n_units=2", "plan.classes=[healthy,crack]",
             "operating.duration_s=0.1", "dataset.store_operating=true", "dataset.store_shaft_angle=true"]  # fmt: skip
    config = read_request(words).config
    plan = make_plan(config)
    rows = [plan.record(place) for place in range(plan.n_records)]
    return rows, simulate_records(config, rows)


class TestStored:
    def test_traces_are_single_precision_samples(self, stored):
        for record in stored[1]:
            for name in ("shaft_speed", "torque_set"):
                assert record.signals[name].shape == (5120,)
                assert record.signals[name].dtype == np.float32

    def test_the_speed_is_that_of_the_shaft(self, stored):
        """Its integral is what the angle grows by, and its mean the record's."""
        for record in stored[1]:
            speed, angle = (
                record.signals["shaft_speed"].astype(float),
                record.signals["shaft_angle"],
            )
            grown = (
                np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
                / RATE
            )
            assert_allclose(grown, angle - angle[0], rtol=0, atol=2e-4)
            assert_allclose(
                speed.mean() * 30 / math.pi,
                record.values["speed_rpm"],
                rtol=2e-5,
                atol=0,
            )
            assert (
                abs(record.values["speed_rpm"] / record.values["speed_set_rpm"] - 1)
                > 1e-5
            )

    def test_all_classes_of_a_condition_have_its_course(self, stored):
        torques = {}
        for row, record in zip(*stored, strict=True):
            torques.setdefault(row["condition_id"], []).append(
                record.signals["torque_set"]
            )
        assert len(torques) == 2
        for one, other in torques.values():
            assert one.tobytes() == other.tobytes()
        first, second = (own[0] for own in torques.values())
        assert np.abs(first - second).max() > 0.1

    def test_the_torque_ripples_twice_a_turn(self, stored):
        row, record = stored[0][0], stored[1][0]
        torque = record.signals["torque_set"].astype(float) / row["torque_nm"]
        assert_allclose(wave(torque, 60.0), 0.02, rtol=0.15, atol=0)
