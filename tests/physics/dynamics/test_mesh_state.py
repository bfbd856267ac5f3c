"""What is told of the teeth at every sample: loads balance, teeth follow one another, faults show where they are."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.dynamics.mesh_state import NO_TOOTH
from gensig.faults.broken import MissingTooth
from gensig.faults.crack import Crack
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.pair_table import N_PAIRS
from gensig.sensing.chain import detectability
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.run import Run

RATE = 51200.0
QUICK = {"operating.duration_s": 0.1, "solver.max_error": None}
MISSING = (MissingTooth(gear="pinion", tooth=3),)
CRACK = (
    Crack(
        gear="wheel",
        tooth=5,
        crack_depth=1e-3,
        crack_angle=np.pi / 4,
        crack_start="arc_mid",
    ),
)
LAWS = {"one_sided": {}, "paper": {"mesh.law": "paper"}}


@pytest.fixture(scope="module")
def record(machine):
    def simulated(changes=None, faults=(), **other):
        run = Run(
            system=machine({**QUICK, **(changes or {})}),
            faults=tuple(faults),
            tell_mesh=True,
            **other,
        )
        (found,) = simulate_together([run])
        return found

    return simulated


@pytest.fixture(scope="module", params=LAWS)
def sound(record, request):
    return record(LAWS[request.param])


def starts(rows):
    """Where a tooth takes up its load, (pair, sample - 1)."""
    return (rows[:, 1:] != NO_TOOTH) & (rows[:, :-1] == NO_TOOTH)


def test_shares_of_the_loaded_teeth_are_all_of_the_load(sound):
    mesh = sound.mesh
    assert (
        mesh.load_share.shape
        == mesh.pinion_tooth.shape
        == mesh.wheel_tooth.shape
        == (N_PAIRS, 5120)
    )
    assert_allclose(mesh.load_share.sum(axis=0), 1.0, rtol=0, atol=1e-12)
    assert ((mesh.pinion_tooth == NO_TOOTH) == (mesh.load_share == 0.0)).all()
    assert ((mesh.wheel_tooth == NO_TOOTH) == (mesh.load_share == 0.0)).all()
    assert not mesh.contact_lost.any()
    assert not mesh.fault_engaged.any()


def test_the_force_carries_the_torque(sound, machine):
    """0.3 % more than the drive's, by what friction takes on its way."""
    assert_allclose(sound.mesh.force.mean(), machine().mesh_force, rtol=5e-3, atol=0)


def test_teeth_follow_one_another_and_keep_their_place(sound, machine):
    n_teeth = machine().pair.pinion.n_teeth
    for rows in (sound.mesh.pinion_tooth, sound.mesh.wheel_tooth):
        place, sample = np.nonzero(starts(rows))
        order = np.argsort(sample, kind="stable")
        place, teeth = place[order], rows[place[order], sample[order] + 1]
        assert len(teeth) > n_teeth
        assert (
            np.diff(teeth) % (n_teeth if rows is sound.mesh.pinion_tooth else 84) == 1
        ).all()
        assert (np.diff(place) % N_PAIRS == 1).all()


def test_pinion_and_wheel_teeth_stay_in_step(sound):
    mesh, loaded = sound.mesh, sound.mesh.pinion_tooth != NO_TOOTH
    apart = mesh.pinion_tooth.astype(int) - mesh.wheel_tooth
    assert (apart[loaded] % math.gcd(23, 84) == 0).all()
    sample = np.flatnonzero(loaded[0])[0]
    assert mesh.pinion_tooth[0, sample] == mesh.wheel_tooth[0, sample] % 23


