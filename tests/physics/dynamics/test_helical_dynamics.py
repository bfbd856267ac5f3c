"""Helical gears in motion: the spur pair's law in chords, forces along the axis and their moments, energy, statics."""

import math
from dataclasses import replace

import numpy as np
import pytest
from chord_tables import Slices, as_chords, with_table
from lane_tools import laws, right_hand_side, trajectory
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import gensig
from gensig.dynamics.helical import AXIAL_DOFS, half_lag
from gensig.dynamics.integrator import Solver, integrate
from gensig.dynamics.pair import PAIR_DOFS
from gensig.faults.broken import MissingTooth
from gensig.mesh.load_distribution import static_mesh
from gensig.mesh.sliced.sliced_statics import chord_equilibrium, chord_states

HELIX = math.radians(20.0)
DEPTH = np.array([0.0, 2.0, 5.0, 9.0, 14.0, 20.0]) * 1e-6
STEP = 1 / (51200.0 * 32)
QUIET = "sensing.snr_db=null", "operating.duration_s=0.2", "solver.max_error=null"
IN_PLANE = slice(0, len(PAIR_DOFS))
PLANAR = np.arange(len(PAIR_DOFS))


@pytest.fixture(scope="module")
def slices(xiamen):
    return Slices(xiamen, HELIX)


@pytest.fixture(scope="module")
def spur(xiamen, dynamics_of):
    return dynamics_of(xiamen)


@pytest.fixture(scope="module")
def helical(spur, slices):
    return with_table(spur, slices.table(DEPTH))


def moved(dynamics, n_steps, step=STEP):
    """States from static equilibrium on, q and v."""
    start = dynamics.static_start(0.0)
    return trajectory(dynamics, start, np.zeros(len(start)), step, n_steps)


class TestZeroHelix:
    """The same code with zero helix is the spur pair: to the last bit, if its chords are the spur pair's table."""

    @pytest.mark.parametrize("n_chords", [1, 3])
    @pytest.mark.parametrize("faults", [(), (MissingTooth(gear="pinion", tooth=1),)])
    def test_the_motion_in_the_plane_has_the_same_bits(
        self, xiamen, dynamics_of, n_chords, faults
    ):
        spur = dynamics_of(xiamen, faults)
        chords = with_table(spur, as_chords(spur.table, n_chords))
        assert chords.dofs == (*PAIR_DOFS, *AXIAL_DOFS)
        for one, other in zip(moved(spur, 300), moved(chords, 300), strict=True):
            assert one.tobytes() == np.ascontiguousarray(other[:, IN_PLANE]).tobytes()
            assert np.abs(other[:, len(PAIR_DOFS) :]).max() == 0.0

    def test_statics_are_the_spur_pairs(self, spur):
        table = as_chords(spur.table, 3)
        roll = table.pair.base_pitch * (np.arange(50) + 0.5) / 50
        states = spur._states(roll)
        for force in (100.0, 925.0):
            expected = static_mesh(spur.table, states, force)
            found = chord_equilibrium(table, chord_states(table, roll), force)
            for name in ("approach", "load", "stiffness"):
                exact = getattr(expected, name)
                assert_allclose(
                    getattr(found, name),
                    exact,
                    rtol=1e-9,
                    atol=1e-12 * np.abs(exact).max(),
                )

    def test_friction_and_mean_stiffness_are_the_spur_pairs(self, spur):
        chords = with_table(spur, as_chords(spur.table))
        assert_allclose(
            chords.friction_torque(), spur.friction_torque(), rtol=1e-9, atol=0
        )
        assert_allclose(
            chords.mean_mesh_stiffness, spur.mean_mesh_stiffness, rtol=1e-9, atol=0
        )


def gears(dynamics):
    """Contact at the pitch point, seen from the two gears' centres in x, y, z, and the push on the wheel, (3,) each."""
    pair = dynamics.table.pair
    across, hand = (
        math.tan(pair.working_pressure_angle),
        math.copysign(1.0, pair.pinion.helix_angle),
    )
    pinion, wheel = (np.array([r, -abs(r) * across * s, 0.0]) for r, s in (
        (pair.pinion.base_radius, 1.0), (-pair.wheel.base_radius, -1.0)))  # fmt: skip
    return pinion, wheel, np.array([0.0, -1.0, hand * math.tan(pair.base_helix_angle)])


