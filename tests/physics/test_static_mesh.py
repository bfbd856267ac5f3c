"""Static mesh: complementarity with the full flexibility matrix, mesh period, zones, and where a
faulty tooth shows.
"""

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import GEARS, KINDS, one, side_of
from refusals import refused

from gensig.mesh.load_distribution import Meeting, PairStates, pair_states, static_mesh


def fault(kind, gear="pinion", tooth=5):
    size = {"crack": {"crack_depth_mm": 2.0}}.get(kind, {})
    return one(kind, gear=gear, tooth=tooth, **size)


def at(table, roll, force):
    """Equilibrium at rolls under a force."""
    return static_mesh(table, pair_states(table, roll), force)


# runout is on every tooth
FAULTS = tuple(kind for kind in KINDS if kind != "runout")
COUPLINGS = ("coupled", "sum")


@pytest.fixture(scope="module", params=COUPLINGS)
def table(request, machine):
    return machine({"mesh.pair_coupling": request.param}).mesh_table()


def random_states(table, n=400):
    """Pairs with random compliances, gaps and absences, to leave nothing to the geometry's good
    nature.
    """
    rng = np.random.default_rng(0)
    size = (n, 4)
    compliance = rng.uniform(4e-9, 9e-9, size) - table.shared_compliance
    gap = rng.uniform(0, 30e-6, size)
    gap[rng.random(size) < 0.5] = 0.0
    gap[rng.random(size) < 0.2] = np.inf
    gap[np.isinf(gap).all(axis=1), 0] = 1e-6
    return PairStates(
        compliance=compliance[:, :, None],
        gap=gap[:, :, None],
        position=np.zeros(size),
    )


def violation(states, static, shared, force):
    """Worst breach of: C F = approach - gap where F > 0, approach - C F <= gap elsewhere, F >= 0,
    sum F = force.

    C is the full flexibility matrix, own compliances on the diagonal and the shared body compliance
    everywhere.
    """
    load = static.load
    own = states.compliance[:, :, 0] * load
    deflection = own + shared * load.sum(axis=1, keepdims=True)
    slack = states.gap[:, :, 0] + deflection - static.approach[:, None]
    slack = slack / static.approach.max()
    carrying = load > 0
    breaches = [
        np.abs(slack[carrying]).max(),
        -slack[~carrying].min(initial=0.0),
        -load.min() / force,
        np.abs(load.sum(axis=1) / force - 1).max(),
    ]
    return max(breaches)


class TestPairStates:
    @pytest.fixture
    def errors(self, xiamen):
        """Errors in m and tilts in m/m of all teeth."""
        rng = np.random.default_rng(4)
        scales = {"error": 5e-6, "tilt": 3e-4}
        return {
            f"{side}_{name}": rng.normal(0.0, scale, gear.n_teeth)
            for side, gear in xiamen.pair.gears.items()
            for name, scale in scales.items()
        }

    @staticmethod
    def plain(table, roll, starts, errors):
        """Compliance and gap of the four pairs at one roll, read tooth by tooth."""
        pitch = table.pair.base_pitch
        newest = int(np.floor(roll / pitch)) + 1
        for number in range(newest, newest - 4, -1):
            position = roll - number * pitch
            compliance, gap = -table.shared_compliance, 0.0
            for side in GEARS:
                teeth = side_of(table, side)
                tooth = (number + starts[side]) % len(teeth.kind)
                row = teeth.kind[tooth]
                nodes = position, table.position
                compliance += np.interp(*nodes, teeth.compliance[row])
                gap += (
                    np.interp(*nodes, teeth.gap[row]) + errors[f"{side}_error"][tooth]
                )
                tilt = errors[f"{side}_tilt"][tooth]
                gap += tilt * (position - table.pair.pitch_point)
                if not teeth.present[row]:
                    gap = np.inf
            yield compliance, gap, position

    def test_pairs_are_the_teeth_that_meet(self, xiamen, errors):
        """Before the first pair, over several turns, with faults of both gears."""
        faults = (fault("pitting"), fault("missing_tooth", "wheel", 11))
        table, starts = xiamen.mesh_table(faults), {"pinion": 7, "wheel": 40}
        turns = np.random.default_rng(2).uniform(-1.0, 3.0, 300)
        roll = turns * 84 * table.pair.base_pitch
        meeting = Meeting(
            start_teeth=tuple(starts.values()),
            errors=tuple(errors[f"{side}_error"] for side in starts),
            tilts=tuple(errors[f"{side}_tilt"] for side in starts),
        )

        states = pair_states(table, roll, meeting)

        expected = np.array([list(self.plain(table, r, starts, errors)) for r in roll])
        rows = (expected[:, :, 0], 1e-9, 0.0), (expected[:, :, 1], 1e-9, 1e-15)
        for result, (values, rtol, atol) in zip(
            (states.compliance[:, :, 0], states.gap[:, :, 0]), rows, strict=True
        ):
            assert_close(result, values, rtol, atol=atol)
        assert_close(states.position, expected[:, :, 2], atol=1e-12)
        assert np.isinf(states.gap).any()

    def test_a_value_for_every_tooth(self, table):
        roll = np.zeros(1)
        for n_teeth in (22, 24):
            with refused("broadcast", ValueError):
                pair_states(table, roll, Meeting(errors=(np.zeros(n_teeth), None)))

    def test_a_roll_that_is_no_number_reads_nothing(self, table):
        with np.errstate(invalid="ignore"):
            states = pair_states(table, np.array([np.nan]))
        assert np.isnan(states.gap).all()
        assert np.isnan(states.compliance).all()


