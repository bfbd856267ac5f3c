"""Helical gears in motion: the spur law in chords, axial forces and moments, energy, statics."""

import math
from dataclasses import replace

import numpy as np
import pytest
from chord_tables import Slices, as_chords, with_table
from closeness import assert_close
from energy_balance import balance
from lane_tools import laws, right_hand_side, trajectory, with_teeth
from scipy.optimize import brentq

import gensig
from gensig.dynamics import lanes
from gensig.dynamics.helical import AXIAL_DOFS
from gensig.dynamics.integrator import Solver, integrate
from gensig.dynamics.mesh_state import NO_TOOTH, mesh_state
from gensig.dynamics.pair import PAIR_DOFS
from gensig.faults.broken import MissingTooth
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.tooth_table import TablePart

HELIX = math.radians(20.0)
DEPTH = np.array([0.0, 2.0, 5.0, 9.0, 14.0, 20.0]) * 1e-6
STEP = 1 / (51200.0 * 32)
N_PLANE = len(PAIR_DOFS)
PINION, WHEEL = (
    [0, 1, 6],
    [3, 4, 9],
)  # translations of the gears


@pytest.fixture(scope="module")
def slices(xiamen):
    return Slices(xiamen, HELIX)


@pytest.fixture(scope="module")
def spur(xiamen, running_of):
    return running_of(xiamen)


@pytest.fixture(scope="module")
def helical(spur, slices):
    return with_table(spur, slices.table(DEPTH))


def moved(running, n_steps, step=STEP):
    """States from static equilibrium on, q and v."""
    start = running.dynamics.static_start(0.0)
    return trajectory(
        running,
        start,
        np.zeros(len(start)),
        step,
        n_steps,
    )


class TestZeroHelix:
    """With zero helix and the spur pair's table in chords, the motion has the spur pair's bits."""

    @pytest.mark.parametrize("n_chords", [1, 3])
    @pytest.mark.parametrize("faults", [(), (MissingTooth(gear="pinion", tooth=1),)])
    def test_the_motion_in_the_plane(self, xiamen, running_of, n_chords, faults):
        spur = running_of(xiamen, faults)
        chords = with_table(spur, as_chords(spur.table, n_chords))
        assert chords.dofs == (*PAIR_DOFS, *AXIAL_DOFS)

        for values, others in zip(moved(spur, 300), moved(chords, 300), strict=True):
            assert np.array_equal(values, others[:, :N_PLANE])
            assert np.all(others[:, N_PLANE:] == 0.0)

    def test_statics(self, spur):
        chords = with_table(spur, as_chords(spur.table, 3))
        roll = spur.table.pair.base_pitch * (np.arange(50) + 0.5) / 50
        for force in (100.0, 925.0):
            expected, static = (
                each.teeth.static(each.teeth.states(roll), force)
                for each in (spur, chords)
            )
            for name in ("approach", "load", "stiffness"):
                exact = getattr(expected, name)
                tolerance = 1e-12 * np.abs(exact).max()
                assert_close(
                    getattr(static, name),
                    exact,
                    1e-9,
                    atol=tolerance,
                )

        assert_close(
            chords.friction_torque(),
            spur.friction_torque(),
            1e-9,
        )
        assert_close(
            chords.mean_mesh_stiffness,
            spur.mean_mesh_stiffness,
            1e-9,
        )


def contact(running):
    """Pitch point from the centres of both gears, and the push on the wheel, in x, y, z."""
    pair = running.table.pair
    radii = pair.pinion.base_radius, -pair.wheel.base_radius
    across = math.tan(pair.working_pressure_angle)
    hand = math.copysign(1.0, pair.pinion.helix_angle)
    arms = [np.array([radius, -radius * across, 0.0]) for radius in radii]
    return *arms, np.array([0.0, -1.0, hand * math.tan(pair.base_helix_angle)])


