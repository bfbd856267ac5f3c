"""Turns of a recording less what sound recordings of the same machine make of them."""

import numpy as np
import pytest

from gensig.signals.alignment import changed_turns
from gensig.signals.separation import GearTurns

TEETH, SAMPLES = (13, 20), 16
BEGIN = (37, 101)  # samples by which the sound recordings begin later
FAULT = slice(5 * SAMPLES, 6 * SAMPLES)  # tooth of the driving gear


def turns_of(seed=5):
    """Random deviations of the teeth of a pair of gears (2 channels)."""
    rng = np.random.default_rng(seed)
    driving, driven, mesh = (
        rng.standard_normal((2, teeth * SAMPLES)) for teeth in (*TEETH, 1)
    )
    return GearTurns(driving=driving, driven=driven, mesh=mesh)


def elsewhere(turns, decay=2.0):
    """The same gears through another transfer, begun at another place."""
    response = np.exp(-np.arange(12) / decay)

    def heard(turn, begin):
        transfer = np.fft.rfft(response, turn.shape[-1])
        later = np.roll(turn, -begin, axis=-1)
        return np.fft.irfft(np.fft.rfft(later) * transfer, turn.shape[-1])

    return GearTurns(
        driving=heard(turns.driving, BEGIN[0]),
        driven=heard(turns.driven, BEGIN[1]),
        mesh=turns.mesh,
    )


def level(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize("decays", [(2.0,), (2.0, 4.0)])
@pytest.mark.parametrize("gear", ["driving", "driven"])
def test_another_transfer_and_begin_change_nothing(gear, decays):
    turns = turns_of()
    changed = changed_turns(turns, [elsewhere(turns, decay) for decay in decays])
    assert level(getattr(changed, gear)) < 0.02 * level(getattr(turns, gear))


def test_other_gears_explain_little():
    turns = turns_of()
    changed = changed_turns(turns, [elsewhere(turns_of(seed=6))])
    assert level(changed.driven) > 0.8 * level(turns.driven)


def test_a_fault_is_left_at_its_tooth_in_every_channel():
    sound = turns_of()
    fault = np.zeros_like(sound.driving)
    fault[:, FAULT] = np.random.default_rng(1).standard_normal((2, SAMPLES))
    turns = GearTurns(
        driving=sound.driving + fault, driven=sound.driven, mesh=sound.mesh
    )
    changed = changed_turns(turns, [elsewhere(sound)]).driving
    by_tooth = np.square(changed).reshape(2, TEETH[0], SAMPLES).sum(axis=-1)
    assert (by_tooth.argmax(axis=1) == FAULT.start // SAMPLES).all()
    assert (by_tooth.max(axis=1) > 3 * np.median(by_tooth, axis=1)).all()


def test_channels_are_predicted_alone_whatever_their_level():
    turns = turns_of()
    sound = elsewhere(turns_of(seed=6))
    gain = np.array([[1.0], [1000.0]])
    louder = GearTurns(
        driving=gain * turns.driving, driven=gain * turns.driven, mesh=turns.mesh
    )
    changed, of_louder = changed_turns(turns, [sound]), changed_turns(louder, [sound])
    np.testing.assert_allclose(
        of_louder.driving, gain * changed.driving, rtol=1e-9, atol=1e-9
    )


def test_the_mean_passage_stays():
    turns = turns_of()
    assert changed_turns(turns, [elsewhere(turns)]).mesh is turns.mesh


def test_a_silent_sound_recording_explains_nothing():
    turns = turns_of()
    silent = GearTurns(
        driving=np.zeros_like(turns.driving),
        driven=np.zeros_like(turns.driven),
        mesh=np.zeros_like(turns.mesh),
    )
    changed = changed_turns(turns, [silent])
    np.testing.assert_allclose(changed.driving, turns.driving, rtol=0, atol=1e-12)
