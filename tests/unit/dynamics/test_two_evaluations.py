"""The two-evaluation core: records, refusals, law of three pairs and steps."""

import itertools

import numpy as np
import pytest
from closeness import assert_close
from core_runs import MISSING, QUICK, assert_independent
from numba import njit
from refusals import refused

from gensig.dynamics._vector import LANES, get_row, set_row, spread
from gensig.dynamics.backends.nystroem._law import shared_load
from gensig.dynamics.backends.nystroem.stability import (
    amplification,
    stability_limit,
)
from gensig.dynamics.integrator import check_machine
from gensig.errors import SimulationError
from gensig.systems.run import Run, Start

SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
BACKEND = {"solver.backend": "nystroem"}


class TestRecords:
    @pytest.fixture(scope="class")
    @classmethod
    def run(cls, machine):
        brief = {**QUICK, **BACKEND, "operating.duration_s": 0.02}

        def make(changes=None, faults=(), **values):
            system = machine({**brief, **(changes or {})})
            return Run(system=system, faults=tuple(faults), **values)

        return make

    @pytest.mark.parametrize("precision", ["float64", "float32"])
    def test_records_are_those_alone(self, run, precision):
        changes = {"solver.precision": precision}
        runs = [
            run(changes),
            run({**changes, TORQUE: 1, "gear.backlash_um": 3}),
            run({**changes, SPEED: 5000}, MISSING, start=Start(phase=0.7)),
            run({**changes, TORQUE: 60, "solver.max_error": 1e-3}),
        ]
        assert_independent(runs, [(0, 1, 2, 3), (3, 1, 0), (2, 2, 1)])

    def test_records_of_drawn_courses_are_those_alone(self, run):
        ramp = {"operating.speed_profile": [[-0.4, 0.4], [0.4, 1.6]]}
        runs = [run(ramp), run({**ramp, TORQUE: 5}), run({**ramp, SPEED: 3000})]
        assert_independent(runs, [(0, 1, 2), (2, 0)])


class TestRefusals:
    def test_too_long_steps(self, machine, dynamics_of):
        stiff = {"mesh.damping_ratio": 1.0, "gear.pinion.mass_kg": 0.006}
        system = machine({**BACKEND, **stiff})
        with refused("raise solver", SimulationError):
            check_machine(dynamics_of(system), system.solver, 51200.0)

    def test_the_method_of_drive_lines(self, machine, dynamics_of):
        system = machine({"solver.backend": "newmark"})
        told = "take solver.backend=nystroem"
        with refused(told, SimulationError):
            check_machine(dynamics_of(system), system.solver, 51200.0)


class TestStability:
    @pytest.mark.parametrize("ratio", [1 / 32, 1 / 16, 7 / 64, 0.5])
    def test_steps_below_the_limit_are_stable(self, ratio):
        limit = stability_limit(ratio)

        def growth(step):
            return np.abs(np.linalg.eigvals(amplification(step, ratio))).max()

        assert max(growth(share * limit) for share in (0.1, 0.5, 0.99)) < 1.0
        assert growth(limit + 0.05) > 1.0

    def test_more_damping_takes_shorter_steps(self):
        limits = [stability_limit(ratio / 64) for ratio in (1, 4, 16, 64)]
        assert limits == sorted(limits, reverse=True)
        assert 2.0 < stability_limit(1 / 32) < 2.1

    def test_amplification_is_a_step_of_the_exact_motion(self):
        """Exact values before and in the step end near the exact ones; error of order 5."""
        errors = []
        for step in (0.2, 0.1):
            rate = complex(-0.05, np.sqrt(1.0 - 0.05**2))
            motion = np.exp(rate * step * np.array([0.0, -0.5, -1.0]))
            a = (rate * step) ** 2 * motion
            before = np.array([1.0, rate * step, a[0], a[1], a[2]])
            after = amplification(step, 0.05) @ before
            end = np.exp(rate * step) * np.array([1.0, rate * step])
            errors.append(np.abs(after[:2] - end).max())
        assert 4.5 < np.log2(errors[0] / errors[1]) < 5.5


@njit(error_model="numpy")
def loads(rows, result):
    """Load and stiffnesses of pairs; rows are three compliances, three bites, the shared one."""
    zero = spread(rows, 0.0)
    load, springs = shared_load(
        get_row(rows, 0),
        get_row(rows, 1),
        get_row(rows, 2),
        get_row(rows, 3),
        get_row(rows, 4),
        get_row(rows, 5),
        get_row(rows, 6),
        zero,
    )
    set_row(result, 0, load)
    set_row(result, 1, springs[0])
    set_row(result, 2, springs[1])
    set_row(result, 3, springs[2])


def equilibrium(compliances, bites, shared):
    """Load of the set of pairs that all carry and beside which no other would."""
    for n in (3, 2, 1):
        for chosen in itertools.combinations(range(3), n):
            stiffness = sum(1.0 / compliances[k] for k in chosen)
            force = sum(bites[k] / compliances[k] for k in chosen)
            load = force / (1.0 + shared * stiffness)
            inside = [bites[k] > shared * load for k in chosen]
            outside = [bites[k] > shared * load for k in range(3) if k not in chosen]
            if all(inside) and not any(outside):
                return load
    return 0.0


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_the_load_is_that_of_the_pairs_in_contact(precision):
    rng = np.random.default_rng(4)
    n = LANES if precision == "float64" else 2 * LANES
    for _ in range(40):
        compliances = rng.uniform(0.5, 5.0, (3, n))
        bites = rng.uniform(-2e-6, 4e-6, (3, n))
        bites[0, : n // 2] = -1.0  # no tooth
        shared = rng.uniform(0.0, 3.0, n)
        rows = np.vstack([compliances, bites, shared]).astype(precision)
        result = np.empty((4, n), dtype=precision)
        loads(rows.ravel(), result.ravel())
        expected = [
            equilibrium(compliances[:, k], bites[:, k], shared[k]) for k in range(n)
        ]
        accuracy = 1e-13 if precision == "float64" else 3e-6
        assert_close(result[0], np.array(expected), accuracy, atol=4e-6 * accuracy)
        assert_close(result[1:], 1.0 / compliances, accuracy)