@pytest.mark.parametrize("hand", [1.0, -1.0])
class TestForces:
    @pytest.fixture
    def gears(self, spur, xiamen, hand):
        return with_table(
            spur,
            Slices(xiamen, hand * HELIX, n_slices=6).table(DEPTH),
        )

    def test_the_approach_is_the_penetration_of_the_flanks(self, gears):
        """From the displacement of the two bodies at the pitch point."""
        at_pinion, at_wheel, push = contact(gears)
        for q in np.random.default_rng(4).normal(0, 1e-5, (20, 12)):
            pinion = q[PINION] + np.cross([q[7], q[8], -q[2]], at_pinion)
            wheel = q[WHEEL] + np.cross([q[10], q[11], q[5]], at_wheel)
            approach = gears.approach_direction() @ q
            assert_close(
                approach,
                push @ (pinion - wheel),
                1e-10,
                atol=1e-18,
            )

    def test_action_equals_reaction_and_moments_balance(self, gears):
        pair = gears.table.pair
        plain = {
            "friction_coefficient": 0.0,
            "roll_torque": "classical",
        }
        options = replace(gears.table.options, **plain)
        table = replace(gears.table, options=options)
        still = with_teeth(gears, table=table)
        system = still.equations
        start = gears.dynamics.static_start(0.0)
        acceleration = right_hand_side(still, 0.0, start, np.zeros(12))
        force = (
            system.mass * acceleration
            - still.dynamics.forces(np.zeros(1))[0]
            + system.governed_stiffness @ start
        )
        at_pinion, at_wheel, push = contact(gears)
        normal = force[1]

        assert normal > 0.5 * gears.mesh_force
        assert_close(force[PINION], -normal * push, atol=1e-6 * normal)
        assert_close(force[WHEEL], normal * push, atol=1e-6 * normal)

        # the axial force over the tangential one is the tangent of the helix angle
        working_radius = pair.center_distance / (1 + pair.ratio)
        tangential = normal * pair.pinion.base_radius / working_radius
        lead = math.tan(pair.base_helix_angle) / math.cos(pair.working_pressure_angle)

        assert_close(abs(force[6]) / tangential, lead, 1e-6)

        # the pinion turns about -z
        on_pinion = np.cross(at_pinion, force[PINION]) * [
            1.0,
            1.0,
            -1.0,
        ]
        on_wheel = np.cross(at_wheel, force[WHEEL])
        for moments, expected in (
            (force[[7, 8, 2]], on_pinion),
            (force[[10, 11, 5]], on_wheel),
        ):
            assert_close(
                moments,
                expected,
                atol=1e-6 * np.abs(expected).max(),
            )

    def test_the_thrust_of_a_driver_follows_its_hand(self, gears, hand):
        """Fingers of the hand of the helix along the rotation: the thumb is the thrust."""
        start = gears.dynamics.static_start(0.0)
        assert math.copysign(1.0, start[6]) == -hand

        thrust = start[6] * gears.pinion.support.stiffness_z
        assert_close(
            thrust,
            -start[9] * gears.wheel.support.stiffness_z,
            1e-9,
        )


class TestStatics:
    @pytest.mark.parametrize("share", [0.3, 1.0, 2.0])
    def test_chords_carry_the_load_of_the_slices(self, slices, share):
        """Against the slices, by bracketing; the error of chords is the depth of their sag."""
        table = slices.table(DEPTH)
        pitch = slices.pair.base_pitch
        force = share * slices.force
        roll = pitch * (np.arange(12) + 0.4) / 4
        older = np.arange(table.last_pitch - table.first_pitch)

        static = static_mesh(table, pair_states(table, roll), force)

        assert_close(static.load.sum(axis=1), force, 1e-12)

        for phase, approach in zip(roll, static.approach, strict=True):
            newest = math.floor(phase / pitch) - table.first_pitch
            position = phase - (newest - older) * pitch

            def excess(within, position=position):
                return slices.force_at(position, within).sum() - force

            exact = brentq(excess, 0.0, 1e-4, xtol=1e-14) + slices.shared * force
            assert_close(approach, exact, atol=3e-7)


