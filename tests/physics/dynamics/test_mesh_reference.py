"""The compiled equations against a readable numpy reference that tries every set of pairs in contact."""

from itertools import chain, combinations

import numpy as np
import pytest
from fault_cases import one
from lane_tools import advance, group_laws, law_of, laws, right_hand_side, trajectory
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from gensig.dynamics._layout import DAMPING, SHARED
from gensig.dynamics._vector import LANES
from gensig.dynamics.lanes import pack
from gensig.faults.broken import MissingTooth
from gensig.faults.crack import Crack

CRACK = Crack(
    gear="pinion", tooth=2, crack_depth=2e-3, crack_angle=0.8, crack_start="arc_mid"
)
FAULTS = {"healthy": (), "crack": (CRACK,), "missing": (MissingTooth(gear="wheel", tooth=1),),
          "both": (CRACK, MissingTooth(gear="pinion", tooth=4)),
          # gaps of both signs that vary along the path, one tooth without its tip
          "flanks": (one("pitch_error", tooth=2, pitch_error_um=-15), one("broken", tooth=4),
                     one("runout", gear="wheel", tooth=3, eccentricity_um=8),
                     one("wear", gear="wheel", tooth="all", wear_depth_um=4))}  # fmt: skip


def bent(at, position, values, slopes):
    """Values between nodes as the parabola has them that follows the growth of the slopes, (phase,)."""
    distance = position[1] - position[0]
    cell = np.clip(((at - position[0]) / distance).astype(int), 0, len(position) - 2)
    part = (at - position[cell]) / distance
    bend = 0.5 * distance * part * (1 - part) * (slopes[cell + 1] - slopes[cell])
    return values[cell] + part * (values[cell + 1] - values[cell]) - bend


def columns(side, kind, at, position):
    """Compliance, its slope, gap and its slope of one kind of tooth, (4, phase)."""
    return np.array([
        bent(at, position, side.compliance[kind], side.compliance_slope[kind]),
        np.interp(at, position, side.compliance_slope[kind]),
        bent(at, position, side.gap[kind], side.gap_slope[kind]),
        np.interp(at, position, side.gap_slope[kind]),
    ])  # fmt: skip


