"""A change of rate: what is kept, what is shut out, and the same samples however they are cut."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.dynamics.decimation import PASS_SHARE as RECORDER_SHARE
from gensig.signals.resampling import PASS_SHARE, RateChange, rate_change

SIGNAL = np.random.default_rng(0).standard_normal((2, 20_000))
PAIRS = [
    (51200, 12800),
    (51200, 5000),
    (51200, 25600),
    (44100, 12800),
    (12000, 12800),
]


def tone(frequency, rate, n_samples):
    return np.sin(2 * np.pi * frequency * np.arange(n_samples) / rate)


@pytest.mark.parametrize(("found", "wanted"), PAIRS)
def test_tones_in_the_band_are_those_of_the_other_rate(found, wanted):
    frequency = 0.38 * min(found, wanted)
    made = rate_change(found, wanted).apply(tone(frequency, found, found))
    assert made.size == wanted

    edge = wanted // 10
    expected = tone(frequency, wanted, wanted)
    assert_allclose(
        made[edge:-edge],
        expected[edge:-edge],
        atol=1e-3,
    )


@pytest.mark.parametrize(("found", "wanted"), PAIRS)
def test_tones_above_half_the_new_rate_do_not_fold(found, wanted):
    change, edge = rate_change(found, wanted), wanted // 10
    for share in (0.5, 0.6, 0.9):
        frequency = share * wanted
        if frequency < 0.5 * found and wanted < found:
            left = change.apply(tone(frequency, found, found))
            assert np.abs(left[edge:-edge]).max() < 1e-5


@pytest.mark.parametrize(("found", "wanted"), PAIRS)
def test_a_part_has_the_samples_of_the_whole(found, wanted):
    signal = SIGNAL
    change = rate_change(found, wanted)
    whole = change.apply(signal)
    n_samples = whole.shape[1]

    assert n_samples == change.n_samples(20_000)
    for start, stop in (
        (0, n_samples),
        (0, 1),
        (777, 1234),
        (n_samples - 3, n_samples),
    ):
        part = change.apply_to_part(
            lambda a, b: signal[:, a:b],
            20_000,
            start,
            stop,
        )
        assert_allclose(
            part,
            whole[:, start:stop],
            atol=1e-12,
        )


def test_the_same_rate_changes_nothing():
    change = rate_change(25_600.0, 25_600.0)
    assert change.is_none
    assert_array_equal(change.apply(SIGNAL), SIGNAL)


def test_the_band_is_that_of_the_simulated_recorder():
    assert PASS_SHARE == RECORDER_SHARE


@pytest.mark.parametrize(
    ("up", "down"),
    [(0, 1), (2, 4)],
)
def test_no_ratio_is_refused(up, down):
    with refused("no ratio", ValueError):
        RateChange(up=up, down=down)
