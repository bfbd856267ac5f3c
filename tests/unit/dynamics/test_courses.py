"""Speed and torque over time: rotation of the shaft, load of the teeth, independent records."""

import math
from itertools import permutations

import numpy as np
import pytest
from closeness import assert_close
from core_runs import (
    MISSING,
    QUICK,
    ROTORS,
    CoreRun,
    assert_independent,
)

from gensig.dynamics.pair import PINION_Y
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run

RATE = 51200.0
DRIVE = 20.0
DRIVE_HZ = "operating.drive_frequency_hz"
BRIEF = {**QUICK, "operating.duration_s": 0.03}
SPEED = "operating.speed_profile"
TORQUE = "operating.torque_profile"
RAMP = [[-0.4, 0.4], [0.4, 1.6]]
SET_SPEED = 60 * math.pi
ROTATIONS = {"sensing.channels": ["pinion_rotation", "wheel_rotation"]}
WITH_ROTORS = pytest.mark.parametrize(
    "rotors", [{}, ROTORS], ids=["pair", "motor_and_load"]
)


@pytest.fixture(scope="module")
def run(machine):
    def make(changes=None, faults=()):
        system = machine({**BRIEF, **(changes or {})})
        return Run(system=system, faults=tuple(faults))

    return make


@pytest.fixture(scope="module")
def record(run):
    return lambda *changes: simulate_together([run(*changes)])[0]


@pytest.fixture(scope="module")
def steady(record):
    return record()


def turned(run, n_samples):
    """The exact integral of the set speed at every sample, rad."""
    return run.system.operating.nominal(np.arange(n_samples) / RATE).angle


def assert_same_signal(record, expected, atol):
    level = expected.acceleration.std(axis=1, keepdims=True)
    assert_close(
        record.acceleration / level,
        expected.acceleration / level,
        atol=atol,
    )


class TestSteady:
    @pytest.mark.parametrize("key", [SPEED, TORQUE])
    def test_a_constant_course_is_none(self, record, steady, key):
        constant = record({key: [[0, 1], [1, 1]]})
        assert_same_signal(constant, steady, 1e-9)
        assert_close(constant.shaft_angle, steady.shaft_angle, atol=1e-12)
        assert_close(constant.mean_speed, steady.mean_speed, 1e-12)

    def test_a_factor_is_another_set_speed(self, record):
        factor = record({SPEED: [[0, 1.5], [1, 1.5]]})
        expected = record({"operating.speed_rpm": 2700})
        assert_same_signal(factor, expected, 1e-6)
        assert_close(factor.mean_speed, expected.mean_speed, 1e-9)

    def test_mean_speed_is_that_of_the_shaft(self, record):
        """To the sample after the last, which a longer record has."""
        short = record({SPEED: RAMP})
        long = record({SPEED: RAMP, "operating.duration_s": 0.06}).shaft_angle
        n = len(short.shaft_angle)

        assert_close(long[:n], short.shaft_angle, atol=1e-9)
        assert_close(
            short.mean_speed,
            (long[n] - long[0]) * RATE / n,
            1e-9,
        )


class TestRamp:
    ACCELERATION = 1.5 * SET_SPEED

    @WITH_ROTORS
    def test_the_shaft_lags(self, run, record, rotors):
        """By the inertia torque over the drive's stiffness; without friction, which would grow."""
        changes = {
            **rotors,
            "mesh.friction_coefficient": 0,
            SPEED: RAMP,
        }
        ramp = run(changes)
        still = {**changes, SPEED: [[0, 1], [1, 1]]}
        n = len(record(changes).shaft_angle)
        deviation = turned(ramp, n) - record(changes).shaft_angle
        lag = deviation - (turned(run(still), n) - record(still).shaft_angle)
        running = running_pair(ramp)
        twist = self.ACCELERATION * running.reduced_inertia / running.drive_stiffness
        if (
            rotors
        ):  # the drive holds the motor, whose coupling turns the pinion further back
            motor = ramp.system.motor
            driven = running.reduced_inertia - motor.inertia
            twist += self.ACCELERATION * driven / motor.coupling_stiffness
        else:
            assert_close(
                twist,
                self.ACCELERATION / (2 * math.pi * DRIVE) ** 2,
                1e-12,
            )

        assert_close(lag.mean(), twist, 2e-3)
        assert np.ptp(lag) < 0.05 * twist

    def test_accelerations_are_those_of_the_rotating_shafts(self, record):
        """Not of the deviations from nominal rotation."""
        means = [
            record({**ROTATIONS, **course}).acceleration[1].mean()
            for course in ({SPEED: RAMP}, {})
        ]
        assert_close(
            means[0] - means[1],
            self.ACCELERATION * 23 / 84,
            5e-2,
        )

    @pytest.mark.parametrize("kink", [0.01, 0.0105])
    def test_a_kink_of_the_course_is_no_jump_of_the_shaft(self, run, kink):
        """On and between the instants at which the course is tabled."""
        changed = run(
            {
                SPEED: [
                    [-0.4, 1],
                    [kink, 1],
                    [kink + 0.005, 1.3],
                    [1, 1.3],
                ]
            }
        )
        (record,) = simulate_together([changed])
        off = record.shaft_angle - turned(changed, len(record.shaft_angle))
        most = 0.3 * SET_SPEED / RATE  # of a shaft that keeps its speed

        assert np.abs(np.diff(off)).max() < most
        assert np.abs(np.diff(off, 2)).max() < 0.03 * most