class Reference:
    """Six equations of a pair, written as the theory has them; one-sided law."""

    def __init__(self, dynamics, step):
        self.d, self.table, self.pair, self.options = (
            dynamics,
            dynamics.table,
            dynamics.table.pair,
            dynamics.table.options,
        )
        self.system = dynamics.system()
        self.damping = dynamics.numbers(step, dynamics.rest())[DAMPING]

    def pairs(self, roll):
        """Position, compliance, its slope, gap and its slope of every pair that exists, (pair,) each."""
        rows = []
        newest = int(np.floor(roll / self.pair.base_pitch)) + 1
        for index in range(newest, newest - 4, -1):
            position = roll - index * self.pair.base_pitch
            row, there = np.array([position, 0.0, 0.0, 0.0, 0.0]), True
            for side, start, error, tilt in (
                (
                    self.table.pinion,
                    self.d.start_tooth_pinion,
                    self.d.pinion_error,
                    self.d.pinion_tilt,
                ),
                (
                    self.table.wheel,
                    self.d.start_tooth_wheel,
                    self.d.wheel_error,
                    self.d.wheel_tilt,
                ),
            ):
                tooth = (index + start) % len(side.kind)
                kind = side.kind[tooth]
                there = there and bool(side.present[kind])
                row[1:] += columns(
                    side, kind, np.array([position]), self.table.position
                )[:, 0]
                row[3] += error[tooth] + tilt[tooth] * (
                    position - self.pair.pitch_point
                )
                row[4] += tilt[tooth]
            if there:
                rows.append(row)
        return np.array(rows).T

    def loads(self, compliance, gap, approach):
        """F >= 0 with C F = approach - gap where F > 0 and C F >= approach - gap elsewhere, C the full matrix."""
        n = len(gap)
        shared = self.table.shared_compliance
        flexibility = np.diag(compliance - shared) + shared
        tried = chain.from_iterable(
            combinations(range(n), size) for size in range(n + 1)
        )
        for chosen in map(list, tried):
            force = np.zeros(n)
            force[chosen] = np.linalg.solve(
                flexibility[np.ix_(chosen, chosen)], (approach - gap)[chosen]
            )
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
            (position - self.pair.pitch_point)
            / (0.5 * self.options.friction_transition * self.pair.base_pitch),
            -1,
            1,
        )
        sliding = self.options.friction_coefficient * load * x * (1.5 - 0.5 * x**2)
        arm = self.pair.start_curvature_radius + np.clip(
            position, 0, self.pair.path_of_contact
        )
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

    def coast(self, roll, approach, rate, roll_rate):
        """The same where the back flanks touch, and with the number of loaded pairs, which counts as negative.

        The mirror image of a sound pair that turns backwards: its contact runs from where the back flanks of a space
        half a pitch on stand, its teeth count down, missing ones stay missing; no errors, no friction.
        """
        pitch, position, n = (
            self.pair.base_pitch,
            self.table.position,
            np.arange(-40, 41),
        )
        where = 2 * self.pair.pitch_point + 0.5 * pitch - roll - n * pitch
        inside = (where >= position[0]) & (where < position[-1])
        where, n = where[inside], n[inside]
        sides = (
            (self.table.pinion, self.d.start_tooth_pinion),
            (self.table.wheel, self.d.start_tooth_wheel),
        )
        there = np.all(
            [
                side.present[side.kind[(start - n) % len(side.kind)]]
                for side, start in sides
            ],
            axis=0,
        )
        c, c_slope, gap, gap_slope = sum(
            columns(side, 0, where[there], position) for side, _ in sides
        )
        squeezed = -approach - self.pair.backlash
        elastic = self.loads(c, gap, squeezed)
        # backwards: both rates change sign, and so do the forces that answer
        pair_rate = -rate - gap_slope * -roll_rate
        load = np.maximum(0.0, elastic * (1 + self.damping * pair_rate))
        own, shared = c - self.table.shared_compliance, self.table.shared_compliance
        stored = (
            elastic @ (squeezed - gap)
            - 0.5 * own @ elastic**2
            - 0.5 * shared * elastic.sum() ** 2
        )
        along = -(load @ gap_slope + 0.5 * elastic**2 @ c_slope)
        return (
            -load.sum(),
            0.0,
            0.0,
            0.0,
            along,
            stored,
            (load - elastic) @ pair_rate,
            -float(np.sum(load > 0)),
        )

    def acceleration(self, time, q, v, mesh=None):
        """q'' at one instant; ``mesh`` may stand in for the reference's own mesh law."""
        r_p, r_w = self.pair.pinion.base_radius, self.pair.wheel.base_radius
        direction = np.array([0, -1, r_p, 0, 1, -r_w])
        roll = self.d.start_roll + r_p * (self.d.operating.speed * time + q[2])
        normal, friction, moment_p, moment_w, along, _, _ = (mesh or self.mesh)(
            roll, direction @ q, direction @ v, r_p * (self.d.operating.speed + v[2])
        )
        force = (
            self.system.force
            - self.system.stiffness @ q
            - self.system.damping @ v
            - normal * direction
        )
        force += np.array([friction, 0, moment_p + r_p * along, -friction, 0, moment_w])
        return force / self.system.mass


@pytest.fixture(scope="module", params=FAULTS)
def dynamics(request, xiamen, dynamics_of):
    rng = np.random.default_rng(5)
    errors = {"pinion_error": rng.normal(0, 2e-6, 23), "wheel_error": rng.normal(0, 2e-6, 84),
              "pinion_tilt": rng.normal(0, 3e-4, 23), "wheel_tilt": rng.normal(0, 3e-4, 84)}  # fmt: skip
    return dynamics_of(xiamen, FAULTS[request.param], **errors)


def random_states(dynamics, n, seed):
    """Roll, approach, its rate and the roll's rate, (n, 4)."""
    rng = np.random.default_rng(seed)
    pitch, speed = (
        dynamics.table.pair.base_pitch,
        dynamics.operating.speed * dynamics.table.pair.pinion.base_radius,
    )
    return np.column_stack(
        [
            rng.uniform(0, 8, n) * pitch,
            rng.uniform(-2e-6, 40e-6, n),
            rng.normal(0, 2e-2, n),
            rng.normal(speed, 0.01 * speed, n),
        ]
    )


