"""The law of one mesh of a line: tables over the roll, both flanks, single teeth, energy, phases
between meshes.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from line_tools import RADII, STIFFNESS, TEETH, law_at, turning_mesh
from numpy.testing import assert_allclose
from refusals import refused

from benchmarks._phase_mesh import loaded_gap, phase_table, plain_pair
from gensig.driveline.mesh_phase import mesh_start, tooth_angle
from gensig.driveline.time import _layout as layout
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.errors import GeometryError
from gensig.faults.broken import MissingTooth
from gensig.mesh.load_distribution import static_mesh
from gensig.plan.request import read_request
from gensig.systems.registry import read_sliced_pair

BITE = 5e-6  # m
BACKLASH = 1e-4


def rippled(n_rows: int = 1, n_nodes: int = 32) -> np.ndarray:
    u = np.arange(n_rows * n_nodes).reshape(n_rows, n_nodes) / n_nodes
    over_the_turn = 0.1 * np.cos(2 * np.pi * u / n_rows) * (n_rows > 1)
    return STIFFNESS * (1 + 0.2 * np.cos(2 * np.pi * u) + over_the_turn)


def phases(stiffness=None, gap=None, *, backlash=0.0, damping=0.0):
    if stiffness is None:
        stiffness = rippled()
    pair = replace(plain_pair(TEETH, RADII[0]), backlash=backlash)
    teeth = MeshTeeth.perfect(phase_table(pair, stiffness, gap))
    return turning_mesh(teeth, damping)


@pytest.fixture
def table(xiamen):
    return xiamen.mesh_table((MissingTooth(gear="pinion", tooth=2),))


@pytest.fixture
def pairs(table):
    """Spur pairs that share a body, with tooth errors and tilts."""
    rng = np.random.default_rng(4)
    teeth = MeshTeeth(
        table=table,
        errors=(rng.normal(0, 2e-6, 23), rng.normal(0, 2e-6, 84)),
        tilts=(rng.normal(0, 3e-4, 23), rng.normal(0, 3e-4, 84)),
    )
    return turning_mesh(teeth, 1e-3)


class TestPhaseTable:
    def test_stiffness_repeats_with_every_tooth(self):
        for turned in (0.0, 0.25, 0.5, 7.5, -3.25, 12345.25):
            expected = BITE * STIFFNESS * (1 + 0.2 * math.cos(2 * math.pi * turned))
            assert_allclose(
                law_at(phases(), turned, BITE)[layout.FORCE],
                expected,
                rtol=1e-9,
            )

    def test_a_whole_turn_repeats_with_the_turn(self):
        table = rippled(TEETH[0])
        for turned in (0.0, 3.5, 19.75, 23.5):
            tooth, node = int(turned) % TEETH[0], round(turned % 1 * 32)
            expected = BITE * table[tooth, node]
            assert_allclose(
                law_at(phases(stiffness=table), turned, BITE)[layout.FORCE],
                expected,
                rtol=1e-9,
            )

    def test_no_jump_between_the_teeth_of_a_turn(self):
        mesh = phases(stiffness=rippled(TEETH[0]))
        for pitch in (1, 7, 20):
            before, after = (
                law_at(mesh, pitch + off, BITE)[0] for off in (-1e-9, 1e-9)
            )
            assert_allclose(after, before, rtol=1e-6)
            assert after > 0

    def test_a_gap_stands_between(self):
        mesh = phases(gap=np.full((1, 32), 2e-6))
        assert law_at(mesh, 0.3, 1.9e-6)[layout.FORCE] == pytest.approx(0.0, abs=0.0)
        assert_allclose(
            law_at(mesh, 0.5, BITE)[layout.FORCE],
            0.8 * STIFFNESS * (BITE - 2e-6),
            rtol=1e-9,
        )

    def test_nothing_within_the_backlash(self):
        mesh = phases(backlash=BACKLASH)
        for approach in (0.0, -0.5 * BACKLASH, -BACKLASH):
            assert not law_at(mesh, 0.3, approach).any()

    def test_the_back_flanks_push_back_as_hard_where_the_roll_is_mirrored(self):
        """Half a pitch behind the pitch point they are as the front flanks are there."""
        mesh = phases(backlash=BACKLASH)
        mirror = 2.0 * mesh.teeth.pair.pitch_point / mesh.teeth.pair.base_pitch + 0.5
        for turned in (0.25, 5.5, 18.75):
            front = law_at(mesh, turned, BITE)[0]
            back = law_at(mesh, mirror - turned, -BACKLASH - BITE)[0]
            assert_allclose(back, -front, rtol=1e-9)

    def test_damping_grows_with_the_load_and_never_pulls(self):
        mesh = phases(damping=2e-3, backlash=BACKLASH)
        still, fast = law_at(mesh, 0.1, BITE), law_at(mesh, 0.1, BITE, rate=10.0)
        assert_allclose(fast[layout.FORCE], 1.02 * still[layout.FORCE], rtol=1e-9)
        assert_allclose(fast[layout.LOST], 0.02 * still[layout.FORCE] * 10.0, rtol=1e-9)
        assert law_at(mesh, 0.1, BITE, rate=-1e4)[layout.FORCE] == pytest.approx(
            0.0, abs=0.0
        )
        back = law_at(mesh, 0.1, -BACKLASH - BITE, rate=-10.0)
        assert_allclose(
            back[layout.FORCE],
            1.02 * law_at(mesh, 0.1, -BACKLASH - BITE)[0],
            rtol=1e-9,
        )


class TestHelicalStatics:
    """A helical pair's loaded contact over a pitch as one spring behind one gap."""

    @pytest.fixture(scope="class")
    @classmethod
    def pair(cls):
        words = [
            "system=helical_pair",
            "mesh.n_slices=12",
            "mesh.slice_coupling=independent",
            "mesh.contact=linear",
        ]
        return read_sliced_pair(read_request(words).config)

    @pytest.fixture(scope="class")
    @classmethod
    def contact(cls, pair):
        return pair.transmission_error(n_phases=16).contact

    @pytest.fixture(scope="class")
    @classmethod
    def mesh(cls, pair, contact):
        gap = loaded_gap(contact.approach, contact.stiffness, pair.mesh_force)
        return phases(stiffness=contact.stiffness[None], gap=gap[None])

    def test_it_is_where_statics_put_it(self, pair, contact, mesh):
        for place, approach in enumerate(contact.approach):
            assert_allclose(
                law_at(mesh, place / 16, approach)[layout.FORCE],
                pair.mesh_force,
                rtol=1e-9,
            )

    def test_near_that_load_it_answers_as_statics_do(self, pair, contact, mesh):
        other = (
            replace(pair, torque=1.02 * pair.torque)
            .transmission_error(n_phases=16)
            .contact
        )
        for place, approach in enumerate(other.approach):
            computed = (
                law_at(mesh, place / 16, approach)[layout.FORCE] - pair.mesh_force
            )
            assert_allclose(computed, 0.02 * pair.mesh_force, rtol=0.02)


