"""Turns of two recordings of one machine, begun at different teeth, are brought together."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from gensig.signals.alignment import aligned_turns, rotation
from gensig.signals.separation import GearTurns

TEETH, SAMPLES = (7, 12), 16


def turns_of(seed, noise=0.0):
    """Random turns of a pair of gears (2 channels)."""
    gears, own = np.random.default_rng(5), np.random.default_rng(seed)
    parts = [gears.standard_normal((2, z * SAMPLES)) for z in (*TEETH, 1)]
    noisy = [part + noise * own.standard_normal(part.shape) for part in parts]
    return GearTurns(driving=noisy[0], driven=noisy[1], mesh=noisy[2])


def begun_later(turns, driving, driven):
    return GearTurns(
        driving=np.roll(turns.driving, -driving, axis=-1),
        driven=np.roll(turns.driven, -driven, axis=-1),
        mesh=np.roll(turns.mesh, -driving, axis=-1),
    )


@pytest.mark.parametrize(("driving", "driven"), [(0, 0), (3, 3), (37, 101), (99, 5)])
def test_another_begin_is_undone(driving, driven):
    turns = turns_of(0)
    back = aligned_turns(begun_later(turns, driving, driven), turns)
    for name in ("driving", "driven", "mesh"):
        assert_array_equal(getattr(back, name), getattr(turns, name))


def test_noise_and_gain_of_each_channel_leave_the_rotation():
    turns, other = turns_of(1, noise=1.0), turns_of(2, noise=1.0)
    gain = np.array([[100.0], [0.01]])
    assert rotation(gain * np.roll(other.driven, 40, axis=-1), turns.driven) == 40


def test_a_silent_channel_counts_for_nothing():
    turns = turns_of(0)
    silent = turns.driving.copy()
    silent[0] = 0.0
    assert rotation(np.roll(silent, 9, axis=-1), turns.driving) == 9