def rigid(dynamics, shift, turn):
    """q (dof,) of both gears moved together: by ``shift`` m, and turned by ``turn`` rad about the pinion's centre."""
    at_pinion, at_wheel, _ = gears(dynamics)
    q = np.zeros(12)
    q[[0, 1, 6]] = shift
    q[[3, 4, 9]] = shift + np.cross(turn, at_pinion - at_wheel)
    q[[7, 8]] = q[[10, 11]] = turn[:2]
    q[2], q[5] = -turn[2], turn[2]  # the pinion turns about -z
    return q


@pytest.mark.parametrize("hand", [1.0, -1.0])
class TestForces:
    @pytest.fixture
    def one(self, spur, xiamen, hand):
        return with_table(spur, Slices(xiamen, hand * HELIX, n_slices=6).table(DEPTH))

    @pytest.mark.parametrize("axis", range(3))
    def test_gears_moved_together_come_no_closer(self, one, axis):
        direction, unit = one.approach_direction(), np.eye(3)[axis]
        size = np.abs(direction).max()
        assert_allclose(
            direction @ rigid(one, unit, np.zeros(3)), 0.0, rtol=0, atol=1e-14 * size
        )
        assert_allclose(
            direction @ rigid(one, np.zeros(3), unit), 0.0, rtol=0, atol=1e-14 * size
        )

    def test_the_approach_is_how_far_the_flanks_move_into_each_other(self, one):
        """Along the transverse line of action, from the displacement of the two bodies where they touch."""
        at_pinion, at_wheel, push = gears(one)
        rng = np.random.default_rng(4)
        for q in rng.normal(0, 1e-5, (20, 12)):
            pinion = q[[0, 1, 6]] + np.cross([q[7], q[8], -q[2]], at_pinion)
            wheel = q[[3, 4, 9]] + np.cross([q[10], q[11], q[5]], at_wheel)
            assert_allclose(
                one.approach_direction() @ q,
                push @ (pinion - wheel),
                rtol=1e-10,
                atol=1e-18,
            )

    def test_action_equals_reaction_and_moments_balance(self, one):
        """What the mesh does to both gears together is nothing, about any axis."""
        pair, system, start = one.table.pair, one.system(), one.static_start(0.0)
        still = replace(one, table=replace(one.table, options=replace(one.table.options, friction_coefficient=0.0,
                                                                      roll_torque="classical")))  # fmt: skip
        still_system = still.system()
        acceleration = right_hand_side(still, 0.0, start, np.zeros(12))
        force = (
            still_system.mass * acceleration
            - still_system.force
            + still_system.stiffness @ start
        )
        at_pinion, at_wheel, push = gears(one)
        normal = force[1]
        assert normal > 0.5 * one.mesh_force
        assert_allclose(force[[0, 1, 6]], -normal * push, rtol=1e-6, atol=1e-6 * normal)
        assert_allclose(force[[3, 4, 9]], normal * push, rtol=1e-6, atol=1e-6 * normal)
        assert_allclose(
            abs(force[6]), normal * math.tan(pair.base_helix_angle), rtol=1e-6, atol=0
        )
        # over the tangential force at the pitch circle it is the tangent of the helix angle there
        tangential = (
            normal
            * pair.pinion.base_radius
            / (0.5 * pair.center_distance * 2 / (1 + pair.ratio))
        )
        lead = math.tan(pair.base_helix_angle) / math.cos(pair.working_pressure_angle)
        assert_allclose(abs(force[6]) / tangential, lead, rtol=1e-6, atol=0)
        for arm, places, sign in (
            (at_pinion, (7, 8, 2), -1.0),
            (at_wheel, (10, 11, 5), 1.0),
        ):
            on_gear = np.cross(arm, force[[0, 1, 6]] if sign < 0 else force[[3, 4, 9]])
            found = force[list(places)] * [1.0, 1.0, sign]
            assert_allclose(
                found, on_gear, rtol=1e-6, atol=1e-6 * np.abs(on_gear).max()
            )
        assert system.names == one.dofs

    def test_the_thrust_on_a_right_handed_driver_is_along_its_rotation(self, one, hand):
        """Fingers of the hand of the helix along the rotation, about -z: the thumb is the thrust on the driver."""
        start = one.static_start(0.0)
        assert math.copysign(1.0, start[6]) == -hand
        assert_allclose(
            start[6] * one.pinion.support.stiffness_z,
            -start[9] * one.wheel.support.stiffness_z,
            rtol=1e-9,
        )


