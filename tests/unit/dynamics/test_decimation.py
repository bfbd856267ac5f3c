"""The low-pass before decimation: flat, free of folded content, without delay."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.dynamics._vector import LANES, n_lanes
from gensig.dynamics.decimation import (
    ATTENUATION_DB,
    STORED,
    decimator,
    design,
    in_band_error,
    usable_band,
)

RATE = 51200.0
N_SAMPLES = 2048


@pytest.fixture(params=[4, 8, 16])
def oversampling(request):
    return request.param


def side_by_side(signals):
    """(channel, step) in the first lane, something else in the others, as (step, channel, lane)."""
    others = [
        -signals,
        signals + 1.0,
        0.0 * signals,
        2.0 * signals,
        signals - 1.0,
        -3.0 * signals,
        1.0 - signals,
    ]
    return np.stack([signals, *others], axis=-1).transpose(1, 0, 2)


def decimated(frequency, oversampling, phase=0.4):
    """A sine, as means over internal steps, through the decimator, and the same sine sampled at the output rate."""
    low_pass = decimator(oversampling)
    begin = -low_pass.margin * oversampling - 1
    edge = np.arange(begin, (N_SAMPLES + low_pass.margin) * oversampling + 1) / (
        RATE * oversampling
    )
    turn = 2 * np.pi * frequency
    integral = (
        -np.cos(turn * edge + phase) / turn if frequency else edge * np.sin(phase)
    )
    signal = np.diff(integral) * RATE * oversampling
    found = low_pass.apply(side_by_side(signal[None]))[0, 0]
    return found, np.sin(2 * np.pi * frequency * np.arange(N_SAMPLES) / RATE + phase)


@pytest.mark.parametrize("frequency", [0.0, 31.0, 690.0, 9000.0, 15_000.0, 20_000.0])
def test_pass_band_is_flat_and_keeps_the_phase(frequency, oversampling):
    found, expected = decimated(frequency, oversampling)
    tolerance = 10 ** (0.01 / 20) - 1
    assert_allclose(found, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    "folded_to", [25.0, 690.0, 12_000.0, 19_990.0, 23_000.0, 25_500.0]
)
@pytest.mark.parametrize("multiple", [1, 2])
def test_folded_content_is_78_db_down(folded_to, multiple, oversampling):
    for frequency in (multiple * RATE - folded_to, multiple * RATE + folded_to):
        if frequency < 0.5 * oversampling * RATE:
            found, _ = decimated(frequency, oversampling)
            assert np.abs(found).max() < 10 ** (-78 / 20)


def test_without_the_filter_it_would_fold(oversampling):
    internal = np.arange(N_SAMPLES * oversampling)
    plain = np.sin(2 * np.pi * (RATE - 690.0) * internal / (RATE * oversampling))[
        ::oversampling
    ]
    assert np.abs(plain).max() > 0.9


@pytest.mark.parametrize("n_samples", [1, 100, 1707])
def test_length_and_channels(n_samples, oversampling):
    low_pass = decimator(oversampling)
    signal = np.zeros((3, (n_samples + 2 * low_pass.margin) * oversampling + 1))
    assert low_pass.apply(side_by_side(signal)).shape == (LANES, 3, n_samples)


@pytest.mark.parametrize("n_samples", [1, 37])
def test_channels_and_lanes_are_filtered_by_themselves(n_samples, oversampling):
    """Against the plain sum of taps times means, whatever number of taps is left over after the fours."""
    low_pass, rng = decimator(oversampling), np.random.default_rng(2)
    for taps in (low_pass.taps, low_pass.taps[:-1], low_pass.taps[:-3]):
        means = rng.standard_normal(
            ((n_samples + 2 * low_pass.margin) * oversampling + 1, 3, LANES)
        )
        expected = [
            [
                [
                    taps @ means[1 + s * oversampling :, c, lane][: len(taps)]
                    for s in range(n_samples)
                ]
                for c in range(3)
            ]
            for lane in range(LANES)
        ]
        assert_allclose(
            replace(low_pass, taps=taps).apply(means), expected, rtol=0, atol=1e-14
        )


@pytest.mark.parametrize("lane", range(LANES))
def test_a_lane_that_is_not_finite_leaves_the_others_their_bits(lane, oversampling):
    low_pass, rng = decimator(oversampling), np.random.default_rng(3)
    means = rng.standard_normal(
        ((20 + 2 * low_pass.margin) * oversampling + 1, 2, LANES)
    )
    clean, others = low_pass.apply(means), [k for k in range(LANES) if k != lane]
    means[7:, :, lane] = np.nan
    spoilt = low_pass.apply(means)
    assert spoilt[others].tobytes() == clean[others].tobytes()
    assert np.isnan(spoilt[lane]).all()


def test_taps_are_symmetric_and_reach_the_margin(oversampling):
    low_pass = decimator(oversampling)
    assert len(low_pass.taps) == 2 * low_pass.margin * oversampling
    assert_allclose(low_pass.taps, low_pass.taps[::-1], rtol=0, atol=1e-13)
    assert_allclose(low_pass.taps.sum(), 1.0, rtol=5e-4, atol=0)


def test_what_is_stored_is_what_would_be_designed():
    stored = json.loads(STORED.read_text())
    assert {"5", "10"} == set(stored)
    for oversampling in map(int, stored):
        low_pass, designed = decimator(oversampling), design(oversampling)
        assert low_pass.margin == designed.margin
        assert_allclose(low_pass.taps, designed.taps, rtol=0, atol=1e-15)


def test_the_default_and_its_check_are_stored(composed_config):
    default = composed_config["solver"]["oversampling"]
    assert {str(default), str(2 * default)} <= set(json.loads(STORED.read_text()))


def test_in_float32_the_sums_keep_six_digits(oversampling):
    """Sixteen lanes; the samples come back in float64."""
    low_pass, rng = decimator(oversampling), np.random.default_rng(5)
    means = rng.standard_normal(
        ((20 + 2 * low_pass.margin) * oversampling + 1, 2, n_lanes("float32"))
    )
    found = low_pass.apply(means.astype(np.float32))
    assert found.dtype == np.float64
    assert found.shape == (n_lanes("float32"), 2, 20)
    halves = (
        low_pass.apply(means[..., :LANES].copy()),
        low_pass.apply(means[..., LANES:].copy()),
    )
    assert_allclose(found, np.concatenate(halves), rtol=0, atol=1e-6)


@pytest.mark.parametrize("finest", [2, 5, 64, 128, 256])
def test_every_step_that_is_allowed_has_its_low_pass(finest):
    """And so has half of it, by which the error is found; that one must not reach further."""
    coarse, fine = decimator(finest), decimator(2 * finest)
    assert fine.margin <= coarse.margin
    frequency = np.array(
        [
            0.0,
            usable_band(RATE)[1],
            0.5 * RATE,
            0.7 * RATE,
            (0.5 * 2 * finest - 0.3) * RATE,
        ]
    )
    turn = np.exp(
        -2j
        * np.pi
        * np.outer(frequency / (2 * finest * RATE), np.arange(len(fine.taps)))
    )
    gain = np.abs(turn @ fine.taps) * np.sinc(frequency / (2 * finest * RATE))
    assert_allclose(gain[:2], 1.0, rtol=0, atol=10 ** (0.01 / 20) - 1)
    assert gain[2:].max() < 10 ** ((3 - ATTENUATION_DB) / 20)


def test_usable_band_ends_at_20_khz():
    assert_allclose(usable_band(RATE), (0.0, 20_000.0), rtol=1e-12, atol=0)


class TestInBandError:
    """Of spectra under a Hann window, so that what lies outside the band does not count."""

    TIME = np.arange(2560) / RATE

    def tones(self, *tones):
        """Sum of sines, each given as (Hz, amplitude)."""
        return sum(a * np.sin(2 * np.pi * f * self.TIME + 0.3) for f, a in tones)

    def error(self, found, exact):
        return in_band_error(np.asarray(found), np.asarray(exact), RATE)

    def test_is_relative_to_the_level_of_its_channel(self):
        exact = np.array([[self.tones((1000, 1.0)), self.tones((3000, 200.0))]] * 2)
        off = [
            [self.tones((5000, 1e-3)), self.tones((5000, 1e-2))],
            [self.tones((5000, 2e-5)), 0 * self.TIME],
        ]
        assert_allclose(
            self.error(np.add(exact, off), exact), [1e-3, 2e-5], rtol=1e-2, atol=0
        )

    def test_is_that_of_the_worst_channel(self):
        exact = np.array([[self.tones((1000, 1.0)), self.tones((1000, 1.0))]])
        assert_allclose(
            self.error(exact * [[[1.001], [1.02]]], exact), [0.02], rtol=1e-9, atol=0
        )

    def test_does_not_count_what_lies_outside_the_band(self):
        exact = np.array([[self.tones((1000, 1.0))]])
        assert self.error(exact + self.tones((22_000, 0.5)), exact) < 1e-4
        assert self.error(exact + self.tones((19_000, 0.5)), exact) > 0.4

    def test_of_what_is_still_is_none(self):
        still = np.zeros((1, 1, 256))
        assert_allclose(self.error(still, still), [0.0], rtol=0, atol=0)


@pytest.mark.parametrize("n_channels", [1, 2])
def test_the_error_of_a_record_does_not_depend_on_the_others(n_channels):
    rng = np.random.default_rng(0)
    exact = rng.standard_normal((8, n_channels, 1536))
    found = exact + 1e-4 * rng.standard_normal(exact.shape)
    together = in_band_error(found, exact, 51_200.0)
    for n in (1, 2, 3, 8):
        assert np.array_equal(
            in_band_error(found[:n], exact[:n], 51_200.0), together[:n]
        )
    assert np.unique(together).size == 8
