"""Power in = stored + dissipated, along trajectories of the compiled integrator sampled at every internal step."""

from typing import NamedTuple

import numpy as np
import pytest
from fault_cases import one
from lane_tools import advance, laws, right_hand_side, trajectory
from numpy.testing import assert_allclose

from gensig.faults.broken import MissingTooth

SAMPLING_RATE = 51200.0
OVERSAMPLING = 32
DURATION = 0.008
# the missing tooth would enter at roll 2, about 2.5 ms from the start: its whole passage lies in the record
FAULTS = {"healthy": (), "missing_pinion": (MissingTooth(gear="pinion", tooth=2),),
          "missing_wheel": (MissingTooth(gear="wheel", tooth=2),),
          "flanks": (one("chipped", tooth=2, chip_width_mm=15), one("pitch_error", gear="wheel", tooth=2))}  # fmt: skip


class Balance(NamedTuple):
    energy: np.ndarray  # J, kinetic with true speeds, springs, mesh
    supplied: np.ndarray  # W, drive and load
    supports: np.ndarray  # W lost
    mesh_damping: np.ndarray  # W lost
    friction: np.ndarray  # W, negative when lost
    stored: np.ndarray  # J, mesh only
    step: float

    @property
    def residual(self):
        """Change of energy less work, J."""
        power = self.supplied - self.supports - self.mesh_damping + self.friction
        work = np.concatenate(
            [[0.0], np.cumsum(0.5 * (power[1:] + power[:-1])) * self.step]
        )
        return self.energy - self.energy[0] - work


def balance(dynamics, oversampling=OVERSAMPLING):
    """From static equilibrium."""
    step = 1 / (SAMPLING_RATE * oversampling)
    q, v = trajectory(
        dynamics, dynamics.static_start(0.0), np.zeros(6), step, round(DURATION / step)
    )
    system, direction, time = (
        dynamics.system(),
        dynamics.approach_direction(),
        np.arange(len(q)) * step,
    )
    radius, speed = dynamics.table.pair.pinion.base_radius, dynamics.operating.speed
    roll, roll_rate = (
        dynamics.start_roll + radius * (speed * time + q[:, 2]),
        radius * (speed + v[:, 2]),
    )
    law = laws(
        dynamics, np.column_stack([roll, q @ direction, v @ direction, roll_rate]), step
    )
    _, friction, moment_p, moment_w, _, stored, lost, _ = law.T
    speeds = v + np.array([0, 0, speed, 0, 0, speed / dynamics.table.pair.ratio])
    k, c = np.diag(system.stiffness), np.diag(system.damping)
    springs = [0, 1, 3, 4]
    drive = system.force[2] - k[2] * q[:, 2] - c[2] * v[:, 2]
    return Balance(
        energy=0.5 * (speeds**2 @ system.mass + q[:, springs] ** 2 @ k[springs])
        + stored,
        supplied=drive * speeds[:, 2] + system.force[5] * speeds[:, 5],
        supports=v[:, springs] ** 2 @ c[springs],
        mesh_damping=lost,
        friction=friction * (v[:, 0] - v[:, 3])
        + moment_p * speeds[:, 2]
        + moment_w * speeds[:, 5],
        stored=stored,
        step=step,
    )


@pytest.mark.parametrize("name", FAULTS)
def test_the_states_seen_are_those_of_a_run_in_one_go(machine, dynamics_of, name):
    """The balance is that of what is recorded: the tables are read anew at every call."""
    dynamics, step, n_steps = (
        dynamics_of(machine(), FAULTS[name]),
        1 / (SAMPLING_RATE * OVERSAMPLING),
        4000,
    )
    start = dynamics.static_start(0.0), np.zeros(6)
    seen, whole = (
        trajectory(dynamics, *start, step, n_steps),
        advance(dynamics, *start, step, 0, n_steps),
    )
    for one_by_one, at_once in zip(seen, whole[:2], strict=True):
        scale = np.abs(one_by_one).max(axis=0)
        # one read the tables at the roll of a step's begin, the other where that was foreseen
        assert_allclose(at_once / scale, one_by_one[-1] / scale, rtol=0, atol=1e-7)


@pytest.fixture(scope="module", params=FAULTS)
def case(request, machine, dynamics_of):
    return {
        law: balance(
            dynamics_of(machine({"mesh.roll_torque": law}), FAULTS[request.param])
        )
        for law in ("consistent", "classical")
    }


