"""NA4 and NB4: what stays gives the same value for ever, what changes shows, later records cannot
reach back."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.signals.history import na4, nb4
from gensig.signals.indicators import fm4, kurtosis

TEETH, PER_TURN = 20, 1000
TURN = np.arange(PER_TURN) / PER_TURN * 2 * np.pi
MESH = 4 * np.cos(TEETH * TURN) + np.cos(2 * TEETH * TURN)


def history(size, *, seed=0):
    """Mesh, and Gaussian noise without the orders of mesh and shaft, of a given size in each
    record."""
    noise = np.random.default_rng(seed).standard_normal((len(size), PER_TURN))
    spectrum = np.fft.rfft(noise)
    spectrum[:, [0, 1, 2, *range(TEETH, PER_TURN // 2 + 1, TEETH)]] = 0
    return MESH + np.asarray(size)[:, None] * np.fft.irfft(spectrum, n=PER_TURN)


def test_na4_is_its_formula():
    averages = history([1.0, 2.0, 0.5, 3.0])
    residual = averages - MESH
    for last in range(4):
        variance = np.mean([np.var(r) for r in residual[: last + 1]])
        expected = np.mean((residual[last] - residual[last].mean()) ** 4) / variance**2
        assert_allclose(na4(averages, TEETH)[last], expected, rtol=1e-9)


def test_a_machine_that_stays_as_it_is_keeps_its_value():
    same = np.tile(history([1.0]), (8, 1))
    assert_allclose(na4(same, TEETH), kurtosis(same[0] - MESH), rtol=1e-9)
    assert na4(history(np.ones(300)), TEETH)[50:].mean() == pytest.approx(3.0, abs=0.1)


def test_na4_rises_with_noise_that_grows_where_fm4_does_not():
    size = np.concatenate([np.ones(20), np.linspace(1.0, 4.0, 20)])
    averages = history(size)
    expected = 3 * size**4 / (np.cumsum(size**2) / np.arange(1, 41)) ** 2
    assert_allclose(na4(averages, TEETH), expected, rtol=0.5)
    assert na4(averages, TEETH)[-5:].min() > 4 * na4(averages, TEETH)[:20].max()
    assert fm4(averages, TEETH).max() < 4


def test_a_record_is_judged_by_the_past_alone():
    averages = history([1.0, 1.0, 1.0, 1.0])
    later = averages.copy()
    later[3] += 5 * np.cos(7 * TURN)
    for indicator in (na4, nb4):
        before, after = indicator(averages, TEETH), indicator(later, TEETH)
        assert_allclose(after[:3], before[:3], rtol=1e-12)
    assert na4(later, TEETH)[3] > 5 * na4(averages, TEETH)[3]
    backwards = na4(later[::-1], TEETH)[::-1]
    assert not np.allclose(backwards, na4(later, TEETH))


def test_nb4_of_a_modulation_that_deepens():
    depth = np.array([0.1, 0.1, 0.1, 0.3])
    averages = (1 + depth[:, None] * np.cos(2 * TURN)) * np.cos(TEETH * TURN)
    mean_variance = np.cumsum(depth**2 / 2) / np.arange(1, 5)
    assert_allclose(
        nb4(averages, TEETH), 3 / 8 * depth**4 / mean_variance**2, rtol=1e-9
    )


def test_a_record_of_too_few_turns_is_passed_over():
    averages = history([1.0, 2.0, 3.0])
    gap = np.insert(averages, 1, np.nan, axis=0)
    found = na4(gap, TEETH)
    assert np.isnan(found).tolist() == [False, True, False, False]
    assert_allclose(found[[0, 2, 3]], na4(averages, TEETH), rtol=1e-12)


def test_records_without_residual_and_the_first_that_has_one():
    averages = np.stack([MESH, MESH, MESH + 0.1 * np.cos(7 * TURN)])
    found = na4(averages, TEETH)
    assert np.isnan(found[:2]).all()
    assert_allclose(found[2], 1.5 * 3**2, rtol=1e-6)  # its variance counts a third
