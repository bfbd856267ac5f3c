"""The two-evaluation core: independent lanes, and calls of any length, under every law."""

import numpy as np
import pytest
from core_runs import MISSING, PAPER, CoreRun

from gensig import load_system
from gensig.dynamics.backends.nystroem.machine_lanes import is_followed_by_three
from gensig.dynamics.backends.nystroem.method import ANY_LAW, THREE_PAIRS
from gensig.faults.broken import MissingTooth
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run

N_STEPS = 1500
CUTS = [(1, 2, 497, 1000), (751, 0, 749), (255, 1, 1, 254, 1, 988)]
SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
SPEEDS = 1800, 2500, 1300, 900
TORQUES = 20, 2, 5, 60
# core and steps per sample
KINDS = {
    "three": (THREE_PAIRS, 5),
    "paper": (ANY_LAW, 16),
    "helical": (ANY_LAW, 16),
}


def helical(speed, torque, faults):
    """A helical pair of tens of micrometres, so that its chords change."""
    words = [f"{SPEED}={speed}", f"{TORQUE}={5 * torque}", "mesh.n_slices=10"]
    system = load_system("experiment=helical", *words)
    return running_pair(Run(system=system, faults=faults)).dynamics


@pytest.fixture(scope="module")
def machines(machine, dynamics_of):
    """Four machines of a kind, sound and faulty, of many speeds and torques."""
    made = {}
    for kind in KINDS:
        lanes = []
        for k, (speed, torque) in enumerate(zip(SPEEDS, TORQUES, strict=True)):
            if kind == "helical":
                faults = (MissingTooth(gear="pinion", tooth=3),) * (k % 2)
                lanes.append(helical(speed, torque, faults))
                continue
            changes = {SPEED: speed, TORQUE: torque}
            faults = MISSING * (k % 2)
            if kind == "paper":
                changes, faults = {**changes, **PAPER}, ()
            lanes.append(dynamics_of(machine(changes), faults, phase=0.1 * k))
        made[kind] = lanes
    return made


def core_run(machines, kind, **options):
    """Machines of a kind side by side."""
    core, per_sample = KINDS[kind]
    return CoreRun(machines, 1 / (51200 * per_sample), core=core, **options)


def motion(machines, kind, pieces):
    """State, means over the steps, lost steps."""
    run = core_run(machines, kind)
    means = [run.means(n_steps) for n_steps in pieces]
    return run.whole, np.concatenate(means), run.lost


@pytest.fixture(scope="module")
def whole(machines):
    return {kind: motion(machines[kind], kind, (N_STEPS,)) for kind in KINDS}


def test_meshes_that_the_core_of_three_pairs_leaves(machines):
    assert all(is_followed_by_three(*each.teeth) for each in machines["three"])
    for kind in ("paper", "helical"):
        assert not any(is_followed_by_three(*each.teeth) for each in machines[kind])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pieces", CUTS)
def test_pieces_make_the_whole(machines, whole, kind, pieces):
    parts = motion(machines[kind], kind, pieces)
    assert np.isfinite(whole[kind][1]).all()
    assert whole[kind][1].std() > 0.0
    assert [part.tobytes() for part in parts] == [
        part.tobytes() for part in whole[kind]
    ]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lane", [0, 3])
def test_a_lane_does_not_see_the_others(machines, whole, kind, lane):
    state, means, lost = motion([machines[kind][lane]], kind, (N_STEPS,))
    expected = whole[kind]
    assert state[..., 0].tobytes() == expected[0][..., lane].tobytes()
    assert means[..., 0].tobytes() == expected[1][..., lane].tobytes()
    assert lost[0, 0] == expected[2][0, lane]


@pytest.mark.parametrize("kind", KINDS)
def test_a_lane_that_begins_later_is_as_fresh(machines, whole, kind):
    """Another lane restarts, which the first does not see; it moves as from the start."""
    run = core_run(machines[kind], kind)
    run.means(700)
    run.restart(3)
    restarted = run.means(N_STEPS - 700)
    assert restarted[:, :, 0].tobytes() == whole[kind][1][700:, :, 0].tobytes()

    late = core_run([machines[kind][3]], kind, first_step=700)
    assert late.means(500)[..., 0].tobytes() == restarted[:500, :, 3].tobytes()