def relative_residual(found):
    """Largest imbalance over the largest energy stored in the mesh."""
    return np.abs(found.residual).max() / found.stored.max()


def test_power_in_is_stored_and_dissipated(case):
    assert relative_residual(case["consistent"]) < 2e-4


def test_the_classical_equations_do_not_balance(case):
    assert relative_residual(case["classical"]) > 0.1


def test_coarse_tables_balance_too(machine, dynamics_of):
    """Force and energy of a table belong together, however far its nodes are apart."""
    assert (
        relative_residual(balance(dynamics_of(machine({"mesh.points_per_pitch": 128}))))
        < 2e-4
    )


def test_the_balance_sees_a_missing_term(case):
    found = case["consistent"]
    assert (
        relative_residual(
            found._replace(mesh_damping=np.zeros_like(found.mesh_damping))
        )
        > 0.02
    )


def test_mesh_damping_never_feeds_energy(case):
    for found in case.values():
        assert found.mesh_damping.min() >= 0
        assert found.mesh_damping.max() > 0


def test_friction_dissipates(case):
    """Its sign follows the position; only the bearings' own motion across can turn it, near the pitch point."""
    for found in case.values():
        assert found.friction.mean() < -10
        assert found.friction.max() < 0.05 * -found.friction.mean()


@pytest.mark.parametrize("seed", [1, 2])
def test_friction_of_rigid_gears_dissipates_at_every_position(
    xiamen, dynamics_of, seed
):
    speed, ratio, rng = (
        xiamen.operating.speed,
        xiamen.pair.ratio,
        np.random.default_rng(seed),
    )
    roll, rate = (
        rng.uniform(0, 50, 500) * xiamen.pair.base_pitch,
        xiamen.pair.pinion.base_radius * speed,
    )
    motions = np.column_stack(
        [roll, rng.uniform(0, 20e-6, 500), rng.normal(0, 1e-3, 500), np.full(500, rate)]
    )
    normal, _, moment_p, moment_w, _, _, lost, _ = laws(dynamics_of(xiamen), motions).T
    assert np.all(moment_p * speed + moment_w * speed / ratio <= 1e-9)
    assert np.all(lost >= 0)
    assert np.all(normal >= 0)


def test_action_equals_reaction(xiamen, dynamics_of):
    """The mesh puts opposite forces on the two gears, and friction on x as its normal force on y."""
    dynamics = dynamics_of(xiamen)
    system, direction = dynamics.system(), dynamics.approach_direction()
    rng = np.random.default_rng(3)
    for _ in range(50):
        q = rng.normal(0, 1e-6, 6)
        q[5] -= (
            rng.uniform(1e-6, 2e-5) - q @ direction
        ) / xiamen.pair.wheel.base_radius
        v = rng.normal(0, 1e-3, 6)
        acceleration = right_hand_side(dynamics, 0.0, q, v)
        force = (
            system.mass * acceleration
            - system.force
            + system.stiffness @ q
            + system.damping @ v
        )
        assert force[1] > 0
        assert_allclose(force[1], -force[4], rtol=1e-9, atol=1e-6)
        assert_allclose(force[0], -force[3], rtol=1e-9, atol=1e-6)
        assert abs(force[0]) <= 0.05 * force[1] * (1 + 1e-9)
        # the mesh force drives the wheel and brakes the pinion, up to friction and the roll torque
        assert_allclose(
            force[5], force[1] * xiamen.pair.wheel.base_radius, rtol=0.03, atol=0
        )
        assert_allclose(
            force[2], -force[1] * xiamen.pair.pinion.base_radius, rtol=0.1, atol=0
        )


def test_a_larger_approach_meets_a_larger_force_back(xiamen, dynamics_of):
    """Restoring: each gear is pushed so that the approach falls."""
    dynamics = dynamics_of(xiamen)
    approach = np.append(np.linspace(-20e-6, 20e-6, 41), -xiamen.pair.backlash - 5e-6)
    for roll in np.linspace(0.01, 0.99, 9) * xiamen.pair.base_pitch:
        *found, coast = laws(dynamics, [(roll, a, 0.0, 4.0) for a in approach])[:, 0]
        assert np.all(np.diff(found) >= 0)
        assert found[0] == pytest.approx(0.0, abs=0.0)
        assert coast < -100
