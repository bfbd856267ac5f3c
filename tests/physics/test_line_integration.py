"""Newmark's average acceleration for a geared line against exact solutions, scipy and the pair's own integrator."""

import math
from dataclasses import replace

import numpy as np
import pytest
from lane_tools import advance
from line_tools import (
    INERTIAS,
    RADII,
    STIFFNESS,
    chain,
    constant_torques,
    state_after,
    two_gears,
)
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm

from benchmarks._engine_line import engine_line, engine_torques
from gensig.dynamics.decimation import decimator
from gensig.dynamics.geared_line import GearedLine
from gensig.dynamics.line_course import LineCourse, ShaftTorque, constant_speed
from gensig.dynamics.line_mesh import pair_mesh
from gensig.dynamics.newmark import LineSolver, integrate_line, static_start
from gensig.faults.broken import MissingTooth

SPEED = 100.0  # rad/s


def steps(sampling_rate: float, oversampling: int) -> LineSolver:
    return LineSolver(sampling_rate=sampling_rate, oversampling=oversampling, max_energy_residual=1e-3)


def order_of(errors: list[float], ratio: float = 2.0) -> float:
    """Measured order over all the halvings."""
    return math.log(errors[0] / errors[-1], ratio) / (len(errors) - 1)


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
        rates, shapes = eigh(line.stiffness, line.mass)
        momentum = line.mass @ shapes
        damping = (momentum * 0.02 * np.sqrt(np.abs(rates))) @ momentum.T
        return replace(line, damping=0.5 * (damping + damping.T))

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
        n, inverse = 6, np.linalg.inv(line.mass)
        system = np.zeros((2 * n + 1, 2 * n + 1))
        system[:n, n : 2 * n] = np.eye(n)
        system[n : 2 * n, :n], system[n : 2 * n, n : 2 * n] = -inverse @ line.stiffness, -inverse @ line.damping
        system[n : 2 * n, -1] = inverse @ torques
        return (expm(system * cls.DURATION) @ np.concatenate([*start, [1.0]]))[: 2 * n]

    @pytest.fixture(scope="class")
    @classmethod
    def error(cls, line, start, torques, exact):
        def measured(n_steps):
            q, v, _ = state_after(line, start, cls.DURATION, n_steps, torques=constant_torques(torques))
            return np.linalg.norm(np.concatenate([q, v]) - exact) / np.linalg.norm(exact)

        return measured

    def test_it_is_the_exact_solution(self, error):
        assert error(40000) < 2e-6

    def test_order_two(self, error):
        assert order_of([error(n) for n in (2000, 4000, 8000)]) == pytest.approx(2.0, abs=0.02)

    def test_undamped_vibration_keeps_its_energy_whatever_the_step(self, start):
        line = chain(6, loss=0.0)
        for n_steps in (50, 5000):
            q, v, told = state_after(line, start, self.DURATION, n_steps)
            energy = [0.5 * (b @ line.mass @ b + a @ line.stiffness @ a) for a, b in (start, (q, v))]
            assert_allclose(energy[1], energy[0], rtol=1e-11, atol=0)
            assert told.energy_residual < 1e-11

    def test_damping_takes_energy(self, line, start):
        q, v, told = state_after(line, start, self.DURATION, 5000)
        energy = [0.5 * (b @ line.mass @ b + a @ line.stiffness @ a) for a, b in (start, (q, v))]
        assert energy[1] < 0.9 * energy[0]
        assert told.energy_residual < 1e-11

    def test_a_full_mass_matrix_is_taken(self, line, start):
        """The same chain in other coordinates."""
        turn = np.eye(6) + 0.3 * np.eye(6, k=1)
        parts = {name: turn.T @ getattr(line, name) @ turn for name in ("mass", "damping", "stiffness")}
        other = GearedLine(names=line.names, rotation=np.linalg.solve(turn, line.rotation), meshes=(), **parts)
        moved = tuple(np.linalg.solve(turn, part) for part in start)
        q, v, _ = state_after(line, start, self.DURATION, 3000)
        q_1, v_1, _ = state_after(other, moved, self.DURATION, 3000)
        assert_allclose(turn @ q_1, q, rtol=0, atol=1e-9 * np.abs(q).max())
        assert_allclose(turn @ v_1, v, rtol=0, atol=1e-9 * np.abs(v).max())


