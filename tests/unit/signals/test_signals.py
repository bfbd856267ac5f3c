"""Indicators, averages, spectra and envelopes against closed forms."""

from math import tau

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.averaging import (
    resample_to_angle,
    samples_per_turn_for,
    time_synchronous_average,
)
from gensig.signals.envelope import band_pass, envelope, envelope_spectrum
from gensig.signals.indicators import crest_factor, kurtosis, rms, sideband_ratio
from gensig.signals.spectrum import amplitude_spectrum, order_spectrum

RATE = 51200.0
TIME = np.arange(51200) / RATE
TURN = np.arange(2048) / 2048 * tau


def sine(frequency, amplitude=1.0, time=TIME):
    return amplitude * np.sin(tau * frequency * time + 0.3)


class TestIndicators:
    def test_sine(self):
        x = np.stack([sine(100.0, 2.0), sine(200.0, 5.0)])
        assert_allclose(
            rms(x),
            [2 / np.sqrt(2), 5 / np.sqrt(2)],
        )
        assert_allclose(kurtosis(x + 3.0), [1.5, 1.5])
        assert_allclose(
            crest_factor(x),
            [np.sqrt(2)] * 2,
            rtol=1e-4,
        )

    def test_one_pulse(self):
        pulse = np.zeros(1000)
        pulse[7] = 3.0
        p = 1 / 1000
        exact = (1 - 3 * p + 3 * p**2) / (p * (1 - p))

        assert_allclose(kurtosis(pulse), exact)
        assert_allclose(crest_factor(pulse), np.sqrt(1000))

    def test_constant_signal_gives_nan(self):
        assert np.isnan(kurtosis(np.zeros(8)))
        assert np.isnan(crest_factor(np.zeros(8)))

    def test_sideband_ratio_of_amplitude_modulation(self):
        depth = 0.4
        turn = (1 + depth * np.cos(TURN)) * np.cos(23 * TURN)
        assert_allclose(sideband_ratio(turn, 23, n_harmonics=1), depth)

        turn += 0.5 * np.cos(46 * TURN)
        assert_allclose(
            sideband_ratio(turn, 23, n_harmonics=2),
            depth / 1.5,
        )


class TestAveraging:
    def test_stated_interpolation_errors(self):
        for share, bound in ((8, 1.2e-3), (6, 4e-3), (4, 2.5e-2)):
            turns = resample_to_angle(
                sine(RATE / share),
                RATE,
                17.3,
                4096,
            )
            position = np.arange(turns.size) / 4096 / 17.3
            error = turns.ravel() - sine(RATE / share, time=position)
            assert bound / 2 < np.abs(error[4096:-4096]).max() < bound
        shape = resample_to_angle(TIME, RATE, 17.3).shape
        assert shape == (17, samples_per_turn_for(RATE, 17.3))

    def test_average_keeps_what_repeats_and_its_noise_falls_with_the_root_of_the_turns(
        self,
    ):
        noise = np.random.default_rng(5).standard_normal(TIME.size)
        mesh = sine(23 * 25.0)
        noisy, clean, wrong = (
            time_synchronous_average(signal, RATE, speed)
            for signal, speed in ((mesh + noise, 25.0), (mesh, 25.0), (mesh, 26.0))
        )

        assert_allclose(
            rms(clean),
            1 / np.sqrt(2),
            rtol=1e-4,
        )
        assert_allclose(
            rms(noisy - clean),
            1 / np.sqrt(25),
            rtol=0.05,
        )
        assert rms(wrong) < 0.1

    def test_too_short_for_a_turn(self):
        with refused("no whole turn", ValueError):
            resample_to_angle(np.zeros(100), RATE, 10.0)


class TestSpectra:
    @pytest.mark.parametrize("window", ["hann", "boxcar"])
    def test_amplitude_of_a_sine_and_of_the_mean(self, window):
        signal = 2.0 + sine(640.0, 3.0)
        frequency, amplitude = amplitude_spectrum(signal, RATE, window=window)
        assert_allclose(amplitude[0], 2.0, rtol=1e-3)
        assert_allclose(amplitude[frequency == 640.0], 3.0)
        assert frequency[-1] == RATE / 2

    def test_nyquist_bin_is_not_doubled(self):
        _, amplitude = amplitude_spectrum(
            [1.0, -1.0] * 32,
            RATE,
            window="boxcar",
        )
        assert_allclose(amplitude[-1], 1.0)

    def test_order_spectrum_places_the_mesh_on_its_order(self):
        order, amplitude = order_spectrum(
            sine(23 * 31.7, 2.0),
            RATE,
            31.7,
        )
        peak = np.argmax(amplitude)
        assert_allclose(order[peak], 23.0)
        assert_allclose(amplitude[peak], 2.0, rtol=1e-3)


class TestEnvelope:
    MODULATION = 1 + 0.5 * np.cos(tau * 30 * TIME)
    CARRIED = MODULATION * np.cos(tau * 5000 * TIME)

    def test_envelope_of_a_modulated_carrier(self):
        assert_allclose(
            envelope(self.CARRIED, RATE),
            self.MODULATION,
            atol=1e-9,
        )

    def test_envelope_spectrum_finds_the_rate_in_its_band_only(self):
        x = self.CARRIED + sine(700.0, 4.0)
        frequency, amplitude = envelope_spectrum(x, RATE, (4000.0, 6000.0))
        assert frequency[np.argmax(amplitude)] == 30.0
        assert_allclose(amplitude.max(), 0.5, rtol=1e-2)

        _, elsewhere = envelope_spectrum(x, RATE, (600.0, 800.0))
        assert elsewhere[30] < 0.02

    def test_band_outside_the_spectrum(self):
        with refused("must lie inside", ValueError):
            band_pass(TIME, RATE, (1000.0, 26000.0))