def test_without_a_pair_nothing_is_carried(table):
    states = random_states(table)
    states.gap[::3] = np.inf
    static = static_mesh(table, states, 925.0)
    lost = np.isinf(states.gap).all(axis=(1, 2))
    assert lost.any()
    assert not lost.all()
    assert (static.approach[lost] == np.inf).all()
    assert not static.load[lost].any()
    assert not static.stiffness[lost].any()
    assert np.isfinite(static.approach[~lost]).all()
    assert (static.stiffness[~lost] > 0.0).all()


@pytest.mark.parametrize("force", [1.0, 925.0, 2e4])
def test_random_pairs_are_in_equilibrium(table, force):
    states = random_states(table)
    static = static_mesh(table, states, force)
    assert violation(states, static, table.shared_compliance, force) < 1e-11


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("kind", KINDS)
def test_equilibrium_with_every_fault_over_a_turn(xiamen, kind, gear):
    """C F = approach - gap for every pair that carries; no pair pulls; all force is carried."""
    faulty = xiamen.mesh_table((one(kind, gear=gear, tooth=3),))
    force = xiamen.mesh_force
    roll = xiamen.pair.base_pitch * np.linspace(0, 23, 23 * 20, endpoint=False)
    states = pair_states(faulty, roll)

    static = static_mesh(faulty, states, force)

    assert violation(states, static, faulty.shared_compliance, force) < 1e-11

    sound = at(xiamen.mesh_table(), roll, force)
    assert np.abs(static.load - sound.load).max() > 1e-3 * force


def test_approach_rises_with_force_and_stiffness_is_its_slope(table):
    states = random_states(table)
    forces = np.geomspace(1, 1e5, 60)
    approach = [static_mesh(table, states, force).approach for force in forces]

    assert np.all(np.diff(approach, axis=0) > 0)

    low, high = (
        static_mesh(table, states, 1000.0 * (1 + sign * 1e-7)) for sign in (-1, 1)
    )
    same = ((low.load > 0) == (high.load > 0)).all(axis=1)
    slope = 2e-4 / (high.approach - low.approach)

    assert same.mean() > 0.9

    stiffness = static_mesh(table, states, 1000.0).stiffness
    assert_close(stiffness[same], slope[same], 1e-5)


def test_shares_of_the_stiffness_curves_sum_to_one(xiamen):
    curves = xiamen.stiffness_curves((fault("missing_tooth"),))
    assert_close(curves.load_share.sum(axis=1), 1.0, 1e-12)
    assert curves.load_share.min() >= 0


class TestMeshPeriod:
    @pytest.mark.parametrize("law", ["one_sided", "paper"])
    def test_sound_teeth_repeat_every_pitch(self, machine, law):
        curves = machine({"mesh.law": law}).stiffness_curves()
        teeth = curves.mesh_stiffness.reshape(23, -1)
        assert_close(
            teeth,
            np.tile(teeth[0], (23, 1)),
            1e-8,
        )
        assert np.ptp(teeth[0]) > 0.1 * teeth.mean()


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("kind", FAULTS)
def test_a_faulty_tooth_shows_once_a_turn_at_its_number(xiamen, gear, kind):
    """Tooth k enters contact at A after k pitches; corner contact starts a little earlier."""
    points = 50
    tooth = 9
    n_teeth = getattr(xiamen.pair, gear).n_teeth
    pitches = (np.arange(2 * n_teeth * points) + 0.5) / points
    roll = xiamen.pair.base_pitch * pitches
    sound, faulty = (
        at(xiamen.mesh_table(faults), roll, xiamen.mesh_force).stiffness
        for faults in ((), (fault(kind, gear, tooth),))
    )

    differs = np.abs(faulty / sound - 1) > 1e-9
    first, second = differs.reshape(2, n_teeth, points)

    assert (first == second).all()

    shown = np.flatnonzero(first.any(axis=1)) - tooth
    assert set(shown.tolist()) <= {-1, 0, 1}
    assert {0, 1} & set(shown.tolist())


class TestPaperLaw:
    def test_zones_match_the_contact_ratio(self, paper_machine):
        table = paper_machine.mesh_table()
        pitch = paper_machine.pair.base_pitch
        roll = pitch * (np.arange(20000) + 0.5) / 20000
        n_carrying = (at(table, roll, 925.0).load > 0).sum(axis=1)

        assert set(n_carrying.tolist()) == {1, 2}

        ratio = paper_machine.pair.transverse_contact_ratio
        assert_close(n_carrying.mean(), ratio, atol=1e-4)

    def test_the_one_sided_law_keeps_pairs_longer(self, xiamen):
        roll = xiamen.pair.base_pitch * (np.arange(2000) + 0.5) / 2000
        n_carrying = (at(xiamen.mesh_table(), roll, 925.0).load > 0).sum(axis=1)
        assert n_carrying.mean() > xiamen.pair.transverse_contact_ratio + 0.01

    def test_no_pair_no_stiffness(self, paper_machine):
        missing = fault("missing_tooth", tooth=0)
        curves = paper_machine.stiffness_curves((missing,), points_per_tooth=200)
        lost = np.mean(curves.mesh_stiffness <= 0) * 23
        expected = 2 - paper_machine.pair.transverse_contact_ratio
        assert_close(lost, expected, atol=0.01)
