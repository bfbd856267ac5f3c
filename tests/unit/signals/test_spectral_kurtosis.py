"""Spectral kurtosis of signals whose value is known in every line."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.spectral_kurtosis import spectral_kurtosis

RATE, N_SAMPLES, WINDOW = 10_000.0, 100_000, 100
TIME = np.arange(N_SAMPLES) / RATE


def noise(seed=0, shape=()):
    return np.random.default_rng(seed).standard_normal((*shape, N_SAMPLES))


def kurtosis_of(signal, window=WINDOW):
    return spectral_kurtosis(signal, RATE, window)


@pytest.mark.parametrize("window", [65, 500])
def test_gaussian_noise_is_zero_in_every_line_and_scatters_as_stated(window):
    frequency, kurtosis = kurtosis_of(
        noise(shape=(20,)),
        window,
    )
    assert kurtosis.shape == (20, frequency.size)

    line = RATE / window
    assert frequency[0] >= 1.998 * line
    assert frequency[-1] <= RATE / 2 - 1.998 * line

    spread = 1.2 * np.sqrt(window / N_SAMPLES)
    assert_allclose(np.std(kurtosis), spread, rtol=0.15)

    bias = -1.5 * window / N_SAMPLES
    most = 5 * spread / np.sqrt(20)
    assert_allclose(
        kurtosis.mean(axis=0),
        bias,
        atol=most,
    )


def test_a_tone_is_minus_one():
    frequency, kurtosis = kurtosis_of(np.cos(2 * np.pi * 2500 * TIME))
    assert_allclose(kurtosis[frequency == 2500.0], -1.0, atol=1e-9)


def test_noise_switched_on_for_a_share_of_the_time():
    """Gaussian noise whose power A is random: 2 <A^2> / <A>^2 - 2, but for the windows that see
    both states."""
    share, period = 0.2, 5000
    is_on = np.arange(N_SAMPLES) % period < share * period
    _, kurtosis = kurtosis_of(noise(1) * is_on)
    assert_allclose(
        kurtosis.mean(),
        2 / share - 2,
        rtol=0.05,
    )


def test_gain_does_not_matter_and_silence_is_nan():
    loud, quiet, silent = (kurtosis_of(gain * noise(3))[1] for gain in (1, 1e-4, 0))
    assert_allclose(quiet, loud, atol=1e-9)
    assert np.isnan(silent).all()


@pytest.mark.parametrize(
    ("n_samples", "window"),
    [(100, 7), (199, 100)],
)
def test_windows_that_do_not_suit_are_refused(n_samples, window):
    with refused("does not suit", ValueError):
        spectral_kurtosis(np.ones(n_samples), RATE, window)
