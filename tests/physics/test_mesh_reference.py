"""The compiled equations against a readable numpy reference that tries every set of pairs in contact."""

from itertools import chain, combinations

import numpy as np
import pytest
from fault_cases import one
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from gensig.dynamics import _kernels
from gensig.faults.broken import MissingTooth
from gensig.faults.crack import Crack

CRACK = Crack(gear="pinion", tooth=2, crack_depth=2e-3, crack_angle=0.8, crack_start="arc_mid")
FAULTS = {"healthy": (), "crack": (CRACK,), "missing": (MissingTooth(gear="wheel", tooth=1),),
          "both": (CRACK, MissingTooth(gear="pinion", tooth=4)),
          # gaps of both signs that vary along the path, one tooth without its tip
          "flanks": (one("pitch_error", tooth=2, pitch_error_um=-15), one("broken", tooth=4),
                     one("runout", gear="wheel", tooth=3, eccentricity_um=8),
                     one("wear", gear="wheel", tooth="all", wear_depth_um=4))}  # fmt: skip


class Reference:
    """Six equations of a pair, written as the theory has them; one-sided law, drive flank."""

    def __init__(self, dynamics, step):
        self.d, self.table, self.pair, self.options = (
            dynamics,
            dynamics.table,
            dynamics.table.pair,
            dynamics.table.options,
        )
        self.system = dynamics.system()
        self.damping = dynamics.arrays(step).numbers.damping

    def pairs(self, roll):
        """Position, compliance, its slope, gap and its slope of every pair that exists, (pair,) each."""
        rows = []
        newest = int(np.floor(roll / self.pair.base_pitch)) + 1
        for index in range(newest, newest - 4, -1):
            position = roll - index * self.pair.base_pitch
            row, there = np.array([position, 0.0, 0.0, 0.0, 0.0]), True
            for side, start, error in (
                (self.table.pinion, self.d.start_tooth_pinion, self.d.pinion_error),
                (self.table.wheel, self.d.start_tooth_wheel, self.d.wheel_error),
            ):
                tooth = (index + start) % len(side.kind)
                kind = side.kind[tooth]
                there = there and bool(side.present[kind])
                for column, values in enumerate((side.compliance, side.compliance_slope, side.gap, side.gap_slope), 1):
                    row[column] += np.interp(position, self.table.position, values[kind])
                row[3] += error[tooth]
            if there:
                rows.append(row)
        return np.array(rows).T

    def loads(self, compliance, gap, approach):
        """F >= 0 with C F = approach - gap where F > 0 and C F >= approach - gap elsewhere, C the full matrix."""
        n = len(gap)
        shared = self.table.shared_compliance
        flexibility = np.diag(compliance - shared) + shared
        tried = chain.from_iterable(combinations(range(n), size) for size in range(n + 1))
        for chosen in map(list, tried):
            force = np.zeros(n)
            force[chosen] = np.linalg.solve(flexibility[np.ix_(chosen, chosen)], (approach - gap)[chosen])
            slack = flexibility @ force - (approach - gap)
            if np.all(force[chosen] > 0) and np.all(slack >= -1e-15):
                return force
        raise AssertionError("no set of pairs fits")

    def mesh(self, roll, approach, rate, roll_rate):
        """Normal force, friction, moments on pinion and wheel, force along the roll, stored energy, lost power."""
        position, c, c_slope, gap, gap_slope = self.pairs(roll)
        elastic = self.loads(c, gap, approach)
        pair_rate = rate - gap_slope * roll_rate
        load = np.maximum(0.0, elastic * (1 + self.damping * pair_rate))
        x = np.clip(
            (position - self.pair.pitch_point) / (0.5 * self.options.friction_transition * self.pair.base_pitch), -1, 1
        )
        sliding = self.options.friction_coefficient * load * x * (1.5 - 0.5 * x**2)
        arm = self.pair.start_curvature_radius + np.clip(position, 0, self.pair.path_of_contact)
        own = c - self.table.shared_compliance
        stored = (
            elastic @ (approach - gap)
            - 0.5 * own @ elastic**2
            - 0.5 * self.table.shared_compliance * elastic.sum() ** 2
        )
        return (
            load.sum(),
            sliding.sum(),
            -(sliding @ arm),
            sliding @ (self.pair.tangent_length - arm),
            load @ gap_slope + 0.5 * elastic**2 @ c_slope,
            stored,
            (load - elastic) @ pair_rate,
        )

    def acceleration(self, time, q, v, mesh=None):
        """q'' at one instant; ``mesh`` may stand in for the reference's own mesh law."""
        r_p, r_w = self.pair.pinion.base_radius, self.pair.wheel.base_radius
        direction = np.array([0, -1, r_p, 0, 1, -r_w])
        roll = self.d.start_roll + r_p * (self.d.operating.speed * time + q[2])
        normal, friction, moment_p, moment_w, along, _, _ = (mesh or self.mesh)(
            roll, direction @ q, direction @ v, r_p * (self.d.operating.speed + v[2])
        )
        force = self.system.force - self.system.stiffness @ q - self.system.damping @ v - normal * direction
        force += np.array([friction, 0, moment_p + r_p * along, -friction, 0, moment_w])
        return force / self.system.mass