def test_mesh_law_agrees_for_random_states(dynamics):
    reference, states = Reference(dynamics, 1e-6), random_states(dynamics, 300, seed=7)
    found, expected = (
        laws(dynamics, states)[:, :7],
        np.array([reference.mesh(*state) for state in states]),
    )
    scale = np.array([1, 1, 0.1, 0.1, 1, 1e-5, 1e-2]) * np.maximum(1.0, expected[:, :1])
    assert_allclose(found / scale, expected / scale, rtol=1e-9, atol=1e-9)
    assert (expected[:, 0] > 0).sum() > 200


def test_back_flanks_agree_for_random_states(dynamics):
    reference, states, rng = (
        Reference(dynamics, 1e-6),
        random_states(dynamics, 300, seed=17),
        np.random.default_rng(1),
    )
    states[:, 1] = -dynamics.table.pair.backlash - rng.uniform(0, 40e-6, 300)
    found, expected = (
        laws(dynamics, states),
        np.array([reference.coast(*state) for state in states]),
    )
    scale = np.array([1, 1, 0.1, 0.1, 1, 1e-5, 1e-2, 1]) * np.maximum(
        1.0, -expected[:, :1]
    )
    assert_allclose(found / scale, expected / scale, rtol=1e-9, atol=1e-9)
    assert (expected[:, 7] == -2).sum() > 50


def test_between_the_flanks_there_is_nothing(dynamics):
    """From half the backlash, where no tooth stands as proud, to the back flanks."""
    states, rng = random_states(dynamics, 100, seed=18), np.random.default_rng(2)
    states[:, 1] = -dynamics.table.pair.backlash * rng.uniform(0.5, 1.0, 100)
    assert_allclose(laws(dynamics, states), 0.0, rtol=0, atol=0)


@pytest.mark.parametrize("roll_torque", ["consistent", "classical"])
def test_only_the_consistent_law_has_a_force_along_the_roll(
    machine, dynamics_of, roll_torque
):
    dynamics = dynamics_of(machine({"mesh.roll_torque": roll_torque}), (CRACK,))
    states = random_states(dynamics, 40, seed=19)
    states[1::2, 1] = -dynamics.table.pair.backlash - states[1::2, 1]
    along = laws(dynamics, states)[:, 4]
    assert np.any(along != 0) == (roll_torque == "consistent")


def test_a_motion_against_the_back_flanks(machine, dynamics_of):
    """Two teeth missing under a light load: the pinion runs ahead into the back flanks."""
    light = machine({"operating.torque_nm": 2})
    dynamics = dynamics_of(
        light,
        (MissingTooth(gear="pinion", tooth=3), MissingTooth(gear="pinion", tooth=4)),
    )
    step, direction = 1 / (51200 * 8), dynamics.approach_direction()
    q, v = trajectory(dynamics, dynamics.static_start(0.0), np.zeros(6), step, 8000)
    reference, backlash, n_seen = Reference(dynamics, step), light.pair.backlash, 0
    for n in np.flatnonzero(q @ direction < -backlash):
        expected = reference.acceleration(
            n * step, q[n], v[n], lambda *state: reference.coast(*state)[:7]
        )
        found = right_hand_side(dynamics, n * step, q[n], v[n])
        assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        n_seen += 1
    assert n_seen > 10


def test_another_shared_compliance_would_show(dynamics):
    group, states = pack([dynamics], 1e-6), random_states(dynamics, 50, 7)
    numbers = group.numbers.copy()
    numbers[SHARED * LANES : (SHARED + 1) * LANES] *= 1.001
    one, two = (
        group_laws(g, states)[:, 0] for g in (group, group._replace(numbers=numbers))
    )
    assert np.abs(one / np.maximum(two, 1e-9) - 1)[one > 100].max() > 1e-6