class TestStatics:
    def test_the_chords_carry_what_the_slices_carry(self, slices):
        """Against the slices themselves, solved by bracketing; the chords' own error is the depth of their sag."""
        table, pitch = slices.table(DEPTH), slices.pair.base_pitch
        roll = pitch * (np.arange(12) + 0.4) / 4
        n_pairs = table.last_pitch - table.first_pitch
        for force in (300.0, slices.force, 2.0 * slices.force):
            found = chord_equilibrium(table, chord_states(table, roll), force)
            for phase, approach in zip(roll, found.approach, strict=True):
                newest = math.floor(phase / pitch) - table.first_pitch
                position = phase - (newest - np.arange(n_pairs)) * pitch

                def excess(within, position=position, force=force):
                    return slices.force_at(position, within).sum() - force

                exact = brentq(excess, 0.0, 1e-4, xtol=1e-14) + slices.shared * force
                assert_allclose(approach, exact, rtol=0, atol=3e-7)
            assert_allclose(found.load.sum(axis=1), force, rtol=1e-12, atol=0)

    def test_more_chords_come_closer(self, slices):
        roll = slices.pair.base_pitch * (np.arange(24) + 0.4) / 8
        found = [
            chord_equilibrium(table, chord_states(table, roll), slices.force).approach
            for table in (slices.table(np.linspace(0, 2e-5, n)) for n in (3, 5, 9, 65))
        ]
        errors = [np.abs(one - found[-1]).max() for one in found[:-1]]
        assert errors[0] > 2 * errors[1] > 4 * errors[2]

    def test_the_tangent_stiffness_is_the_slope_of_force_over_approach(self, helical):
        table, force = helical.table, helical.mesh_force
        roll = table.pair.base_pitch * (np.arange(20) + 0.3) / 20
        states = chord_states(table, roll)
        low, high = (
            chord_equilibrium(table, states, force * (1 + s * 1e-6)) for s in (-1, 1)
        )
        slope = 2e-6 * force / (high.approach - low.approach)
        found = chord_equilibrium(table, states, force).stiffness
        assert (np.abs(found / slope - 1) < 1e-4).mean() > 0.9

    def test_slowly_turned_the_gears_follow_their_statics(self, helical):
        """At 30 r/min, the mean normal force and the approach are those of the equilibrium."""
        slow = replace(
            helical,
            operating=replace(helical.operating, speed=helical.operating.speed / 60),
        )
        q, _ = moved(slow, 3000, step=1e-5)
        radius = slow.table.pair.pinion.base_radius
        time = 1e-5 * np.arange(len(q))
        late = slice(2000, None, 50)
        roll = slow.start_roll + radius * (slow.operating.speed * time + q[:, 2])
        static = chord_equilibrium(
            slow.table, chord_states(slow.table, roll[late]), slow.mesh_force
        )
        approach = (q @ slow.approach_direction())[late]
        assert_allclose(approach, static.approach, rtol=0.01, atol=0)
        wrong = chord_equilibrium(
            slow.table, chord_states(slow.table, roll[late]), 1.05 * slow.mesh_force
        )
        assert np.abs(approach / wrong.approach - 1).max() > 0.01


