"""Speed and torque over time: what the shaft turns, what the teeth carry, and that neighbours do not matter."""

import math
from itertools import permutations

import numpy as np
import pytest
from core_runs import CoreRun
from numpy.testing import assert_allclose

from gensig.dynamics.integrator import integrate
from gensig.dynamics.pair import PINION_ROTATION, PINION_Y
from gensig.faults.broken import MissingTooth
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.run import Run

RATE, DRIVE = 51200.0, 20.0
QUICK = {"operating.duration_s": 0.03, "solver.max_error": None, "operating.drive_frequency_hz": DRIVE,
         "gear.pinion.support.damping_x_ns_per_m": 100, "gear.wheel.support.damping_x_ns_per_m": 500}  # fmt: skip
SPEED, TORQUE = "operating.speed_profile", "operating.torque_profile"
RAMP = [[-0.4, 0.4], [0.4, 1.6]]
SET_SPEED = 60 * math.pi
MISSING = (MissingTooth(gear="pinion", tooth=3),)
ROTATIONS = {"sensing.channels": ["pinion_rotation", "wheel_rotation"]}
ROTORS = {"system.motor.inertia_kg_m2": 5e-4, "system.load.inertia_kg_m2": 5e-3}


@pytest.fixture(scope="module")
def run(machine):
    return lambda changes=None, faults=(): Run(
        system=machine({**QUICK, **(changes or {})}), faults=tuple(faults)
    )


@pytest.fixture(scope="module")
def record(run):
    def simulated(*given):
        (found,) = simulate_together([run(*given)])
        return found

    return simulated


@pytest.fixture(scope="module")
def steady(record):
    return record()


def turned(one_run, n_samples):
    """The exact integral of the set speed at every sample, rad."""
    return one_run.system.operating.nominal(np.arange(n_samples) / RATE).angle


class TestSteady:
    @pytest.mark.parametrize("key", [SPEED, TORQUE])
    def test_a_constant_course_is_none(self, record, steady, key):
        found = record({key: [[0, 1], [1, 1]]})
        level = steady.acceleration.std(axis=1, keepdims=True)
        assert_allclose(
            found.acceleration / level, steady.acceleration / level, rtol=0, atol=1e-9
        )
        assert_allclose(found.shaft_angle, steady.shaft_angle, rtol=0, atol=1e-12)
        assert_allclose(found.mean_speed, steady.mean_speed, rtol=1e-12, atol=0)

    def test_a_factor_is_another_set_speed(self, record):
        """All but the drive's lead and the mesh damping, which are those of the set speed and torque anyway."""
        found, expected = (
            record({SPEED: [[0, 1.5], [1, 1.5]]}),
            record({"operating.speed_rpm": 2700}),
        )
        level = expected.acceleration.std(axis=1, keepdims=True)
        assert_allclose(
            found.acceleration / level, expected.acceleration / level, rtol=0, atol=1e-6
        )
        assert_allclose(found.mean_speed, expected.mean_speed, rtol=1e-9, atol=0)

    def test_the_shaft_turns_at_the_set_speed(self, steady):
        """To what the mesh shakes it."""
        assert_allclose(
            np.diff(steady.shaft_angle) * RATE, SET_SPEED, rtol=1e-2, atol=0
        )
        assert abs(steady.shaft_angle[0]) < 0.1 * SET_SPEED / RATE

    def test_mean_speed_is_that_of_the_shaft(self, record):
        """Over the samples' own time: the angle at the sample after the last, of a record twice as long."""
        short, long = (
            record({SPEED: RAMP}),
            record({SPEED: RAMP, "operating.duration_s": 0.06}),
        )
        n = len(short.shaft_angle)
        assert_allclose(long.shaft_angle[:n], short.shaft_angle, rtol=0, atol=1e-9)
        expected = (long.shaft_angle[n] - long.shaft_angle[0]) * RATE / n
        assert_allclose(short.mean_speed, expected, rtol=1e-9, atol=0)
        assert_allclose(
            short.mean_speed,
            np.diff(short.shaft_angle).mean() * RATE,
            rtol=1e-3,
            atol=0,
        )


class TestRamp:
    ACCELERATION = 1.5 * SET_SPEED

    @pytest.mark.parametrize("rotors", [{}, ROTORS], ids=["pair", "motor_and_load"])
    def test_the_shaft_follows_behind(self, run, record, rotors):
        """By the acceleration over the drive's circular frequency squared, besides what it deviates anyway.

        Without friction: teeth that carry the inertia too would rub more.
        """
        changes = {
            **rotors,
            "operating.duration_s": 0.06,
            "mesh.friction_coefficient": 0,
        }
        ramp, still = run({**changes, SPEED: RAMP}), record(changes)
        (found,) = simulate_together([ramp])
        assert np.isfinite(found.acceleration).all()
        n = len(found.shaft_angle)
        lag = (still.shaft_angle - SET_SPEED * np.arange(n) / RATE) - (
            found.shaft_angle - turned(ramp, n)
        )
        twist = (
            self.ACCELERATION
            * pair_dynamics(ramp).reduced_inertia
            / pair_dynamics(ramp).drive_stiffness
        )
        if rotors:  # the motor is what the drive holds; its coupling turns the pinion further back
            driven = pair_dynamics(ramp).reduced_inertia - ramp.system.motor.inertia
            twist += self.ACCELERATION * driven / ramp.system.motor.coupling_stiffness
        else:
            assert_allclose(
                twist,
                self.ACCELERATION / (2 * math.pi * DRIVE) ** 2,
                rtol=1e-12,
                atol=0,
            )
        assert_allclose(lag.mean(), twist, rtol=2e-3, atol=0)
        assert np.ptp(lag) < 0.05 * twist

    def test_accelerations_are_those_of_the_turning_shafts(self, record):
        """Rotations as an accelerometer on the shaft would see them, not as deviations from the nominal turn.

        To what the mesh shakes the wheel from the begin to the end of so short a record.
        """
        found, still = record({**ROTATIONS, SPEED: RAMP}), record(ROTATIONS)
        gained = found.acceleration[1].mean() - still.acceleration[1].mean()
        assert_allclose(gained, self.ACCELERATION * 23 / 84, rtol=5e-2, atol=0)

    @pytest.mark.parametrize("kink", [0.01, 0.0102, 0.0105, 0.0109])
    def test_a_kink_of_the_course_is_no_jump_of_the_shaft(self, run, kink):
        """Wherever it lies between the instants at which the course is tabled."""
        changed = run({SPEED: [[-0.4, 1], [kink, 1], [kink + 0.005, 1.3], [1, 1.3]]})
        (found,) = simulate_together([changed])
        off = found.shaft_angle - turned(changed, len(found.shaft_angle))
        most = 0.3 * SET_SPEED / RATE  # as if the shaft stayed behind altogether
        assert np.abs(np.diff(off)).max() < most
        assert np.abs(np.diff(off, 2)).max() < 0.03 * most