@pytest.fixture(scope="module", params=FAULTS)
def dynamics(request, xiamen, dynamics_of):
    rng = np.random.default_rng(5)
    errors = {"pinion_error": rng.normal(0, 2e-6, 23), "wheel_error": rng.normal(0, 2e-6, 84)}
    return dynamics_of(xiamen, FAULTS[request.param], **errors)


def random_states(dynamics, n, seed):
    rng = np.random.default_rng(seed)
    pitch, speed = dynamics.table.pair.base_pitch, dynamics.operating.speed * dynamics.table.pair.pinion.base_radius
    return zip(
        rng.uniform(0, 8, n) * pitch,
        rng.uniform(-2e-6, 40e-6, n),
        rng.normal(0, 2e-2, n),
        rng.normal(speed, 0.01 * speed, n),
        strict=True,
    )


def test_mesh_law_agrees_for_random_states(dynamics):
    reference, mesh, work = Reference(dynamics, 1e-6), dynamics.arrays(1e-6), _kernels.work_arrays(6)[1]
    n_loaded = 0
    for state in random_states(dynamics, 300, seed=7):
        found, expected = np.array(_kernels.mesh_law(*mesh, *state, work)), np.array(reference.mesh(*state))
        scale = np.array([1, 1, 0.1, 0.1, 1, 1e-5, 1e-2]) * max(1.0, expected[0])
        assert_allclose(found / scale, expected / scale, rtol=1e-9, atol=1e-9)
        n_loaded += expected[0] > 0
    assert n_loaded > 200


def test_another_shared_compliance_would_show(dynamics):
    mesh, work = dynamics.arrays(1e-6), _kernels.work_arrays(6)[1]
    other = mesh._replace(numbers=mesh.numbers._replace(shared=1.001 * mesh.numbers.shared))
    loads = [
        [_kernels.mesh_law(*m, *state, work)[0] for m in (mesh, other)] for state in random_states(dynamics, 50, 7)
    ]
    one, two = np.array(loads).T
    assert np.abs(one / np.maximum(two, 1e-9) - 1)[one > 100].max() > 1e-6


def test_right_hand_side_agrees(dynamics):
    step, rng = 1e-7, np.random.default_rng(11)
    reference, system, mesh = Reference(dynamics, step), dynamics.system().arrays(), dynamics.arrays(step)
    for first in rng.integers(0, 40_000, 40):
        q = dynamics.static_start(first * step) + rng.normal(0, 1e-6, 6) * [1, 1, 20, 1, 1, 20]
        v = rng.normal(0, 1e-2, 6) * [1, 1, 20, 1, 1, 20]
        found, work = np.empty(6), _kernels.work_arrays(6)[1]
        _kernels.acceleration(*system, *mesh, first * step, q, v, found, work)
        expected = reference.acceleration(first * step, q, v)
        assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_one_millisecond_against_dop853(xiamen, dynamics_of):
    """Another method, over an entry and an exit of a pair; the mesh law is the compiled one, 100 times faster."""
    dynamics, oversampling, duration = dynamics_of(xiamen), 64, 1e-3
    step = 1 / (51200 * oversampling)
    n_steps = round(duration / (64 * step)) * 64
    reference = Reference(dynamics, step)
    start = dynamics.static_start(0.0) + 1e-6 * np.array([1, 1, 0, -1, 1, 0])
    stored = np.empty((6, n_steps))
    q, v, mesh, work = start.copy(), np.zeros(6), dynamics.arrays(step), _kernels.work_arrays(6)[1]
    _kernels.integrate(
        dynamics.system().arrays(), mesh, q, v, step, 0, n_steps, np.arange(6), stored, np.empty((5, 6)), work
    )
    edges = np.arange(0, n_steps + 1, 64) * step

    def acceleration(t, y):
        return reference.acceleration(t, y[:6], y[6:], lambda *state: _kernels.mesh_law(*mesh, *state, work))

    solution = solve_ivp(
        lambda t, y: np.concatenate([y[6:], acceleration(t, y)]),
        (0, n_steps * step),
        np.concatenate([start, np.zeros(6)]),
        method="DOP853",
        rtol=1e-10,
        atol=1e-14,
        t_eval=edges,
        max_step=2e-5,
    )
    # what is stored are means over steps, so means over 64 of them are differences of velocity
    expected = np.diff(solution.y[6:], axis=1).T / (64 * step)
    found = stored.reshape(6, -1, 64).mean(axis=2).T
    scale = np.sqrt(np.mean(expected**2, axis=0))
    assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-4)