class TestTorquesAndCourse:
    def test_a_torque_over_the_angle_excites_its_order(self):
        """One inertia on a spring, a torque of order 2: the exact steady amplitude."""
        inertia, spring, damper, amplitude = 0.1, 4e4, 4.0, 0.05  # so small that its own twist does not shift it
        line = GearedLine(
            names=("disc",), mass=np.array([[inertia]]), damping=np.array([[damper]]), stiffness=np.array([[spring]]),
            rotation=np.ones(1), meshes=(),
        )  # fmt: skip
        table = amplitude * np.cos(np.arange(4096) / 4096 * 2 * np.pi)
        motion = integrate_line(
            line, constant_speed(SPEED), [ShaftTorque(dof=0, table=table, period=np.pi)],
            steps(4000.0, 10), duration=2 * np.pi / SPEED * 10, lead_in=1.0,
            channels=[("angle", 0), ("speed", 0), ("acceleration", 0)],
        )  # fmt: skip
        rate = 2 * SPEED
        response = amplitude / (spring - inertia * rate**2 + 1j * damper * rate)
        angle = motion.nominal_angle
        for power, name in enumerate(("angle", "speed", "acceleration")):
            expected = ((1j * rate) ** power * response * np.exp(2j * angle)).real
            found = motion.signals[name, 0]
            assert_allclose(found, expected, rtol=0, atol=5e-4 * np.abs(expected).max())

    def test_the_twist_shifts_the_torque(self):
        """A table over the angle sees the angle itself, not the nominal one: a restoring slope is a spring."""
        slope, inertia = 200.0, 0.1
        line = GearedLine(
            names=("disc",), mass=np.array([[inertia]]), damping=np.zeros((1, 1)), stiffness=np.zeros((1, 1)),
            rotation=np.ones(1), meshes=(),
        )  # fmt: skip
        nodes = np.arange(4000) / 4000 * 2 * np.pi
        table = -slope * np.where(nodes < np.pi, nodes, nodes - 2 * np.pi)
        start, quarter = np.array([1e-2]), 0.5 * np.pi * math.sqrt(inertia / slope)
        q, v, _ = state_after(line, (start, np.zeros(1)), quarter, 4000, torques=[ShaftTorque(dof=0, table=table)])
        assert_allclose(q / start, 0.0, rtol=0, atol=1e-5)
        assert_allclose(v / start, -math.sqrt(slope / inertia), rtol=1e-5, atol=0)

    def test_a_run_up_needs_the_torque_of_the_inertias_and_no_more(self):
        line, course = chain(5), LineCourse(time=np.array([0.0, 0.2]), speed=np.array([50.0, 90.0]))
        torques = np.diag(line.mass) * 200.0
        q, v, _ = state_after(
            line, (np.zeros(5), np.zeros(5)), 0.1, 2000, torques=constant_torques(torques), course=course
        )
        assert_allclose(q, 0.0, rtol=0, atol=1e-15)
        assert_allclose(v, 0.0, rtol=0, atol=1e-12)

    def test_without_that_torque_it_stays_behind_at_rest(self):
        line, course = chain(5), LineCourse(time=np.array([0.0, 0.2]), speed=np.array([50.0, 90.0]))
        q, v, _ = state_after(line, (np.zeros(5), np.zeros(5)), 0.1, 2000, course=course)
        assert_allclose(v, -200.0 * 0.1, rtol=1e-9, atol=0)
        assert_allclose(q, -0.5 * 200.0 * 0.1**2, rtol=1e-9, atol=0)

    def test_a_factor_over_the_knots_is_a_torque_over_time(self):
        line, course = chain(1), LineCourse(time=np.array([0.0, 0.1]), speed=np.array([50.0, 50.0]))
        ramp = ShaftTorque(dof=0, table=np.ones(1), factor=np.array([0.0, 3.0]))
        _, v, _ = state_after(line, (np.zeros(1), np.zeros(1)), 0.1, 500, torques=[ramp], course=course)
        assert_allclose(v, 0.5 * 3.0 * 0.1 / line.mass[0, 0], rtol=1e-9, atol=0)

    def test_signals_are_low_passed_states(self):
        """What a run gives out at time 0 is the state that it passes there."""
        line, start = chain(4), (np.array([1e-3, 0, 0, -1e-3]), np.zeros(4))
        motion = integrate_line(
            line, constant_speed(SPEED), [], steps(8000.0, 8), duration=0.02,
            channels=[("angle", 0), ("speed", 3)], start=start,
        )  # fmt: skip
        margin = decimator(8).margin  # samples before time 0, and one, at which integration begins
        for sample in (0, 30, 60):
            n_steps = 8 * (sample + margin + 1)
            q, v, _ = state_after(line, start, n_steps / 64000.0, n_steps)
            assert_allclose(motion.signals["angle", 0][sample], q[0], rtol=0, atol=1e-5 * np.abs(start[0]).max())
            assert_allclose(motion.signals["speed", 3][sample], v[3], rtol=0, atol=1e-4 * np.abs(v).max())