class TestTorque:
    STEP = 1 / (51200 * 5)

    def carried(self, running, *begins):
        """Mean bearing force over four mesh periods, as shares of the set mesh force."""
        core = CoreRun([running.dynamics], self.STEP, span=(0.0, 0.04))
        n_steps = round(4 / running.mesh_frequency / self.STEP)
        stiffness = running.pinion.support.stiffness_y
        shares = []
        for begin in begins:
            core.means(round(begin / self.STEP) - core.now)
            deflection = []
            for _ in range(n_steps):
                core.means(1)
                deflection.append(core.whole[0, PINION_Y, 0])
            shares.append(np.mean(deflection) * stiffness / running.mesh_force)
        return shares

    @pytest.mark.parametrize("factor", [0.3, 1.8])
    def test_the_teeth_carry_their_share(self, run, factor):
        """Before and after the torque has changed."""
        running = running_pair(run({TORQUE: [[-1, 1], [0.01, 1], [0.02, factor]]}))
        before = 0.01 - 4 / running.mesh_frequency
        assert_close(
            self.carried(running, before, 0.03),
            [1.0, factor],
            1e-2,
        )

    def test_without_torque_nothing_touches(self, record):
        free = record({TORQUE: [[0, 0], [1, 0]]})
        assert free.contact_loss_fraction == 1.0
        assert_close(free.acceleration, 0, atol=1e-9)
        assert_close(free.mean_speed, SET_SPEED, 1e-12)


class TestNeighbours:
    def test_steady_and_changing_records_are_independent(self, run):
        kinked = {SPEED: [[0.0, 1.0], [0.01, 1.3]]}
        both = {SPEED: RAMP, TORQUE: RAMP}
        plain = [
            run(),
            run({SPEED: RAMP}),
            run({TORQUE: RAMP}),
            run(both),
        ]
        runs = [*plain, run({}, MISSING), run(kinked, MISSING)]

        assert_independent(runs, [range(6), (5, 4, 3, 2, 1, 0)])

    def test_next_to_longer_settling(self, run):
        """The course of all is tabled from the begin of the slowest."""
        speed = [[-0.1, 0.8], [0.01, 0.9], [0.03, 1.2]]
        torque = [[0.0, 1.0], [0.02, 1.1]]
        changing = {SPEED: speed, TORQUE: torque}
        runs = [run({**changing, DRIVE_HZ: rate}) for rate in (20, 5, 7.3)]
        assert_independent(runs, list(permutations(range(3)))[::2])


def test_machines_with_rotors_move_in_every_channel(run):
    """Eight degrees of freedom, on a ramp of speed and torque."""
    ends = [f"{name}_rotation" for name in ("pinion", "wheel", "motor", "load")]
    channels = {"sensing.channels": ["pinion_y", *ends]}
    (record,) = simulate_together(
        [
            run(
                {
                    **ROTORS,
                    SPEED: RAMP,
                    TORQUE: RAMP,
                    **channels,
                },
                MISSING,
            )
        ]
    )

    assert record.acceleration.shape == (5, 1536)
    assert (record.acceleration.std(axis=-1) > 1.0).all()
