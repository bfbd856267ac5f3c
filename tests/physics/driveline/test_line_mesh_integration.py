"""Meshes of a geared line by Newmark's method: order, energy, backlash, against scipy and the
pair's integrator.
"""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from lane_tools import advance
from line_tools import (
    INERTIAS,
    RADII,
    STIFFNESS,
    constant_torques,
    order_of,
    state_after,
    steps,
    two_gears,
)
from scipy.integrate import solve_ivp

from benchmarks._engine_line import engine_line, engine_torques
from gensig.driveline.time.newmark import integrate_line
from gensig.dynamics.motion.course import constant_speed
from gensig.faults.broken import MissingTooth


class TestRippledMesh:
    """A mesh whose stiffness ripples smoothly under load; the teeth stay together."""

    @pytest.fixture(scope="class")
    @classmethod
    def run(cls):
        u = np.arange(512) / 512
        stiffness = (
            STIFFNESS
            * (1 + 0.2 * np.cos(2 * np.pi * u) + 0.05 * np.cos(4 * np.pi * u))[None]
        )
        line = two_gears(
            stiffness=stiffness,
            gap=3e-6 * np.sin(2 * np.pi * u)[None],
            damping=2e-4,
            backlash=1e-4,
            torques=constant_torques([200.0, -400.0]),
            nominal=constant_speed(400.0),
        )
        start = line.start(0.0)
        return lambda n_steps: state_after(line, start, 0.02, n_steps)

    def test_order_two(self, run):
        exact = run(128000)
        errors = [np.abs(run(n)[1] - exact[1]).max() for n in (1000, 2000, 4000, 8000)]
        assert_close(order_of(errors), 2.0, atol=0.1)
        assert exact[2].contact_loss[0] < 1e-12

    def test_energy(self, run):
        assert run(2000)[2].energy_residual < 1e-3
        assert run(16000)[2].energy_residual < 1e-5


class TestBacklash:
    """Two inertias that fly to and fro between their flanks, against DOP853."""

    BACKLASH = 1e-4
    DURATION = 0.02
    START = np.array([0.0, 0.0]), np.array([4.0, -1.0])

    @pytest.fixture(
        scope="class",
        params=[0.0, 0.02],
        ids=["elastic", "damped"],
    )
    @classmethod
    def damping(cls, request):
        return request.param

    @pytest.fixture(scope="class")
    @classmethod
    def exact(cls, damping):
        direction = np.array([RADII[0], -RADII[1]])

        def slope(_, y):
            approach = direction @ y[:2]
            rate = direction @ y[2:]
            force = 0.0
            if approach > 0:
                force = max(
                    0.0,
                    STIFFNESS * approach * (1 + damping * rate),
                )
            elif approach < -cls.BACKLASH:
                behind = STIFFNESS * (-approach - cls.BACKLASH)
                force = -max(0.0, behind * (1 - damping * rate))
            return np.concatenate([y[2:], -direction * force / INERTIAS])

        start = np.concatenate(cls.START)
        options = {
            "method": "DOP853",
            "rtol": 1e-11,
            "atol": 1e-15,
            "max_step": 5e-6,
        }
        return solve_ivp(slope, (0, cls.DURATION), start, **options).y[:, -1]

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

    def test_error_falls_with_the_square_of_the_step(self, error):
        """On average: what a landing costs depends on where in a step it falls."""
        assert order_of([error(n) for n in (5000, 80000)], ratio=16.0) > 1.6

    def test_energy(self, run):
        """Both flanks are hit."""
        coarse, usual, fine = (run(n_steps)[2] for n_steps in (4000, 8000, 64000))
        assert usual.contact_loss[0] > 0.2
        assert usual.back_contact[0] > 0.05
        assert usual.energy_residual < 1e-3
        assert fine.energy_residual < 0.1 * coarse.energy_residual


class TestAgainstThePair:
    """The default spur pair on its supports, with errors and tilts of its teeth, through both
    integrators.
    """

    STEPS = 128
    N_SAMPLES = 410

    @pytest.fixture(
        scope="class",
        params=[(), (MissingTooth(gear="pinion", tooth=2),)],
    )
    @classmethod
    def running(cls, request, machine, running_of):
        rng = np.random.default_rng(1)
        faults = request.param
        pair = machine({"mesh.points_per_pitch": 2048})
        errors = {
            "pinion_error": rng.normal(0, 3e-6, 23),
            "wheel_error": rng.normal(0, 3e-6, 84),
            "pinion_tilt": rng.normal(0, 3e-4, 23),
            "wheel_tilt": rng.normal(0, 3e-4, 84),
        }
        return running_of(pair, faults, **errors)

    def test_the_same_motion(self, running):
        start = running.dynamics.start(0.0)
        n_steps = self.STEPS * self.N_SAMPLES
        step = 1 / (51200 * self.STEPS)
        q, v, _ = advance(running, *start, step, 0, n_steps)
        q_1, v_1, motion = state_after(running.dynamics, start, n_steps * step, n_steps)
        direction = running.approach_direction()
        scale = np.abs(v).max()

        assert_close(v_1, v, atol=1e-4 * scale)
        assert_close(q_1 @ direction, q @ direction, atol=2e-8)
        assert motion.energy_residual < 1e-4


class TestLowRank:
    """Meshes as low-rank updates against their stiffness in the matrix, which is then factored
    with it.
    """

    @pytest.fixture(scope="class")
    @classmethod
    def engine(cls):
        return engine_line(linear=True)

    @pytest.fixture(scope="class")
    @classmethod
    def welded(cls, engine):
        stiffness = engine.system.stiffness.copy()
        for mesh in engine.system.meshes:
            along = mesh.push(len(stiffness))
            held = 1.0 / mesh.teeth.table.pairs.compliance[0, 0, 0, 0]
            stiffness += held * np.outer(along, along)
        system = replace(engine.system, stiffness=stiffness, meshes=())
        return replace(engine, system=system, reference_force=np.empty(0))

    def test_the_same_motion(self, engine, welded):
        """A gear train without backlash is linear."""
        rng = np.random.default_rng(2)
        start = (
            rng.normal(0, 1e-4, len(engine.dofs)),
            rng.normal(0, 0.1, len(engine.dofs)),
        )
        n_steps = 4000
        duration = 0.04
        (q, v, motion), (q_1, v_1, _) = (
            state_after(line, start, duration, n_steps) for line in (engine, welded)
        )

        assert_close(
            q,
            q_1,
            atol=1e-8 * np.abs(q_1).max(),
        )
        assert_close(
            v,
            v_1,
            atol=1e-8 * np.abs(v_1).max(),
        )
        assert motion.energy_residual < 1e-6


class TestEngine:
    """The whole engine, 109 degrees of freedom, teeth that come apart."""

    @pytest.fixture(scope="class")
    @classmethod
    def motion(cls):
        def run(duration=0.15, oversampling=10):
            return integrate_line(
                engine_line(torques=engine_torques(), speed=1688 * np.pi / 30),
                steps(10240.0, oversampling),
                duration=duration,
                channels=[
                    ("speed", 13),
                    ("speed", 42),
                    ("mesh_force", 5),
                ],
            )

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