class TestRippledMesh:
    """A mesh whose stiffness ripples smoothly under load; the teeth stay together."""

    @pytest.fixture(scope="class")
    @classmethod
    def run(cls):
        u = np.arange(512) / 512
        stiffness = STIFFNESS * (1 + 0.2 * np.cos(2 * np.pi * u) + 0.05 * np.cos(4 * np.pi * u))[None]
        line = two_gears(stiffness=stiffness, gap=3e-6 * np.sin(2 * np.pi * u)[None], damping=2e-4, backlash=1e-4)
        torques = constant_torques([200.0, -400.0])
        course = constant_speed(400.0)
        start = static_start(line, course, torques), np.zeros(2)
        return lambda n_steps: state_after(line, start, 0.02, n_steps, torques=torques, course=course)

    def test_order_two(self, run):
        exact = run(128000)
        errors = [np.abs(run(n)[1] - exact[1]).max() for n in (1000, 2000, 4000, 8000)]
        assert order_of(errors) == pytest.approx(2.0, abs=0.1)
        assert exact[2].contact_loss[0] < 1e-12

    def test_energy(self, run):
        assert run(2000)[2].energy_residual < 1e-3
        assert run(16000)[2].energy_residual < 1e-5

    def test_the_ripple_is_felt(self, run):
        told = run(4000)[2]
        assert told.largest_force[0] > 1.1 * 200.0 / RADII[0]
        assert told.least_force[0] < 0.9 * 200.0 / RADII[0]


class TestBacklash:
    """Two inertias that fly to and fro between their flanks, against DOP853."""

    BACKLASH, DURATION = 1e-4, 0.02
    START = np.array([0.0, 0.0]), np.array([4.0, -1.0])

    @pytest.fixture(scope="class", params=[0.0, 0.02], ids=["elastic", "damped"])
    @classmethod
    def damping(cls, request):
        return request.param

    @pytest.fixture(scope="class")
    @classmethod
    def exact(cls, damping):
        direction = np.array([RADII[0], -RADII[1]])

        def slope(_, y):
            approach, rate = direction @ y[:2], direction @ y[2:]
            force = 0.0
            if approach > 0:
                force = max(0.0, STIFFNESS * approach * (1 + damping * rate))
            elif approach < -cls.BACKLASH:
                force = -max(0.0, STIFFNESS * (-approach - cls.BACKLASH) * (1 - damping * rate))
            return np.concatenate([y[2:], -direction * force / INERTIAS])

        solution = solve_ivp(
            slope, (0, cls.DURATION), np.concatenate(cls.START), method="DOP853", rtol=1e-11, atol=1e-15,
            max_step=5e-6,
        )  # fmt: skip
        return solution.y[:, -1]

    @pytest.fixture(scope="class")
    @classmethod
    def run(cls, damping):
        line = two_gears(damping=damping, backlash=cls.BACKLASH)
        return lambda n_steps: state_after(line, cls.START, cls.DURATION, n_steps)

    @pytest.fixture(scope="class")
    @classmethod
    def error(cls, run, exact):
        def measured(n_steps):
            q, v, _ = run(n_steps)
            direction = np.array([RADII[0], -RADII[1]])
            return max(
                np.abs(direction @ (q - exact[:2])) / cls.BACKLASH,
                np.abs(v - exact[2:]).max() / np.abs(cls.START[1]).max(),
            )

        return measured

    def test_it_is_the_exact_solution(self, error):
        assert error(80000) < 1e-3

    def test_both_flanks_are_hit(self, run):
        _, _, told = run(8000)
        assert told.contact_loss[0] > 0.2
        assert told.back_contact[0] > 0.05
        assert told.largest_force[0] > 1e3
        assert told.least_force[0] < -1e3

    def test_error_falls_with_the_square_of_the_step(self, error):
        """On average: what a landing costs depends on where in a step it falls."""
        assert order_of([error(n) for n in (5000, 80000)], ratio=16.0) > 1.6

    def test_energy(self, run):
        assert run(8000)[2].energy_residual < 1e-3

    def test_energy_residual_falls_with_the_step(self, run):
        assert run(64000)[2].energy_residual < 0.1 * run(4000)[2].energy_residual


