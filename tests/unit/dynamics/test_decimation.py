"""The low-pass before decimation: flat, free of aliases, without delay."""

import json
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close

from gensig.dynamics._vector import LANES
from gensig.dynamics.decimation import (
    ATTENUATION_DB,
    STORED,
    decimator,
    design,
    in_band_error,
    usable_band,
)

RATE = 51200.0
FLAT = 10 ** (0.01 / 20) - 1
FACTORS = [4, 8, 16]
N_SAMPLES = 2048


def decimated(frequency, factor, phase=0.4):
    """A sine as means over internal steps through the decimator, and sampled at the output rate."""
    low_pass = decimator(factor)
    turn = 2 * np.pi * frequency
    first = -low_pass.margin * factor - 1
    last = (N_SAMPLES + low_pass.margin) * factor
    edge = np.arange(first, last + 1) / (RATE * factor)
    if frequency:
        integral = -np.cos(turn * edge + phase) / turn
    else:
        integral = edge * np.sin(phase)
    means = np.diff(integral) * RATE * factor
    samples = low_pass.apply_to_columns(means[:, None])[:, 0]
    times = np.arange(N_SAMPLES) / RATE
    return samples, np.sin(turn * times + phase)


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("frequency", [0.0, 31.0, 690.0, 15_000.0, 20_000.0])
def test_the_pass_band_is_flat_and_keeps_the_phase(frequency, factor):
    samples, expected = decimated(frequency, factor)
    assert_close(samples, expected, atol=FLAT)


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("alias", [25.0, 690.0, 12_000.0, 19_990.0, 25_500.0])
def test_aliases_are_78_db_down(factor, alias):
    for frequency in (
        RATE - alias,
        RATE + alias,
        2 * RATE - alias,
    ):
        if frequency < 0.5 * factor * RATE:
            samples, _ = decimated(frequency, factor)
            assert np.abs(samples).max() < 10 ** (-78 / 20)


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("n_samples", [1, 37])
def test_channels_and_lanes_are_filtered_alone(n_samples, factor):
    """Against the plain sum of taps times means, for any remainder of the taps by four."""
    low_pass = decimator(factor)
    rng = np.random.default_rng(2)
    n_steps = (n_samples + 2 * low_pass.margin) * factor + 1
    for n_cut in (0, 1, 3):
        taps = low_pass.taps[: len(low_pass.taps) - n_cut]
        means = rng.standard_normal((n_steps, 3, LANES))
        windows = np.lib.stride_tricks.sliding_window_view(
            means[1:],
            len(taps),
            axis=0,
        )
        expected = (windows[::factor][:n_samples] @ taps).transpose(
            2,
            1,
            0,
        )
        samples = replace(low_pass, taps=taps).apply(means)
        assert_close(samples, expected, atol=1e-14)
    means[7:, :, 2] = np.nan
    spoilt = replace(low_pass, taps=taps).apply(means)
    others = np.arange(LANES) != 2

    assert spoilt[others].tobytes() == samples[others].tobytes()
    assert np.isnan(spoilt[2]).all()


def test_columns_of_a_table_are_filtered_alone_and_in_order():
    """More columns than a vector has lanes."""
    low_pass = decimator(4)
    n_steps = (20 + 2 * low_pass.margin) * 4 + 1
    means = np.random.default_rng(3).standard_normal((n_steps, 2 * LANES + 1))
    alone = [low_pass.apply_to_columns(column[:, None])[:, 0] for column in means.T]
    assert_close(low_pass.apply_to_columns(means), np.stack(alone, axis=1), atol=1e-14)


def test_stored_taps_are_those_of_the_design(composed_config):
    stored = {int(factor) for factor in json.loads(STORED.read_text())}
    default = composed_config["solver"]["oversampling"]
    assert stored == {default, 2 * default}

    for factor in stored:
        low_pass = decimator(factor)
        designed = design(factor)
        assert low_pass.margin == designed.margin
        assert_close(low_pass.taps, designed.taps, atol=1e-15)


@pytest.mark.parametrize("finest", [2, 5, 64, 256])
def test_every_allowed_step_and_its_half_have_a_low_pass(finest):
    """That of half the step, for the error, must not be longer."""
    fine = decimator(2 * finest)
    factor = 2 * finest
    assert fine.margin <= decimator(finest).margin

    band = usable_band(RATE)[1]
    folding = (0.5 * factor - 0.3) * RATE
    frequency = np.array([0.0, band, 0.5 * RATE, 0.7 * RATE, folding]) / (factor * RATE)
    turn = np.exp(-2j * np.pi * np.outer(frequency, np.arange(len(fine.taps))))
    gain = np.abs(turn @ fine.taps) * np.sinc(frequency)

    assert_close(gain[:2], 1.0, atol=FLAT)
    assert gain[2:].max() < 10 ** ((3 - ATTENUATION_DB) / 20)


def test_the_usable_band_ends_at_20_khz():
    assert_close(usable_band(RATE), (0.0, 20_000.0), 1e-12)


class TestInBandError:
    """Of spectra under a Hann window, without the signal outside of the band."""

    TIME = np.arange(2560) / RATE

    def tone(self, frequency, amplitude=1.0):
        return amplitude * np.sin(2 * np.pi * frequency * self.TIME + 0.3)

    def test_it_is_relative_to_the_level_of_the_worst_channel(self):
        exact = np.array([[self.tone(1000), self.tone(3000, 200.0)]] * 2)
        off = np.zeros_like(exact)
        off[0] = self.tone(5000, 1e-3), self.tone(5000, 1e-2)
        off[1, 0] = self.tone(5000, 2e-5)

        assert_close(
            in_band_error(exact + off, exact, RATE),
            [1e-3, 2e-5],
            1e-4,
        )

        scaled = exact[:1] * [[[1.001], [1.02]]]
        assert_close(in_band_error(scaled, exact[:1], RATE), [0.02], 1e-9)

        still = np.zeros((1, 1, 256))
        assert in_band_error(still, still, RATE).tolist() == [0.0]

    def test_signals_outside_of_the_band_do_not_count(self):
        exact = np.array([[self.tone(1000)]])
        assert in_band_error(exact + self.tone(22_000, 0.5), exact, RATE) < 1e-4
        assert in_band_error(exact + self.tone(19_000, 0.5), exact, RATE) > 0.4
