"""Newmark's average acceleration for a geared line without meshes against exact solutions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from line_tools import (
    bodies,
    chain,
    constant_torques,
    line_of,
    order_of,
    state_after,
    steps,
    with_system,
)
from scipy.linalg import eigh, expm

from gensig.driveline.time.newmark import integrate_line
from gensig.dynamics.decimation import decimator
from gensig.dynamics.motion.course import LineCourse, ShaftTorque, constant_speed

SPEED = 100.0  # rad/s


class TestLinear:
    """A free chain of six inertias, exact by the matrix exponential."""

    DURATION = 0.05

    @pytest.fixture(scope="class", params=["shafts", "modal"])
    @classmethod
    def line(cls, request):
        """Damped by its shafts, or by a share of every mode, which is a full matrix."""
        line = chain(6)
        if request.param == "shafts":
            return line
        mass = np.diag(line.system.mass)
        rates, shapes = eigh(line.system.stiffness, mass)
        momentum = mass @ shapes
        damping = (momentum * 0.02 * np.sqrt(np.abs(rates))) @ momentum.T
        return with_system(line, damping=0.5 * (damping + damping.T))

    @pytest.fixture(scope="class")
    @classmethod
    def start(cls):
        rng = np.random.default_rng(1)
        return rng.normal(0, 1e-3, 6), rng.normal(0, 1.0, 6)

    @pytest.fixture(scope="class")
    @classmethod
    def torques(cls):
        return np.array([3.0, 0.0, -1.0, 0.0, 2.0, -3.0])

    @pytest.fixture(scope="class")
    @classmethod
    def exact(cls, line, start, torques):
        """q and v at the end; the constant torques are one more state."""
        n = 6
        inverse = np.diag(1.0 / line.system.mass)
        system = np.zeros((2 * n + 1, 2 * n + 1))
        system[:n, n : 2 * n] = np.eye(n)
        system[n : 2 * n, :n] = -inverse @ line.system.stiffness
        system[n : 2 * n, n : 2 * n] = -inverse @ line.system.damping
        system[n : 2 * n, -1] = inverse @ torques
        return (expm(system * cls.DURATION) @ np.concatenate([*start, [1.0]]))[: 2 * n]

    @pytest.fixture(scope="class")
    @classmethod
    def error(cls, line, start, torques, exact):
        def measured(n_steps):
            loaded = replace(line, torques=constant_torques(torques))
            q, v, _ = state_after(loaded, start, cls.DURATION, n_steps)
            return np.linalg.norm(np.concatenate([q, v]) - exact) / np.linalg.norm(
                exact
            )

        return measured

    def test_it_is_the_exact_solution(self, error):
        assert error(40000) < 2e-6

    def test_order_two(self, error):
        assert_close(
            order_of([error(n) for n in (2000, 4000, 8000)]),
            2.0,
            atol=0.02,
        )

    @pytest.mark.parametrize(
        ("is_damped", "n_steps"),
        [(False, 50), (False, 5000), (True, 5000)],
    )
    def test_energy_is_kept_without_damping_whatever_the_step(
        self, line, start, is_damped, n_steps
    ):
        if not is_damped:
            line = chain(6, loss=0.0)
        q, v, motion = state_after(line, start, self.DURATION, n_steps)
        first, last = (
            0.5 * (line.system.mass @ speed**2 + angle @ line.system.stiffness @ angle)
            for angle, speed in (start, (q, v))
        )

        assert motion.energy_residual < 1e-11

        if is_damped:
            assert last < 0.9 * first
        else:
            assert_close(last, first, 1e-11)


class TestTorquesAndCourse:
    def test_a_torque_over_the_angle_excites_its_order(self):
        """One inertia on a spring, a torque of order 2: the exact steady amplitude."""
        inertia, spring, damper, amplitude = (
            0.1,
            4e4,
            4.0,
            0.05,
        )  # so small that its own twist does not shift it
        table = amplitude * np.cos(np.arange(4096) / 4096 * 2 * np.pi)
        system = bodies(
            np.array([inertia]),
            np.array([[spring]]),
            np.array([[damper]]),
            np.ones(1),
        )
        motion = integrate_line(
            line_of(
                system,
                nominal=constant_speed(SPEED),
                torques=(ShaftTorque(dof=0, table=table, period=np.pi),),
            ),
            steps(4000.0, 10),
            duration=2 * np.pi / SPEED * 10,
            lead_in=1.0,
            channels=[
                ("angle", 0),
                ("speed", 0),
                ("acceleration", 0),
            ],
        )
        rate = 2 * SPEED
        response = amplitude / (spring - inertia * rate**2 + 1j * damper * rate)
        angle = motion.nominal_angle
        for power, name in enumerate(("angle", "speed", "acceleration")):
            expected = ((1j * rate) ** power * response * np.exp(2j * angle)).real
            computed = motion.signals[name, 0]
            assert_close(
                computed,
                expected,
                atol=5e-4 * np.abs(expected).max(),
            )

    @pytest.mark.parametrize("sense", [1.0, -1.0])
    def test_an_unbalance_turns_with_its_shaft(self, sense):
        """A disc on springs along x and y under a force that turns with it: the exact orbit."""
        mass, spring, damper, force = 2.0, 8e5, 60.0, 3.0
        held = np.diag([0.0, spring, 0.5 * spring])
        system = bodies(
            np.array([0.1, mass, mass]),
            held,
            np.diag([0.0, damper, damper]),
            np.array([sense, 0.0, 0.0]),
        )
        angle = np.arange(4096) / 4096 * 2 * np.pi
        waves = {1: np.cos(angle), 2: sense * np.sin(angle)}
        line = line_of(
            system,
            nominal=constant_speed(SPEED),
            torques=[
                ShaftTorque(dof=dof, table=force * wave, turned_by=0)
                for dof, wave in waves.items()
            ],
        )
        motion = integrate_line(
            line,
            steps(4000.0, 10),
            duration=2 * np.pi / SPEED * 4,
            lead_in=1.0,
            channels=[("angle", 1), ("angle", 2)],
        )
        dynamic = np.diag(held)[1:] - mass * SPEED**2 + 1j * damper * SPEED
        turned = np.exp(1j * motion.nominal_angle)
        for dof, (stiff, turning) in enumerate(
            zip(dynamic, (1.0, -1j * sense), strict=True), start=1
        ):
            expected = np.real(force * turning / stiff * turned)
            found = motion.signals["angle", dof]
            assert_close(found, expected, atol=5e-4 * np.abs(expected).max())

    def test_the_twist_shifts_the_torque(self):
        """A table over the angle sees the angle itself, not the nominal one: a restoring slope is
        a spring.
        """
        slope = 200.0
        inertia = 0.1
        nothing = np.zeros((1, 1))
        system = bodies(np.array([inertia]), nothing, nothing, np.ones(1))
        nodes = np.arange(4000) / 4000 * 2 * np.pi
        table = -slope * np.where(nodes < np.pi, nodes, nodes - 2 * np.pi)
        start = np.array([1e-2])
        quarter = 0.5 * np.pi * math.sqrt(inertia / slope)
        line = line_of(system, torques=(ShaftTorque(dof=0, table=table),))
        q, v, _ = state_after(line, (start, np.zeros(1)), quarter, 4000)

        assert_close(q / start, 0.0, atol=1e-5)
        assert_close(v / start, -math.sqrt(slope / inertia), 1e-5)

    @pytest.mark.parametrize("given", [0.0, 1.0])
    def test_a_run_up_needs_the_torque_of_the_inertias_and_no_more(self, given):
        """Without that torque the line stays behind at rest."""
        line = chain(5)
        course = LineCourse(
            time=np.array([0.0, 0.2]),
            speed=np.array([50.0, 90.0]),
        )
        torques = constant_torques(given * line.system.mass * 200.0)
        rest = np.zeros(5), np.zeros(5)
        speeding = replace(line, torques=torques, nominal=course)
        q, v, _ = state_after(speeding, rest, 0.1, 2000)
        behind = (given - 1.0) * 200.0

        assert_close(v, behind * 0.1, 1e-9, atol=1e-12)
        assert_close(q, 0.5 * behind * 0.1**2, 1e-9, atol=1e-15)

    def test_a_factor_over_the_knots_is_a_torque_over_time(self):
        line = chain(1)
        course = LineCourse(
            time=np.array([0.0, 0.1]),
            speed=np.array([50.0, 50.0]),
        )
        ramp = ShaftTorque(
            dof=0,
            table=np.ones(1),
            factor=np.array([0.0, 3.0]),
        )
        pushed = replace(line, torques=(ramp,), nominal=course)
        _, v, _ = state_after(pushed, (np.zeros(1), np.zeros(1)), 0.1, 500)

        assert_close(v, 0.5 * 3.0 * 0.1 / line.system.mass[0], 1e-9)

    def test_signals_are_low_passed_states(self):
        """A sample is the state of the line at its time."""
        line = chain(4)
        start = (np.array([1e-3, 0, 0, -1e-3]), np.zeros(4))
        motion = integrate_line(
            replace(line, nominal=constant_speed(SPEED)),
            steps(8000.0, 8),
            duration=0.02,
            channels=[("angle", 0), ("speed", 3)],
            start=start,
        )
        margin = decimator(
            8
        ).margin  # samples before time 0, and one, at which integration begins
        for sample in (0, 30, 60):
            n_steps = 8 * (sample + margin + 1)
            q, v, _ = state_after(line, start, n_steps / 64000.0, n_steps)
            assert_close(
                motion.signals["angle", 0][sample],
                q[0],
                atol=1e-5 * np.abs(start[0]).max(),
            )
            assert_close(
                motion.signals["speed", 3][sample],
                v[3],
                atol=1e-4 * np.abs(v).max(),
            )