class TestAgainstThePair:
    """The default spur pair on its supports without friction, with tooth errors, through both integrators."""

    STEPS, N_SAMPLES = 64, 410

    @pytest.fixture(scope="class", params=["sound", "missing tooth"])
    @classmethod
    def dynamics(cls, request, machine, dynamics_of):
        rng = np.random.default_rng(1)
        faults = (MissingTooth(gear="pinion", tooth=2),) if request.param == "missing tooth" else ()
        pair = machine({"mesh.friction_coefficient": 0.0, "mesh.points_per_pitch": 2048})
        errors = {"pinion_error": rng.normal(0, 3e-6, 23), "wheel_error": rng.normal(0, 3e-6, 84)}
        return dynamics_of(pair, faults, **errors)

    @pytest.fixture(scope="class")
    @classmethod
    def line(cls, dynamics):
        system = dynamics.system()
        mesh = pair_mesh(
            "pair", dynamics.table, direction=dynamics.approach_direction(), roll_dof=2,
            damping=dynamics.mesh_damping / dynamics.mesh_force, start_phase=dynamics.start_phase,
            errors=(dynamics.pinion_error, dynamics.wheel_error),
        )  # fmt: skip
        return GearedLine(
            names=system.names, mass=np.diag(system.mass), damping=system.damping, stiffness=system.stiffness,
            rotation=system.rotation, meshes=(mesh,),
        )  # fmt: skip

    def test_the_same_motion(self, dynamics, line):
        start, n_steps = (dynamics.static_start(0.0), np.zeros(6)), self.STEPS * self.N_SAMPLES
        step = 1 / (51200 * self.STEPS)
        q, v, _ = advance(dynamics, *start, step, 0, n_steps)
        q_1, v_1, told = state_after(
            line, start, n_steps * step, n_steps, torques=constant_torques(dynamics.system().force),
            course=constant_speed(dynamics.operating.speed),
        )  # fmt: skip
        direction = dynamics.approach_direction()
        scale = np.abs(v).max()
        assert_allclose(v_1, v, rtol=0, atol=2e-4 * scale)
        assert_allclose(q_1 @ direction, q @ direction, rtol=0, atol=2e-8)
        assert told.energy_residual < 1e-4

    def test_the_same_rest(self, dynamics, line):
        found = static_start(
            line, constant_speed(dynamics.operating.speed), constant_torques(dynamics.system().force), time=0.0
        )
        expected = dynamics.static_start(0.0)
        assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


class TestLowRank:
    """Meshes as low-rank updates against their stiffness in the matrix, which is then factored with it."""

    @pytest.fixture(scope="class")
    @classmethod
    def engine(cls):
        return engine_line(linear=True)

    @pytest.fixture(scope="class")
    @classmethod
    def welded(cls, engine):
        stiffness = engine.stiffness + sum(
            mesh.stiffness[0, 0] * np.outer(mesh.direction, mesh.direction) for mesh in engine.meshes
        )
        return GearedLine(
            names=engine.names, mass=engine.mass, damping=engine.damping, stiffness=stiffness,
            rotation=engine.rotation, meshes=(),
        )  # fmt: skip

    def test_the_printed_frequencies(self, welded):
        n = 65  # rotations
        found = np.sqrt(np.abs(eigh(welded.stiffness[:n, :n], welded.mass[:n, :n], eigvals_only=True))) / (2 * np.pi)
        assert_allclose(found[1:5], [28.31, 68.72, 162.06, 215.97], rtol=0, atol=0.01)

    def test_the_same_motion(self, engine, welded):
        """A gear train without backlash is linear."""
        rng = np.random.default_rng(2)
        start = rng.normal(0, 1e-4, len(engine.names)), rng.normal(0, 0.1, len(engine.names))
        n_steps, duration = 4000, 0.04
        (q, v, told), (q_1, v_1, _) = (state_after(line, start, duration, n_steps) for line in (engine, welded))
        assert_allclose(q, q_1, rtol=0, atol=1e-8 * np.abs(q_1).max())
        assert_allclose(v, v_1, rtol=0, atol=1e-8 * np.abs(v_1).max())
        assert told.energy_residual < 1e-6


class TestEngine:
    """The whole engine, 109 degrees of freedom, teeth that come apart."""

    @pytest.fixture(scope="class")
    @classmethod
    def motion(cls):
        def run(duration=0.15, oversampling=10):
            return integrate_line(
                engine_line(), constant_speed(1688 * np.pi / 30), engine_torques(),
                steps(10240.0, oversampling), duration=duration,
                channels=[("speed", 13), ("speed", 42), ("mesh_force", 5)],
            )  # fmt: skip

        return run

    @pytest.fixture(scope="class")
    @classmethod
    def usual(cls, motion):
        return motion()

    def test_energy_with_contact_loss(self, usual):
        assert usual.contact_loss.max() > 0.1
        assert usual.back_contact.max() > 0.01
        assert usual.energy_residual < 1e-3

    def test_contact_takes_few_rounds(self, usual):
        assert usual.newton_rounds < 3

    def test_a_longer_run_begins_with_the_same_bits(self, motion, usual):
        longer = motion(duration=0.2)
        for channel, signal in usual.signals.items():
            assert np.array_equal(longer.signals[channel][: len(signal)], signal)