def balance(dynamics, n_steps=6000):
    """Residual of energy less work over the largest energy in the mesh, and the energy stored in the mesh, J."""
    q, v = moved(dynamics, n_steps)
    system, direction, time = (
        dynamics.system(),
        dynamics.approach_direction(),
        np.arange(len(q)) * STEP,
    )
    radius, speed, ratio = (
        dynamics.table.pair.pinion.base_radius,
        dynamics.operating.speed,
        dynamics.table.pair.ratio,
    )
    roll, roll_rate = (
        dynamics.start_roll + radius * (speed * time + q[:, 2]),
        radius * (speed + v[:, 2]),
    )
    law = laws(
        dynamics, np.column_stack([roll, q @ direction, v @ direction, roll_rate]), STEP
    )
    _, friction, moment_p, moment_w, _, stored, lost, _ = law.T
    speeds = v + speed * system.rotation
    springs = [dof for dof in range(12) if dof not in (2, 5)]
    k, c = np.diag(system.stiffness), np.diag(system.damping)
    drive = system.force[2] - k[2] * q[:, 2] - c[2] * v[:, 2]
    power = (
        drive * speeds[:, 2]
        + system.force[5] * speeds[:, 5]
        - v[:, springs] ** 2 @ c[springs]
        - lost
    )
    power += (
        friction * (v[:, 0] - v[:, 3])
        + moment_p * speeds[:, 2]
        + moment_w * speeds[:, 5]
    )
    energy = 0.5 * (speeds**2 @ system.mass + q[:, springs] ** 2 @ k[springs]) + stored
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1])) * STEP])
    assert_allclose(speeds[:, 5] * ratio, speed + ratio * v[:, 5], rtol=1e-9)
    return np.abs(energy - energy[0] - work).max() / stored.max(), stored


class TestEnergy:
    def test_power_in_is_stored_and_dissipated(self, helical):
        """Chords store the work of the curve that they follow, and give it back as the roll goes on."""
        residual, stored = balance(helical)
        assert stored.min() > 0.0
        assert residual < 5e-4

    def test_what_the_springs_leave_out_would_be_missed(self, helical, monkeypatch):
        from gensig.dynamics import lanes

        nothing = np.zeros_like(helical.table.gap)
        monkeypatch.setattr(lanes, "left_out_energy", lambda table: (nothing, nothing))
        assert balance(helical)[0] > 5e-3

    def test_the_stored_energy_is_the_work_of_the_force(self, helical):
        """Pressed together at one place, over all chords."""
        approach, roll = (
            np.linspace(0.0, 2.5e-5, 2001),
            0.6 * helical.table.pair.base_pitch,
        )
        found = laws(
            helical,
            np.column_stack(
                [np.full_like(approach, roll), approach, 0 * approach, 0 * approach]
            ),
        )
        force, stored = found[:, 0], found[:, 5]
        work = np.concatenate(
            [[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(approach))]
        )
        assert_allclose(stored, work, rtol=0, atol=2e-3 * work[-1])

    def test_the_roll_torque_is_the_slope_of_that_energy(self, helical):
        roll = np.linspace(0.2, 0.25, 400) * helical.table.pair.base_pitch
        found = laws(
            helical,
            np.column_stack([roll, np.full_like(roll, 8e-6), 0 * roll, 0 * roll]),
        )
        along, stored = found[:, 4], found[:, 5]
        slope = np.gradient(stored, roll)
        assert_allclose(
            -along[1:-1], slope[1:-1], rtol=0, atol=0.02 * np.abs(slope).max()
        )


class TestChords:
    def test_forces_do_not_jump_where_a_chord_takes_over(self, helical):
        """Pressed ever deeper at one place, with damping and rolling on."""
        approach, roll = (
            np.linspace(0.0, 2.5e-5, 3001),
            0.6 * helical.table.pair.base_pitch,
        )
        for rate in (0.0, 0.01, -0.01):
            motion = np.column_stack([np.full_like(approach, roll), approach, np.full_like(approach, rate),
                                      np.full_like(approach, 4.0)])  # fmt: skip
            found = laws(helical, motion)
            for column, size in ((0, 1.0), (4, 1e-3)):
                steps = np.abs(np.diff(found[:, column]))
                assert (
                    steps.max()
                    < 20 * np.median(steps) + 1e-3 * size * helical.mesh_force
                )

    def test_a_step_that_is_shorter_comes_closer(self, helical):
        """A lagging chord costs the square of the step: the force is continuous, its slope is not."""

        def run(oversampling):
            _, v = moved(helical, 128 * oversampling, step=1 / (51200.0 * oversampling))
            return v[::oversampling] @ helical.approach_direction()

        exact = run(64)
        errors = [
            np.linalg.norm(run(n) - exact) / np.linalg.norm(exact) for n in (5, 20)
        ]
        assert errors[0] < 1e-2
        assert errors[1] < errors[0] / 8

    def test_back_flanks_use_the_chord_of_the_set_load(self, helical):
        pair, table = helical.table.pair, helical.table
        approach = -pair.backlash - np.linspace(0.0, 1e-5, 11)
        motion = np.column_stack(
            [np.full(11, 0.3 * pair.base_pitch), approach, np.zeros(11), np.zeros(11)]
        )
        found = laws(helical, motion)[:, 0]
        alone = replace(table, **{
            name: np.repeat(getattr(table, name)[:, :, table.set_chord, None], len(table.depth), axis=2)
            for name in ("compliance", "compliance_slope", "gap", "gap_slope")
        })  # fmt: skip
        assert found[-1] < -100.0
        assert_allclose(
            found,
            laws(replace(helical, table=alone), motion)[:, 0],
            rtol=1e-12,
            atol=1e-9,
        )