def test_slowly_turned_the_shares_are_the_static_ones(record, machine):
    changes = {"operating.speed_rpm": 60, "operating.duration_s": 0.05}
    system, found = machine({**QUICK, **changes}), record(changes)
    dynamics = pair_dynamics(Run(system=system, faults=()))
    roll = dynamics.start_roll + system.pair.pinion.base_radius * found.shaft_angle
    static = static_mesh(
        dynamics.table, pair_states(dynamics.table, roll), dynamics.mesh_force
    )
    expected = np.sort(static.load / static.load.sum(axis=1, keepdims=True), axis=1).T
    found_shares = np.sort(found.mesh.load_share, axis=0)
    assert_allclose(found_shares.mean(axis=1), expected.mean(axis=1), rtol=0, atol=3e-3)
    off = np.abs(found_shares - expected).max(axis=0)
    assert np.quantile(off, 0.95) < 0.03


def test_a_missing_tooth_carries_nothing_and_still_has_its_time(record):
    mesh = record(faults=MISSING).mesh
    assert 3 not in mesh.pinion_tooth
    engaged = np.flatnonzero(np.diff(mesh.fault_engaged.astype(int)) == 1)
    assert_allclose(np.diff(engaged) / RATE, 60 / 1800, rtol=2e-3, atol=0)
    # from A to E: the contact ratio in base pitches
    assert_allclose(mesh.fault_engaged.mean() * 23, 1.71, rtol=0.05, atol=0)


def test_a_fault_is_engaged_when_its_tooth_carries(record):
    mesh = record({"operating.duration_s": 0.4}, faults=CRACK).mesh
    assert (mesh.fault_engaged[(mesh.wheel_tooth == 5).any(axis=0)]).all()
    assert (
        0.8
        < (mesh.wheel_tooth == 5).any(axis=0).sum() / mesh.fault_engaged.sum()
        <= 1.0
    )


def test_lost_contact_is_that_of_the_record(record):
    """Samples are one in five of the steps that the fraction counts."""
    found = record(
        {"operating.speed_rpm": 6000, "operating.torque_nm": 2}, faults=MISSING
    )
    assert found.contact_loss_fraction > 0.01
    assert_allclose(
        found.mesh.contact_lost.mean(), found.contact_loss_fraction, rtol=0, atol=2e-3
    )
    assert (found.mesh.load_share[:, found.mesh.contact_lost] == 0.0).all()


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_nothing_changes_by_being_told(machine, precision):
    run = Run(system=machine({**QUICK, "solver.precision": precision}), faults=MISSING)
    (plain,), (told,) = (
        simulate_together([run]),
        simulate_together([replace(run, tell_mesh=True)]),
    )
    assert plain.mesh is None
    assert told.acceleration.tobytes() == plain.acceleration.tobytes()


class TestDetectability:
    def test_is_the_root_of_energy_over_noise(self):
        residual = np.array([[3.0, 0.0, 4.0], [0.0, 2.0, 0.0]])
        assert_allclose(
            detectability(residual, np.array([25.0, 1.0])),
            math.sqrt(1.0 + 4.0),
            rtol=1e-12,
            atol=0,
        )

    def test_is_what_a_matched_filter_reaches(self):
        """Share of right answers of the best detector among records with and without the residual."""
        rng, noise = np.random.default_rng(3), np.array([0.5, 2.0])
        residual = 0.05 * rng.standard_normal((2, 400))
        template = residual / noise[:, None]
        threshold = 0.5 * (template * residual).sum()
        scores = [
            [
                (
                    template
                    * (
                        there * residual
                        + np.sqrt(noise)[:, None] * rng.standard_normal((2, 400))
                    )
                ).sum()
                for _ in range(4000)
            ]
            for there in (0, 1)
        ]
        right = 0.5 * (
            np.mean(np.array(scores[0]) < threshold)
            + np.mean(np.array(scores[1]) > threshold)
        )
        half = 0.5 * detectability(residual, noise)
        assert_allclose(
            right, 0.5 * (1.0 + math.erf(half / math.sqrt(2.0))), rtol=0, atol=0.02
        )

    def test_without_noise_there_is_none(self):
        assert math.isnan(detectability(np.ones((1, 4)), np.zeros(1)))