def test_right_hand_side_agrees(dynamics):
    reference, rng = Reference(dynamics, 1e-6), np.random.default_rng(11)
    for time in rng.integers(0, 40_000, 40) * 1e-7:
        q = dynamics.static_start(time) + rng.normal(0, 1e-6, 6) * [1, 1, 20, 1, 1, 20]
        v = rng.normal(0, 1e-2, 6) * [1, 1, 20, 1, 1, 20]
        expected = reference.acceleration(time, q, v)
        found = right_hand_side(dynamics, time, q, v)
        # the slope in the middle of so brief a step is what its two ends differ by
        assert_allclose(found, expected, rtol=1e-9, atol=1e-6 * np.abs(expected).max())


def test_one_millisecond_against_dop853(xiamen, dynamics_of):
    """Another method, over an entry and an exit of a pair; the mesh law is the compiled one, 100 times faster."""
    dynamics, oversampling, duration = dynamics_of(xiamen), 64, 1e-3
    step = 1 / (51200 * oversampling)
    n_steps = round(duration / (64 * step)) * 64
    reference = Reference(dynamics, step)
    start = dynamics.static_start(0.0) + 1e-6 * np.array([1, 1, 0, -1, 1, 0])
    _, _, stored = advance(
        dynamics, start, np.zeros(6), step, 0, n_steps, tuple(range(6))
    )
    law = law_of(dynamics, step)
    edges = np.arange(0, n_steps + 1, 64) * step

    def acceleration(t, y):
        return reference.acceleration(t, y[:6], y[6:], lambda *state: law(*state)[:7])

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


def runge_kutta(reference, law, time, q, v, step, n_parts):
    """The classical formula in ``n_parts``, on the compiled mesh law."""

    def slope(t, y):
        return np.concatenate(
            [
                y[6:],
                reference.acceleration(t, y[:6], y[6:], lambda *state: law(*state)[:7]),
            ]
        )

    y, h = np.concatenate([q, v]), step / n_parts
    for part in range(n_parts):
        t = time + part * h
        k1 = slope(t, y)
        k2 = slope(t + 0.5 * h, y + 0.5 * h * k1)
        k3 = slope(t + 0.5 * h, y + 0.5 * h * k2)
        k4 = slope(t + h, y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y


@pytest.mark.parametrize("oversampling", [5, 16])
def test_a_step_with_an_entry_or_exit_is_taken_in_parts(
    machine, dynamics_of, oversampling
):
    """Every step of two mesh periods is one of Runge and Kutta's, or two that meet where a pair comes or goes.

    With linear contact: the load-dependent term has no limit as the load of a pair falls to 0, and where tables have
    that cusp their cubic in the middle of a step is worth less.
    """
    xiamen = machine({"mesh.contact": "linear"})
    dynamics, step = dynamics_of(xiamen), 1 / (51200 * oversampling)
    reference, law, direction = (
        Reference(dynamics, step),
        law_of(dynamics, step),
        dynamics.approach_direction(),
    )
    n_steps = round(2 / dynamics.mesh_frequency / step)
    q, v = trajectory(dynamics, dynamics.static_start(0.0), np.zeros(6), step, n_steps)
    states = np.hstack([q, v])
    radius, speed = xiamen.pair.pinion.base_radius, xiamen.operating.speed
    rolls = dynamics.start_roll + radius * (
        speed * np.arange(n_steps + 1) * step + q[:, 2]
    )
    motions = np.column_stack(
        [rolls, q @ direction, v @ direction, radius * (speed + v[:, 2])]
    )
    loaded = laws(dynamics, motions, step)[:, 7]
    events = np.flatnonzero(np.diff(loaded))
    assert 3 <= len(events) <= 6
    plain = np.setdiff1d(
        np.arange(0, n_steps, 3), np.concatenate([events - 1, events, events + 1])
    )
    scale = np.abs(np.diff(states, axis=0)).max(axis=0)

    def off(places, n_parts):
        expected = [
            runge_kutta(reference, law, n * step, q[n], v[n], step, n_parts)
            for n in places
        ]
        return np.abs((states[places + 1] - expected) / scale).max(axis=1)

    assert np.all(off(events, 64) < 0.15 * off(events, 1))
    assert off(events, 64).max() < 3e-4
    # between events the tables are read once a step; what is left is that of the kinks at both ends of the path
    assert off(plain, 1).max() < 3e-4
