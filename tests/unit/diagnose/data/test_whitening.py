"""Laws of whitened turns: no loudness, no resonance, and they turn with the gear."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnose.data.whitening import whitened_turns
from gensig.signals.separation import GearTurns

TEETH, PER_TOOTH = (23, 57), 64


def random_turns(seed=0, n_channels=2):
    """White turns whose teeth are zero in the mean."""
    rng = np.random.default_rng(seed)
    driving, driven = (
        rng.standard_normal((n_channels, teeth, PER_TOOTH)) for teeth in TEETH
    )
    return GearTurns(
        driving=(driving - driving.mean(axis=1, keepdims=True)).reshape(n_channels, -1),
        driven=(driven - driven.mean(axis=1, keepdims=True)).reshape(n_channels, -1),
        mesh=rng.standard_normal((n_channels, PER_TOOTH)),
    )


def ringing(values, order=12.0, damping=0.1):
    """Periodic values through a resonance at a mesh order."""
    n_samples = values.shape[-1]
    lag = np.exp(-2j * np.pi * np.fft.rfftfreq(n_samples))
    angle = 2 * np.pi * order / PER_TOOTH
    radius = np.exp(-damping * angle)
    response = 1 / (1 - 2 * radius * np.cos(angle) * lag + radius**2 * lag**2)
    return np.fft.irfft(np.fft.rfft(values) * response, n_samples)


def each(turns, function):
    return GearTurns(
        driving=function(turns.driving),
        driven=function(turns.driven),
        mesh=function(turns.mesh),
    )


def pairs(first, second):
    """Arrays of two sets of turns, part by part."""
    return [
        (getattr(first, name), getattr(second, name))
        for name in ("driving", "driven", "mesh")
    ]


@pytest.mark.parametrize("order", [6.0, 12.0, 20.0])
def test_a_resonance_is_taken_away(order):
    turns = random_turns()
    ringing_turns = each(turns, lambda values: ringing(values, order))
    assert np.corrcoef(turns.driven[0], ringing_turns.driven[0])[0, 1] < 0.7
    for sound, rang in pairs(whitened_turns(turns), whitened_turns(ringing_turns)):
        for a, b in zip(sound, rang, strict=True):
            assert np.corrcoef(a, b)[0, 1] > 0.9


def test_the_spectrum_is_flat_afterwards():
    rang = whitened_turns(each(random_turns(), ringing))
    power = np.square(np.abs(np.fft.rfft(rang.driven)))[..., 1:]
    bands = power[..., : 30 * TEETH[1]].reshape(2, 30, -1).mean(axis=-1)
    assert bands.max() / bands.min() < 1.5


def test_loudness_does_not_count():
    turns = random_turns()
    louder = each(turns, lambda values: 300.0 * values)
    for soft, loud in pairs(whitened_turns(turns), whitened_turns(louder)):
        assert_allclose(loud, soft)


def test_they_turn_with_the_gear():
    turns, teeth = random_turns(), 5
    rolled = each(turns, lambda values: np.roll(values, teeth * PER_TOOTH, axis=-1))
    for here, there in pairs(whitened_turns(turns), whitened_turns(rolled)):
        expected = np.roll(here, teeth * PER_TOOTH, axis=-1)
        assert_allclose(there, expected, rtol=1e-6, atol=1e-12)


def test_channels_are_whitened_each_by_itself():
    turns = random_turns()
    alone = each(turns, lambda values: values[1:])
    for both, one in pairs(whitened_turns(turns), whitened_turns(alone)):
        assert_allclose(both[1:], one)


def test_silence_stays_silent():
    silent = each(random_turns(), np.zeros_like)
    for quiet, nothing in pairs(whitened_turns(silent), silent):
        assert_allclose(quiet, nothing, atol=0)