class TestPairs:
    def test_statics_agree(self, pairs, table):
        """Every pair with its own teeth, the missing one too, and the shared body."""
        rolls = np.linspace(0.05, 30.05, 61)
        states = pairs.teeth.states(rolls * table.pair.base_pitch)
        computed = static_mesh(table, states, 500.0)
        for turned, approach, load in zip(
            rolls, computed.approach, computed.load, strict=True
        ):
            law = law_at(pairs, turned, approach)
            assert_allclose(law[layout.FORCE], load.sum(), rtol=2e-5)

    @pytest.mark.parametrize("approach", [2e-5, -1.5e-4])
    def test_forces_are_slopes_of_the_stored_energy(self, pairs, approach):
        for turned in (0.313, 2.711, 9.173):
            law = law_at(pairs, turned, approach)
            rolled = [law_at(pairs, turned + off, approach) for off in (-1e-7, 1e-7)]
            closer = [law_at(pairs, turned, approach + off) for off in (-1e-10, 1e-10)]
            by_roll = (rolled[1] - rolled[0]) / 2e-7
            by_approach = (closer[1] - closer[0]) / 2e-10
            along = -by_roll[layout.STORED]
            assert_allclose(law[layout.ALONG], along, rtol=1e-4, atol=1e-6)
            assert_allclose(law[layout.FORCE], by_approach[layout.STORED], rtol=1e-4)
            assert_allclose(law[layout.TANGENT], by_approach[layout.FORCE], rtol=1e-4)


class TestPhasesBetweenMeshes:
    def test_a_gear_turned_on_by_a_tooth_stands_as_before(self):
        one, other = (
            mesh_start(30, mate_angle=1.0, drives=True, tooth_angle=angle)
            for angle in (0.2, 0.2 + 2 * math.pi / 30)
        )
        assert_allclose(one[1], other[1], rtol=0, atol=1e-12)
        assert other[0] == (one[0] + 1) % 30

    def test_a_mate_a_tooth_further_on_meets_the_tooth_before(self):
        one, other = (
            mesh_start(30, mate_angle=angle, drives=True)
            for angle in (1.0, 1.0 + 2 * math.pi / 30)
        )
        assert_allclose(one[1], other[1], rtol=0, atol=1e-12)
        assert other[0] == (one[0] - 1) % 30

    @pytest.mark.parametrize(("n_teeth", "apart"), [(40, 0.5), (41, 0.0)])
    def test_an_idler_between_two_mates_in_a_line(self, n_teeth, apart):
        """Its trailing flank is half a pitch behind its leading one; half a turn adds half a pitch
        if z is odd.
        """
        driven = mesh_start(n_teeth, mate_angle=0.0, drives=False)[1]
        drives = mesh_start(n_teeth, mate_angle=math.pi, drives=True)[1]
        assert_allclose((drives - driven - apart + 0.5) % 1.0, 0.5, rtol=0, atol=1e-9)

    @pytest.mark.parametrize("drives", [True, False])
    def test_there_and_back(self, drives):
        start = mesh_start(
            59, mate_angle=2.2, drives=drives, tooth_angle=0.71, pitch_point=0.4
        )
        computed = tooth_angle(
            59, mate_angle=2.2, drives=drives, start=start, pitch_point=0.4
        )
        assert_allclose(
            (computed - 0.71 + math.pi) % (2 * math.pi), math.pi, rtol=0, atol=1e-12
        )

    def test_no_teeth(self):
        with refused("0 teeth", GeometryError):
            mesh_start(0, mate_angle=0.0, drives=True)


def test_a_table_of_a_row_or_of_one_for_each_tooth():
    with refused("must be (1, node) or (20, node)"):
        phases(stiffness=np.full((3, 8), 1e8))
