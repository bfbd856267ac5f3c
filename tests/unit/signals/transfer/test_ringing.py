"""Ringing of a housing that repeats at one frequency, whatever the speed, and its removal."""

import numpy as np
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.alignment import changed_turns
from gensig.signals.separation import GearTurns
from gensig.signals.transfer.ringing import without_ringing

RATE, TEETH, PER_TOOTH = 12800.0, (23, 40), 16
FREQUENCIES = (410.0, 487.0, 560.0)  # of the mesh, Hz
MODES = ((900.0, 0.01), (2300.0, 0.02))  # Hz, damping ratio


def housing(frequency):
    answer = 0j
    for mode, damping in MODES:
        answer += mode**2 / (mode**2 - frequency**2 + 2j * damping * mode * frequency)
    return answer


def gears(seed=0):
    """Deviations of teeth, (channel, sample) a gear, that are the same at every speed."""
    rng = np.random.default_rng(seed)
    turns = []
    for teeth in TEETH:
        turn = rng.standard_normal((2, teeth * PER_TOOTH))
        spectrum = np.fft.rfft(turn)
        spectrum[:, ::teeth] = 0.0
        turns.append(np.fft.irfft(spectrum, n=turn.shape[-1]))
    return turns


def heard(turns, mesh_frequency, path=housing):
    """Turns behind a housing at one speed."""
    through = []
    for turn, teeth in zip(turns, TEETH, strict=True):
        frequency = np.arange(turn.shape[-1] // 2 + 1) * mesh_frequency / teeth
        answer = np.where(frequency < RATE / 2, path(frequency), 0.0)
        through.append(np.fft.irfft(np.fft.rfft(turn) * answer, n=turn.shape[-1]))
    mesh = np.zeros((2, PER_TOOTH))
    return GearTurns(driving=through[0], driven=through[1], mesh=mesh)


def recordings(path=housing):
    return [heard(gears(), frequency, path) for frequency in FREQUENCIES]


def left(turns):
    """Share of the first recording's turns that the others do not predict."""
    first, *others = turns
    new = changed_turns(first, others)
    return np.array(
        [
            np.var(new.driving) / np.var(first.driving),
            np.var(new.driven) / np.var(first.driven),
        ]
    )


def test_recordings_at_other_speeds_predict_a_recording_once_the_ringing_is_gone():
    ringing = recordings()
    assert (left(ringing) > 0.3).all()
    assert (left(without_ringing(ringing, FREQUENCIES, RATE)) < 0.1).all()


def test_what_rings_at_an_order_of_the_gears_stays():
    """It is the gears' own; taken away at the speed of one recording it would be in the others."""
    ringing = recordings()
    clean = without_ringing(ringing, FREQUENCIES, RATE)
    for before, turns in zip(gears(), (clean[0].driving, clean[0].driven), strict=True):
        alike = np.corrcoef(before.ravel(), turns.ravel())[0, 1]
        assert alike > 0.7


def test_the_level_of_a_recording_decides_nothing_but_its_own():
    ringing = recordings()
    louder = [
        GearTurns(driving=5 * each.driving, driven=5 * each.driven, mesh=5 * each.mesh)
        for each in ringing[:1]
    ]
    plain = without_ringing(ringing, FREQUENCIES, RATE)
    scaled = without_ringing([*louder, *ringing[1:]], FREQUENCIES, RATE)
    assert_allclose(scaled[0].driving, 5 * plain[0].driving, rtol=1e-9)
    assert_allclose(scaled[1].driven, plain[1].driven, rtol=1e-9, atol=1e-12)


def test_silent_turns_stay_silent_and_none_are_refused():
    silent = GearTurns(
        driving=np.zeros((1, 23 * PER_TOOTH)),
        driven=np.zeros((1, 40 * PER_TOOTH)),
        mesh=np.zeros((1, PER_TOOTH)),
    )
    (same,) = without_ringing([silent], [410.0], RATE)
    assert not same.driving.any()
    with refused("at least one", ValueError):
        without_ringing([], [], RATE)
