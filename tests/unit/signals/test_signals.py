"""Indicators, averages, spectra and envelopes against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.signals.averaging import (
    difference_signal,
    remove_orders,
    resample_to_angle,
    residual_signal,
    samples_per_turn_for,
    time_synchronous_average,
)
from gensig.signals.envelope import band_pass, envelope, envelope_spectrum
from gensig.signals.indicators import crest_factor, fm4, kurtosis, rms, sideband_ratio
from gensig.signals.spectrum import amplitude_spectrum, order_spectrum

RATE = 51200.0
TIME = np.arange(51200) / RATE
TURN = np.arange(2048) / 2048 * 2 * np.pi


def sine(frequency, amplitude=1.0, time=TIME):
    return amplitude * np.sin(2 * np.pi * frequency * time + 0.3)


class TestIndicators:
    def test_sine(self):
        x = np.stack([sine(100.0, 2.0), sine(200.0, 5.0)])
        assert_allclose(rms(x), [2 / np.sqrt(2), 5 / np.sqrt(2)], rtol=1e-12)
        assert_allclose(kurtosis(x), [1.5, 1.5], rtol=1e-10)
        assert_allclose(crest_factor(x), [np.sqrt(2)] * 2, rtol=1e-4)

    def test_two_point_and_pulse_distributions(self):
        assert_allclose(kurtosis([1.0, -1.0] * 8), 1.0, rtol=1e-12)
        pulse = np.zeros(1000)
        pulse[7] = 3.0
        p = 1 / 1000
        assert_allclose(
            kurtosis(pulse), (1 - 3 * p + 3 * p**2) / (p * (1 - p)), rtol=1e-9
        )
        assert_allclose(crest_factor(pulse), np.sqrt(1000), rtol=1e-12)

    def test_gaussian_noise_has_kurtosis_three(self):
        x = np.random.default_rng(1).standard_normal(400_000)
        assert_allclose(kurtosis(x), 3.0, atol=5 * np.sqrt(24 / x.size))

    def test_kurtosis_ignores_gain_and_offset_but_rms_does_not(self):
        x = np.random.default_rng(2).standard_normal(1000)
        assert_allclose(kurtosis(7 * x + 3), kurtosis(x), rtol=1e-10)
        assert rms(7 * x) == pytest.approx(7 * rms(x))

    def test_constant_signal_gives_nan(self):
        assert np.isnan(kurtosis(np.zeros(8)))
        assert np.isnan(crest_factor(np.zeros(8)))

    def test_fm4_rises_with_one_bad_tooth_under_a_strong_mesh(self):
        mesh = 10 * np.cos(23 * TURN)
        noise = 0.1 * np.random.default_rng(4).standard_normal(TURN.size)
        impulse = np.exp(-(((TURN - 2.0) / 0.02) ** 2))
        assert fm4(mesh + noise, 23) == pytest.approx(3.0, abs=0.5)
        assert fm4(mesh + noise + impulse, 23) > 6
        assert kurtosis(mesh + noise + impulse) < 2

    def test_sideband_ratio_of_amplitude_modulation(self):
        depth = 0.4
        turn = (1 + depth * np.cos(TURN)) * np.cos(23 * TURN)
        assert_allclose(sideband_ratio(turn, 23, n_harmonics=1), depth, rtol=1e-9)
        turn += 0.5 * np.cos(46 * TURN)
        assert_allclose(sideband_ratio(turn, 23, n_harmonics=2), depth / 1.5, rtol=1e-9)

    def test_sideband_ratio_needs_the_mesh_order(self):
        with pytest.raises(ValueError, match="mesh order 23"):
            sideband_ratio(np.ones(32), 23)


class TestAveraging:
    def test_resampling_is_exact_to_the_spline(self):
        frequency = 17.3
        turns = resample_to_angle(sine(40 * frequency), RATE, frequency)
        n_turns, per_turn = turns.shape
        angle = (
            np.arange(n_turns * per_turn).reshape(turns.shape) / per_turn * 2 * np.pi
        )
        inner = slice(1, -1)
        assert n_turns == 17
        assert per_turn == samples_per_turn_for(RATE, frequency)
        assert_allclose(turns[inner], np.sin(40 * angle + 0.3)[inner], atol=1e-5)

    def test_stated_interpolation_errors(self):
        for share, bound in ((8, 1.2e-3), (6, 4e-3), (4, 2.5e-2)):
            turns = resample_to_angle(sine(RATE / share), RATE, 17.3, 4096)
            position = np.arange(turns.size) / 4096 / 17.3
            error = np.abs(turns.ravel() - sine(RATE / share, time=position))[
                4096:-4096
            ].max()
            assert bound / 2 < error < bound

    def test_average_keeps_what_repeats_and_halves_the_noise_for_four_times_the_turns(
        self,
    ):
        frequency, rng = 25.0, np.random.default_rng(5)
        noise = rng.standard_normal(TIME.size)
        average = time_synchronous_average(
            sine(23 * frequency) + noise, RATE, frequency
        )
        clean = time_synchronous_average(sine(23 * frequency), RATE, frequency)
        assert_allclose(rms(clean), 1 / np.sqrt(2), rtol=1e-4)
        assert_allclose(rms(average - clean), 1 / np.sqrt(25), rtol=0.05)

    def test_average_at_the_wrong_speed_loses_the_mesh(self):
        average = time_synchronous_average(sine(23 * 25.0), RATE, 26.0)
        assert rms(average) < 0.1

    def test_too_short_for_a_turn(self):
        with pytest.raises(ValueError, match="no whole turn"):
            resample_to_angle(np.zeros(100), RATE, 10.0)

    def test_residual_and_difference(self):
        mesh = 3 * np.cos(23 * TURN) + 2 * np.sin(46 * TURN) + 1.0 + np.cos(TURN)
        sideband, other = 0.5 * np.cos(24 * TURN), 0.2 * np.cos(30 * TURN)
        assert_allclose(
            residual_signal(mesh + sideband + other, 23), sideband + other, atol=1e-9
        )
        assert_allclose(
            difference_signal(mesh + sideband + other, 23), other, atol=1e-9
        )
        assert_allclose(remove_orders(other, [30, 5000]), 0.0, atol=1e-9)


class TestSpectra:
    @pytest.mark.parametrize("window", ["hann", "boxcar"])
    def test_amplitude_of_a_sine_and_of_the_mean(self, window):
        frequency, amplitude = amplitude_spectrum(
            2.0 + sine(640.0, 3.0), RATE, window=window
        )
        assert_allclose(amplitude[0], 2.0, rtol=1e-3)
        assert_allclose(amplitude[np.argmin(np.abs(frequency - 640))], 3.0, rtol=1e-9)
        assert frequency[-1] == RATE / 2

    def test_nyquist_bin_is_not_doubled(self):
        _, amplitude = amplitude_spectrum([1.0, -1.0] * 32, RATE, window="boxcar")
        assert_allclose(amplitude[-1], 1.0, rtol=1e-12)

    def test_order_spectrum_places_the_mesh_on_its_order(self):
        order, amplitude = order_spectrum(sine(23 * 31.7, 2.0), RATE, 31.7)
        peak = np.argmax(amplitude)
        assert_allclose(order[peak], 23.0, rtol=1e-12)
        assert_allclose(amplitude[peak], 2.0, rtol=1e-3)


class TestEnvelope:
    def test_envelope_of_a_modulated_carrier(self):
        modulation = 1 + 0.5 * np.cos(2 * np.pi * 30 * TIME)
        magnitude = envelope(modulation * np.cos(2 * np.pi * 5000 * TIME), RATE)
        assert_allclose(magnitude, modulation, atol=1e-9)

    def test_envelope_spectrum_finds_the_rate_in_its_band_only(self):
        modulation = 1 + 0.5 * np.cos(2 * np.pi * 30 * TIME)
        x = modulation * np.cos(2 * np.pi * 5000 * TIME) + 4 * np.cos(
            2 * np.pi * 700 * TIME
        )
        frequency, amplitude = envelope_spectrum(x, RATE, (4000.0, 6000.0))
        assert frequency[np.argmax(amplitude)] == 30.0
        assert_allclose(amplitude.max(), 0.5, rtol=1e-2)
        _, elsewhere = envelope_spectrum(x, RATE, (600.0, 800.0))
        assert elsewhere[30] < 0.02

    def test_band_outside_the_spectrum(self):
        with pytest.raises(ValueError, match="must lie inside"):
            band_pass(TIME, RATE, (1000.0, 26000.0))