class TestSlices:
    @pytest.mark.parametrize("speed_rpm", [620, 1480])
    def test_a_record_does_not_know_how_many_slices_there_are(self, speed_rpm):
        """Slices that enter whole strike at their own frequency: 20 and 40 made it up to 10 and 6 times as loud."""

        def level(n_slices):
            words = (
                "system=helical_pair",
                "gear=phm09_16_48",
                f"operating.speed_rpm={speed_rpm}",
                f"mesh.n_slices={n_slices}",
            )
            system = gensig.load_system(*words, *QUIET)
            return system.simulate(()).acceleration.std(axis=1)

        many = level(120)
        assert_allclose(level(20), many, rtol=0.15, atol=0)
        assert_allclose(level(40), many, rtol=0.1, atol=0)


class TestRecords:
    def integrated(
        self,
        machines,
        channels=("pinion_y", "pinion_z", "wheel_z"),
        precision="float64",
        tell_mesh=False,
    ):
        solver = Solver(oversampling=8, precision=precision, max_error=None)
        return integrate(
            machines,
            solver,
            sampling_rate=51200.0,
            duration=0.02,
            channels=channels,
            tell_mesh=tell_mesh,
        )

    @pytest.mark.parametrize("precision", ["float64", "float32"])
    def test_a_record_has_the_same_bits_alone_and_beside_others(
        self, helical, xiamen, spur, precision
    ):
        narrow = with_table(spur, Slices(xiamen, 0.5 * HELIX).table(DEPTH[:3]))
        machines = [
            helical,
            narrow,
            replace(
                helical,
                start_phase=0.9,
                pinion_error=np.random.default_rng(1).normal(0, 2e-6, 23),
            ),
        ]
        together = self.integrated(machines, precision=precision).acceleration
        for lane, machine in enumerate(machines):
            alone = self.integrated([machine], precision=precision).acceleration
            assert alone[0].tobytes() == together[lane].tobytes()

    def test_the_axial_channels_shake(self, helical):
        motions = self.integrated([helical])
        assert motions.finite[0]
        strength = motions.acceleration[0].std(axis=1)
        assert (strength > 1e-3).all()

    def test_float32_agrees(self, helical):
        wide, narrow = (
            self.integrated([helical], precision=p).acceleration[0]
            for p in ("float64", "float32")
        )
        assert_allclose(narrow, wide, rtol=0, atol=2e-3 * np.abs(wide).max())

    def test_the_loads_of_the_teeth_are_told(self, helical):
        from gensig.dynamics.mesh_state import NO_TOOTH, mesh_state

        motions = self.integrated([helical], tell_mesh=True)
        mesh = mesh_state(helical, motions.seen[0], motions.shaft_angle[0])
        n_pairs = helical.table.last_pitch - helical.table.first_pitch
        assert mesh.load_share.shape == (n_pairs, 1024)
        assert n_pairs > 4
        assert_allclose(mesh.load_share.sum(axis=0), 1.0, rtol=0, atol=1e-12)
        assert ((mesh.pinion_tooth == NO_TOOTH) == (mesh.load_share == 0.0)).all()
        assert_allclose(mesh.force.mean(), helical.mesh_force, rtol=0.02, atol=0)
        loaded = (mesh.pinion_tooth != NO_TOOTH).sum(axis=0)
        assert 2 <= loaded.min() <= loaded.max() <= n_pairs
        assert half_lag(helical.table) > 0.0
