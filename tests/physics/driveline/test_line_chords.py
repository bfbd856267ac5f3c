"""Sliced teeth in a line's mesh: the largest chord bears, from one potential; the pair dynamics'
motion.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from chord_tables import Slices, as_chords, repeated, with_table
from closeness import assert_close
from lane_tools import advance
from line_tools import law_at, state_after, turning_mesh

from gensig.driveline.time import _layout as layout
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.faults.broken import MissingTooth
from gensig.mesh.load_distribution import Meeting, pair_states, static_mesh
from gensig.mesh.tooth_table import GearTeeth
from gensig.plan.request import read_request
from gensig.systems.registry import read_sliced_pair

HELIX = math.radians(20.0)
DEPTH = np.array([0.0, 2.0, 5.0, 9.0, 14.0, 20.0]) * 1e-6
DAMPING = 1e-3  # s/m
STEPS = 64
N_SAMPLES = 205


def placed(table, **more):
    return turning_mesh(replace(MeshTeeth.perfect(table), **more), DAMPING)


def with_table_of(mesh, **changes):
    """The mesh with another table of its teeth."""
    table = replace(mesh.teeth.table, **changes)
    return replace(mesh, teeth=replace(mesh.teeth, table=table))


@pytest.fixture(scope="module")
def helical():
    """A helical pair with a missing tooth, as tabulated for records."""
    pair = read_sliced_pair(
        read_request(["experiment=helical", "mesh.n_slices=16"]).config
    )
    return pair.mesh_table((MissingTooth(gear="pinion", tooth=2),)), pair.mesh_force


@pytest.fixture(scope="module")
def mesh(helical):
    table, _ = helical
    rng = np.random.default_rng(4)
    counts = table.pair.pinion.n_teeth, table.pair.wheel.n_teeth
    return placed(
        table,
        errors=tuple(rng.normal(0, 2e-6, n) for n in counts),
    )


class TestLaw:
    @pytest.mark.parametrize("share", [0.02, 0.3, 1.0, 2.5])
    def test_statics_agree_whatever_the_load(self, helical, mesh, share):
        table, force = helical
        rolls = np.linspace(0.05, 30.05, 61)
        meeting = Meeting(errors=mesh.teeth.errors)
        computed = static_mesh(
            table,
            pair_states(table, rolls * table.pair.base_pitch, meeting),
            share * force,
        )
        forces = [
            law_at(mesh, turned, approach)[0]
            for turned, approach in zip(rolls, computed.approach, strict=True)
        ]

        assert_close(forces, share * force, 1e-4)

    @pytest.mark.parametrize("approach", [2e-5, 6e-5, -1.5e-4])
    @pytest.mark.parametrize("turned", [0.313, 2.711, 9.173])
    def test_force_and_torque_of_the_passing_teeth_are_slopes_of_one_potential(
        self, mesh, approach, turned
    ):
        pair = replace(mesh.teeth.pair, backlash=1e-4)
        mesh = with_table_of(mesh, pair=pair)

        def stored(turned, approach):
            return law_at(mesh, turned, approach)[layout.STORED]

        law = law_at(mesh, turned, approach)
        further = stored(turned + 1e-7, approach) - stored(turned - 1e-7, approach)
        deeper = stored(turned, approach + 1e-10) - stored(turned, approach - 1e-10)

        assert_close(law[layout.ALONG], -further / 2e-7, 1e-3, atol=1e-6)
        assert_close(law[layout.FORCE], deeper / 2e-10, 1e-4)

    @pytest.mark.parametrize("turned", [0.65, 1.65, 2.65])
    def test_the_force_is_convex_between_nodes_too(self, turned):
        """Chords meet off their depths there; a step of the force would have no equilibrium."""
        words = ["experiment=helical", "mesh.n_slices=8", "mesh.points_per_pitch=32"]
        coarse = placed(read_sliced_pair(read_request(words).config).mesh_table(()))
        approaches = np.linspace(5e-5, 6.5e-5, 751)
        steps = np.diff([law_at(coarse, turned, at)[0] for at in approaches])

        assert steps.min() > 0.0
        assert np.diff(steps).min() > -1e-8 * steps.max()

    def test_all_chords_of_a_pair_are_damped_by_its_first_touch(self, mesh):
        still = law_at(mesh, 0.4, 3e-5)
        fast = law_at(mesh, 0.4, 3e-5, rate=10.0)
        assert_close(
            fast[layout.FORCE],
            (1.0 + 10.0 * DAMPING) * still[layout.FORCE],
            1e-12,
        )
        assert_close(
            law_at(mesh, 0.4, 3e-5, rate=-1e4)[layout.FORCE],
            0.0,
        )

    def test_the_missing_tooth_is_missing_on_both_flanks_once_a_turn(
        self, helical, mesh
    ):
        n_teeth = helical[0].pair.pinion.n_teeth
        pinion = mesh.teeth.table.pinion
        whole = replace(pinion, present=np.ones_like(pinion.present))
        sound = with_table_of(mesh, pinion=whole)
        turned = np.arange(0.5, n_teeth + 0.5, 0.25)
        for approach in (3e-5, -mesh.teeth.pair.backlash - 3e-5):
            force, whole = (
                np.array([law_at(each, at, approach)[0] for at in turned])
                for each in (mesh, sound)
            )
            ratio = force / whole
            assert 0 < (ratio < 0.999).sum() < 5 * 4
            assert ratio.min() < 0.8

    @pytest.mark.parametrize("position", [0.1, 0.35, 0.8])
    def test_slices_enter_from_the_other_end_on_the_back_flanks(
        self, helical, position
    ):
        """The middle of the face, past the pitch point in pitches, meets the mate half a pitch from
        where it does on the front.
        """
        table, _ = helical
        mesh = placed(table)
        pair = table.pair
        middle = 0.5 * pair.face_width * math.tan(pair.base_helix_angle)
        start = (pair.pitch_point + middle) / pair.base_pitch + 9.0
        front = law_at(mesh, start + position, 3e-5)[0]
        back = law_at(mesh, start + 0.5 - position, -pair.backlash - 3e-5)[0]

        assert_close(back, -front, 1e-9)


class TestZeroHelix:
    @pytest.mark.parametrize("n_chords", [1, 3])
    def test_a_spur_table_in_chords_is_the_spur_mesh(self, xiamen, n_chords):
        table = xiamen.mesh_table((MissingTooth(gear="pinion", tooth=1),))
        one = placed(table)
        other = placed(as_chords(table, n_chords))
        for turned in (0.2, 1.7, 2.4, 23.9):
            for approach in (1e-5, 4e-5, -table.pair.backlash - 2e-5):
                expected = law_at(one, turned, approach, 1e-2, 1e3)
                assert_close(
                    law_at(other, turned, approach, 1e-2, 1e3),
                    expected,
                    1e-9,
                    atol=1e-12,
                )


def moved(line):
    n_steps = STEPS * N_SAMPLES
    return state_after(
        line,
        line.start(0.0),
        n_steps / (51200 * STEPS),
        n_steps,
    )


class TestAgainstThePair:
    """The helical pair with its axial motion and tilts, through both integrators."""

    @pytest.fixture(scope="class", params=["sound", "missing tooth"])
    @classmethod
    def running(cls, request, machine, running_of):
        spur = machine({"mesh.points_per_pitch": 2048})
        table = Slices(spur, HELIX).table(DEPTH)
        if request.param == "missing tooth":
            kind = np.zeros_like(table.pinion.kind)
            kind[2] = 1
            present = np.array([True, False])
            table = replace(
                table,
                pinion=GearTeeth(kind=kind, present=present),
                parts=(repeated(table.pairs, 2),),
            )
        rng = np.random.default_rng(1)
        errors = {
            "pinion_error": rng.normal(0, 2e-6, 23),
            "wheel_error": rng.normal(0, 2e-6, 84),
        }
        return with_table(running_of(spur, (), **errors), table)

    def test_the_same_motion(self, running):
        q_1, v_1, motion = moved(running.dynamics)
        q, v, _ = advance(
            running,
            *running.dynamics.start(0.0),
            1 / (51200 * STEPS),
            0,
            STEPS * N_SAMPLES,
        )
        direction = running.approach_direction()

        assert motion.energy_residual < 1e-4
        assert_close(
            v_1,
            v,
            atol=1e-3 * np.abs(v).max(),
        )
        assert_close(q_1 @ direction, q @ direction, atol=5e-8)
