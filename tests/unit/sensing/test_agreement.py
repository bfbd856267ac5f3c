"""Band levels and indicators of two solutions: what they read of signals whose difference is
known."""

from math import tau

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.sensing.agreement import (
    HEARD_DB,
    INDICATORS,
    THIRD_OCTAVE_DB,
    Agreement,
    agreement,
    indicator_difference,
    third_octave_bands,
    third_octave_difference,
    third_octave_power,
)

RATE = 51200.0
N_SAMPLES = 51200
TIME = np.arange(N_SAMPLES) / RATE
MIDDLES = 1000 * 10 ** (np.arange(-17, 14) / 10)  # of the bands of a second, Hz


def tone(frequency, level_db=0.0):
    return 10 ** (level_db / 20) * np.sin(tau * frequency * TIME + 0.7)


def noise(*shape, seed=0):
    return np.random.default_rng(seed).standard_normal((*shape, N_SAMPLES))


def one_lane(*channels):
    return np.array([channels])


class TestBands:
    @pytest.mark.parametrize(
        ("n_samples", "lowest"), [(51_200, 20), (10_240, 100), (2560, 400), (512, 2000)]
    )
    def test_short_signals_resolve_the_upper_ones(self, n_samples, lowest):
        lower, upper = third_octave_bands(n_samples, RATE)
        assert_allclose(
            np.sqrt(lower[0] * upper[0]),
            lowest,
            rtol=0.01,
        )
        assert np.all(upper - lower >= 4 * RATE / n_samples)

    def test_too_short(self):
        with refused("40 samples at 51200 Hz resolve no third-octave band", ValueError):
            third_octave_bands(40, RATE)


class TestPower:
    @pytest.mark.parametrize(
        "band",
        [0, 5, 17, 29],
    )
    def test_a_tone_is_in_its_band(self, band):
        result = third_octave_power(3.0 * tone(MIDDLES[band]), RATE)
        assert_allclose(result[band], 4.5, rtol=2e-3)
        assert np.delete(result, band).sum() < 2e-3 * 4.5

    def test_white_noise_follows_the_width(self):
        """Its power per hertz is 1 over half the rate: a decibel more a band, as much as each is
        wider."""
        lower, upper = third_octave_bands(N_SAMPLES, RATE)
        result = third_octave_power(noise(60), RATE).mean(axis=0)
        expected = (upper - lower) / (RATE / 2)

        assert_allclose(
            result[10:],
            expected[10:],
            rtol=0.1,
        )
        assert_allclose(
            10 * np.log10(result[18:29] / result[17:28]),
            1.0,
            atol=0.1,
        )


class TestThirdOctaves:
    @pytest.mark.parametrize(
        "moved",
        [-3.0, -0.3, 0.5, 2.0],
    )
    def test_a_tone_moved_in_level(self, moved):
        """In one band of one channel of one lane; the other bands hold tones of their own."""
        others = tone(MIDDLES[8]) + tone(MIDDLES[24], -30)
        exact = np.array([[others, tone(MIDDLES[17]) + others]] * 2)
        solution = exact.copy()
        solution[1, 1] = tone(MIDDLES[17], moved) + others
        difference = third_octave_difference(solution, exact, RATE)

        assert_allclose(
            difference,
            [0.0, abs(moved)],
            atol=2e-3,
        )

    @pytest.mark.parametrize(
        ("level", "expected"),
        [(-HEARD_DB + 3, True), (-HEARD_DB - 3, False)],
    )
    def test_what_is_far_below_the_loudest_is_not_heard(self, level, expected):
        """A tone 2 dB louder, and one that a solution alone has."""
        loud, quiet, louder = (
            tone(MIDDLES[band], height)
            for band, height in ((17, 0), (24, level), (24, level + 2))
        )
        for exact in (loud + quiet, loud):
            solution, exact = one_lane(loud + louder), one_lane(exact)
            is_heard = third_octave_difference(solution, exact, RATE)[0] > 1
            assert is_heard == expected

    def test_the_loudest_is_that_of_the_channel(self):
        loud, quiet = tone(MIDDLES[17]), tone(MIDDLES[17], -80)
        solution, exact = one_lane(loud, 2 * quiet), one_lane(loud, quiet)
        difference = third_octave_difference(solution, exact, RATE)
        assert_allclose(difference, 20 * np.log10(2))