class TestTorque:
    STEP = 1 / (51200 * 5)

    def carried(self, dynamics, *begins):
        """Mean force on the pinion's bearing over four mesh periods from some instants on, as shares of the set one."""
        core, period = (
            CoreRun([dynamics], self.STEP, span=(0.0, 0.04)),
            1 / dynamics.mesh_frequency,
        )
        shares = []
        for begin in begins:
            core.advance(round(begin / self.STEP) - core.now)
            deflection = []
            while core.now < round((begin + 4 * period) / self.STEP):
                core.advance(1)
                deflection.append(core.whole[0, PINION_Y, 0])
            shares.append(
                np.mean(deflection)
                * dynamics.pinion.support.stiffness_y
                / dynamics.mesh_force
            )
        return shares

    @pytest.mark.parametrize("factor", [0.3, 1.0, 1.8])
    def test_the_teeth_carry_their_share(self, run, factor):
        """Before and after the torque has changed."""
        dynamics = pair_dynamics(run({TORQUE: [[-1, 1], [0.01, 1], [0.02, factor]]}))
        shares = self.carried(dynamics, 0.01 - 4 / dynamics.mesh_frequency, 0.03)
        assert_allclose(shares, [1.0, factor], rtol=2e-2, atol=0)

    @pytest.mark.parametrize("rotors", [{}, ROTORS], ids=["pair", "motor_and_load"])
    def test_and_begin_with_it(self, run, rotors):
        dynamics = pair_dynamics(run({**rotors, TORQUE: [[0, 0.3], [1, 0.3]]}))
        assert_allclose(
            self.carried(dynamics, 0.0, 0.02), [0.3, 0.3], rtol=2e-2, atol=0
        )

    def test_without_torque_nothing_touches(self, record):
        found = record({TORQUE: [[0, 0], [1, 0]]})
        assert_allclose(found.contact_loss_fraction, 1.0, rtol=0, atol=0)
        assert_allclose(found.acceleration, 0, rtol=0, atol=1e-9)
        assert_allclose(found.mean_speed, SET_SPEED, rtol=1e-12, atol=0)


def bits(record):
    return (
        record.acceleration.tobytes(),
        record.shaft_angle.tobytes(),
        record.mean_speed,
    )


class TestNeighbours:
    def test_steady_and_changing_keep_their_bits(self, run):
        runs = [run(), run({SPEED: RAMP}), run({}, MISSING), run({TORQUE: RAMP}), run({SPEED: RAMP, TORQUE: RAMP}),
                run({SPEED: [[0.0, 1.0], [0.01, 1.3]]}, MISSING)]  # fmt: skip
        found, expected = (
            simulate_together(runs),
            [simulate_together([one])[0] for one in runs],
        )
        assert [bits(one) for one in found] == [bits(one) for one in expected]
        assert len({bits(one) for one in found}) == len(runs)

    def test_beside_others_that_settle_longer(self, run):
        """The course of all is tabled from when the slowest begins."""
        changing = {
            SPEED: [[-0.1, 0.8], [0.01, 0.9], [0.03, 1.2]],
            TORQUE: [[0.0, 1.0], [0.02, 1.1]],
        }
        runs = [
            run({**changing, "operating.drive_frequency_hz": rate})
            for rate in (20, 5, 7.3)
        ]
        expected = [simulate_together([one])[0] for one in runs]
        for order in list(permutations(range(3)))[::2]:
            found = simulate_together([runs[k] for k in order])
            assert [bits(one) for one in found] == [bits(expected[k]) for k in order]


def test_rotors_move_and_stay_finite(run):
    """Eight degrees of freedom, on a ramp of speed and torque; every channel lives."""
    channels = (
        "pinion_y",
        "pinion_rotation",
        "wheel_rotation",
        "motor_rotation",
        "load_rotation",
    )
    one = run(
        {**ROTORS, SPEED: RAMP, TORQUE: RAMP, "sensing.channels": list(channels)},
        MISSING,
    )
    motions = integrate(
        [pair_dynamics(one)],
        one.system.solver,
        sampling_rate=RATE,
        duration=0.03,
        channels=channels,
    )
    assert motions.finite.all()
    assert np.isfinite(motions.acceleration).all()
    assert (motions.acceleration.std(axis=-1) > 1.0).all()
    assert motions.acceleration.shape == (1, 5, 1536)
    assert pair_dynamics(one).dofs.index("pinion_rotation") == PINION_ROTATION
