"""Speed and load over time in records: rotation of the shaft, load of the teeth, stored traces."""

import math

import numpy as np
import pytest
from closeness import assert_close

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_records
from gensig.systems.base import simulate_together
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run

RATE = 51200.0
# without friction and errors only the course moves the shaft
PLAIN = {
    "solver.max_error": None,
    "mesh.friction_coefficient": 0,
    "quality.iso1328_grade": None,
}
SPEED = "operating.speed_profile"
TORQUE = "operating.torque_profile"
DURATION = "operating.duration_s"
WALK = {
    "kind": "random_walk",
    "scatter": 0.02,
    "correlation_time_s": 0.2,
}


@pytest.fixture(scope="module")
def run(machine):
    def make(changes, **more):
        return Run(
            system=machine({**PLAIN, **changes}),
            **more,
        )

    return make


def record(run):
    return simulate_together([run])[0]


def wave(values, frequency):
    """Amplitude of one frequency, over whole periods."""
    times = np.arange(len(values)) / RATE
    return 2 * abs(np.mean(values * np.exp(-2j * np.pi * frequency * times)))


def followed(frequency, drive=5.0, damping=0.7):
    """Transmission of the soft speed source, a spring and a damper to the set speed."""
    s = 1j * frequency / drive
    return abs((2 * damping * s + 1) / (s * s + 2 * damping * s + 1))


@pytest.mark.parametrize(
    ("ripple", "frequency"),
    [({"order": 1}, 30.0), ({"frequency_hz": 10}, 10.0)],
)
def test_the_drive_transmits_a_part_of_a_speed_ripple(run, ripple, frequency):
    share = 0.01
    still = run({DURATION: 0.2})
    rippled = run(
        {
            "operating.speed_ripple": {
                "share": share,
                **ripple,
            },
            DURATION: 0.2,
        }
    )
    moved = record(rippled).shaft_angle - record(still).shaft_angle
    speed = np.gradient(moved, 1 / RATE, edge_order=2) / still.system.operating.speed

    assert_close(
        wave(speed, frequency),
        share * followed(frequency),
        0.02,
    )
    assert followed(frequency) < 0.95


def test_a_torque_ripple_is_in_the_force_on_the_teeth(run):
    ripple = {
        "operating.torque_ripple": {"share": 0.1, "order": 2},
        DURATION: 0.2,
    }
    rippled = run(ripple, with_mesh_state=True)
    force = record(rippled).mesh.force / running_pair(rippled).mesh_force

    assert_close(wave(force, 60.0), 0.1, 0.02)
    assert wave(force, 50.0) < 0.01


def test_a_lead_in_changes_neither_walk_nor_ripple(run):
    """Of perfect gears, whose motion is the same from any start; see docs/theory/sensing.md."""
    courses = {
        SPEED: WALK,
        TORQUE: WALK,
        "operating.torque_ripple": {"share": 0.1, "order": 2},
        "operating.speed_ripple": {"share": 0.01, "order": 2},
        DURATION: 0.2,
    }
    led = run({**courses, "sensing.sensor.low_cutoff_hz": 5.0})
    n_lead = led.system.sensing.n_lead

    assert n_lead > 4000

    (long,) = simulate_with_lead_in([led])
    expected = record(run(courses))

    speed, wanted = (
        np.gradient(each.shaft_angle, 1 / RATE) for each in (long, expected)
    )

    assert_close(speed, wanted, atol=0.02 * wanted.std())
    assert_close(long.mean_speed, expected.mean_speed, 2e-6)
    assert abs(led.system.operating.speed / expected.mean_speed - 1) > 1e-4

    off = long.acceleration[:, n_lead:] - expected.acceleration
    assert np.all(off.std(axis=1) <= 0.02 * expected.acceleration.std(axis=1))


class TestStored:
    @pytest.fixture(scope="class")
    @classmethod
    def stored(cls):
        """Rows of a plan and their records."""
        words = [
            "operating=drifting",
            "plan.n_records=4",
            "plan.n_units=2",
            "plan.classes=[healthy,crack]",
            "operating.duration_s=0.1",
            "dataset.store_operating=true",
            "dataset.store_shaft_angle=true",
        ]
        config = read_request(words).config
        plan = make_plan(config)
        rows = [plan.record(index) for index in range(plan.n_records)]
        return list(
            zip(
                rows,
                simulate_records(InputReader(config), rows),
                strict=True,
            )
        )

    def test_the_speed_is_that_of_the_shaft(self, stored):
        """Its integral is the growth of the angle, and its mean the record's."""
        for row, result in stored:
            for name in ("shaft_speed", "torque_set"):
                assert result.signals[name].shape == (5120,)
                assert result.signals[name].dtype == np.float32
            speed = result.signals["shaft_speed"].astype(float)
            angle = result.signals["shaft_angle"]
            grown = np.cumsum(0.5 * (speed[1:] + speed[:-1])) / RATE
            assert_close(
                np.append(0.0, grown),
                angle - angle[0],
                atol=2e-4,
            )
            mean = result.values["speed_rpm"]
            assert_close(speed.mean() * 30 / math.pi, mean, 2e-5)
            assert abs(mean / row["speed_set_rpm"] - 1) > 1e-5

    def test_all_classes_of_a_condition_have_its_torque(self, stored):
        """The torque ripples twice a turn."""
        torques = {}
        for row, result in stored:
            torque = result.signals["torque_set"]
            torques.setdefault(row["condition_id"], []).append(torque)
            relative = torque.astype(float) / row["torque_nm"]
            assert_close(wave(relative, 60.0), 0.02, 0.15)
        (first, same_first), (second, same_second) = torques.values()

        assert first.tobytes() == same_first.tobytes()
        assert second.tobytes() == same_second.tobytes()
        assert np.abs(first - second).max() > 0.1