class TestIndicators:
    def test_a_clipped_peak_shows_in_the_crest_factor(self):
        """One sample of 51 200 at 8 goes to 6: the crest factor falls by a quarter, RMS and
        kurtosis hardly change."""
        exact = one_lane(noise().clip(-4, 4))
        exact[0, 0, 1000] = 8.0
        result = exact.clip(-6, 6)
        assert_allclose(indicator_difference(result, exact), 0.25, rtol=2e-3)

    def test_impulses_show_in_the_kurtosis(self):
        """A sine of kurtosis 1.5 against one with the same RMS whose power comes in bursts, of
        twice that."""
        exact = tone(1000.0)
        bursts = exact * np.where(TIME < 0.5, np.sqrt(2), 0)
        difference = indicator_difference(one_lane(bursts), one_lane(exact))
        assert_allclose(difference, 1.0, rtol=1e-3)

    def test_the_worst_channel_of_each_lane(self):
        exact = noise(2, 2)
        factor = np.array([[1.0, 1.01], [0.9, 1.02]])[..., None]
        difference = indicator_difference(factor * exact, exact)
        assert_allclose(difference, [0.01, 0.1])


class TestAgreement:
    def test_a_delay_of_a_microsecond_agrees_where_values_do_not(self):
        """10 kHz a sixteenth of a period late: a relative error of 0.4, and the same levels."""
        exact = one_lane(tone(10_000))
        late = one_lane(np.sin(tau * 10_000 * (TIME - 6.25e-6) + 0.7))
        assert np.linalg.norm(late - exact) > 0.3 * np.linalg.norm(exact)

        result = agreement(late, exact, RATE)
        assert result.third_octave_db[0] < 1e-3
        assert result.agrees[0]

    @pytest.mark.parametrize(
        ("third_octave_db", "indicators", "expected"),
        [
            (0.9, 0.9, True),
            (1.1, 0.9, False),
            (0.9, 1.1, False),
            (np.inf, 0, False),
            (np.nan, 0, False),
            (0, np.nan, False),
        ],
    )
    def test_both_limits_hold(self, third_octave_db, indicators, expected):
        """In shares of the limits."""
        result = Agreement(
            third_octave_db=np.array([THIRD_OCTAVE_DB * third_octave_db]),
            indicators=np.array([INDICATORS * indicators]),
        )
        assert result.agrees[0] == expected

    def test_what_is_still_in_both_agrees(self):
        still, moving = one_lane(np.zeros(N_SAMPLES)), one_lane(noise())
        mixed = np.concatenate([moving, still], axis=1)
        assert agreement(mixed, mixed, RATE).agrees[0]
        assert not agreement(still, moving, RATE).agrees[0]
        assert not agreement(moving, still, RATE).agrees[0]

    def test_what_is_not_finite_does_not(self):
        whole = one_lane(noise())
        broken = whole.copy()
        broken[..., -1] = np.nan
        for result, exact in ((broken, whole), (whole, broken), (broken, broken)):
            assert not agreement(result, exact, RATE).agrees[0]

    def test_middles_are_those_of_iec_61260_without_gaps_to_the_usable_band(self):
        lower, upper = third_octave_bands(N_SAMPLES, RATE)
        middle = np.sqrt(lower * upper)[:-1]
        assert_allclose(middle, MIDDLES[:-1])
        assert_allclose(
            middle[[0, -1]],
            [20.0, 16_000.0],
            rtol=0.01,
        )
        assert_allclose(lower[1:], upper[:-1])
        assert_allclose(upper[-1], 20_000)


def test_both_limits_belong_to_what_agrees():
    more = 1.0 + 1e-12
    of_bands = np.array([1.0, more, 1.0, np.nan]) * THIRD_OCTAVE_DB
    of_indicators = np.array([1.0, 1.0, more, 1.0]) * INDICATORS
    result = Agreement(third_octave_db=of_bands, indicators=of_indicators)
    assert result.agrees.tolist() == [True, False, False, False]