class TestEnergy:
    def test_power_is_stored_and_dissipated(self, helical, monkeypatch):
        """Chords store the work of the curve that they follow, and return it along the roll."""
        motion = balance(helical, STEP, 4000)
        assert motion.stored.min() > 0.0
        assert motion.residual < 5e-4

        nothing = np.zeros_like(helical.table.pairs.gap)
        monkeypatch.setattr(
            lanes,
            "left_out_energy",
            lambda table: (nothing, nothing),
        )
        assert balance(helical, STEP, 4000).residual > 5e-3

    def test_the_stored_energy_is_the_work_of_the_force(self, helical):
        """Pressed together at one position, over all chords."""
        approach = np.linspace(0.0, 2.5e-5, 2001)
        roll = 0.6 * helical.table.pair.base_pitch
        law = laws(helical, (roll, approach, 0.0, 0.0))
        force = law[:, 0]
        stored = law[:, 5]
        work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(approach))

        assert_close(
            stored,
            np.append(0.0, work),
            atol=2e-3 * work[-1],
        )


class TestChords:
    def test_back_flanks_use_the_chord_of_the_set_load(self, helical):
        table = helical.table
        approach = -table.pair.backlash - np.linspace(0.0, 1e-5, 11)
        motions = (
            0.3 * table.pair.base_pitch,
            approach,
            0.0,
            0.0,
        )
        single = (values[:, :, table.set_chord, None] for values in table.pairs)
        chords = (np.repeat(values, len(table.depth), axis=2) for values in single)
        parts = (TablePart._make(chords),)
        alone = with_teeth(helical, table=replace(table, parts=parts))
        force = laws(helical, motions)[:, 0]

        assert force[-1] < -100.0
        assert_close(
            force,
            laws(alone, motions)[:, 0],
            1e-12,
            atol=1e-9,
        )


@pytest.mark.parametrize("speed_rpm", [620, 1480])
def test_a_record_is_independent_of_the_number_of_slices(speed_rpm):
    """Slices entering whole would strike at their own frequency, up to 10 times as loud."""

    def level(n_slices):
        system = gensig.load_system(
            "system=helical_pair",
            "gear=phm09_16_48",
            f"operating.speed_rpm={speed_rpm}",
            f"mesh.n_slices={n_slices}",
            "operating.duration_s=0.2",
            "solver.max_error=null",
        )
        return system.simulate(()).acceleration.std(axis=1)

    many = level(120)
    assert_close(level(20), many, 0.15)
    assert_close(level(40), many, 0.1)


class TestRecords:
    def motions(
        self,
        machines,
        precision="float64",
        with_mesh_state=False,
    ):
        return integrate(
            [each.dynamics for each in machines],
            Solver(
                oversampling=8,
                precision=precision,
                max_error=None,
            ),
            sampling_rate=51200.0,
            duration=0.02,
            channels=("pinion_y", "pinion_z", "wheel_z"),
            with_mesh_state=with_mesh_state,
        )

    def test_records_are_independent_and_move_in_the_axes(self, helical, xiamen, spur):
        narrow = with_table(spur, Slices(xiamen, 0.5 * HELIX).table(DEPTH[:3]))
        errors = np.random.default_rng(1).normal(0, 2e-6, 23)
        machines = [
            helical,
            narrow,
            with_teeth(
                helical, start_phase=0.9, errors=(errors, helical.teeth.errors[1])
            ),
        ]
        signals = {}
        for precision in ("float64", "float32"):
            together = self.motions(machines, precision).acceleration
            for signal, machine in zip(together, machines, strict=True):
                alone = self.motions([machine], precision).acceleration[0]
                assert alone.tobytes() == signal.tobytes()
            signals[precision] = together[0]
        wide = signals["float64"]

        assert (wide.std(axis=1) > 1e-3).all()
        assert_close(
            signals["float32"],
            wide,
            atol=2e-3 * np.abs(wide).max(),
        )

    def test_the_loads_of_the_teeth(self, helical):
        motions = self.motions([helical], with_mesh_state=True)
        mesh = mesh_state(helical.teeth, motions.seen[0], motions.angle[0][0])
        n_pairs = helical.table.last_pitch - helical.table.first_pitch

        assert mesh.load_share.shape == (n_pairs, 1024)
        assert n_pairs > 4
        assert_close(mesh.load_share.sum(axis=0), 1.0, atol=1e-12)
        assert ((mesh.pinion_tooth == NO_TOOTH) == (mesh.load_share == 0.0)).all()
        assert_close(mesh.force.mean(), helical.mesh_force, 0.005)

        n_loaded = (mesh.pinion_tooth != NO_TOOTH).sum(axis=0)
        assert 2 <= n_loaded.min() <= n_loaded.max() <= n_pairs
