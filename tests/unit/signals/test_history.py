"""NA4 and NB4 by their formulas: a record is judged by its past alone."""

import numpy as np
from numpy.testing import assert_allclose

from gensig.signals.history import na4, nb4

TEETH, PER_TURN = 20, 1000
TURN = np.arange(PER_TURN) / PER_TURN * 2 * np.pi


def wave(order):
    return np.cos(order * TURN)


MESH = 4 * wave(TEETH) + wave(2 * TEETH)


def history(*sizes):
    """A mesh in each record, with noise of a given size without the orders of mesh and shaft."""
    noise = np.random.default_rng(0).standard_normal((len(sizes), PER_TURN))
    spectrum = np.fft.rfft(noise)
    spectrum[:, [0, 1, 2, *range(TEETH, PER_TURN // 2 + 1, TEETH)]] = 0
    return MESH + np.array(sizes)[:, None] * np.fft.irfft(spectrum, n=PER_TURN)


def test_na4_is_its_formula():
    averages = history(1.0, 2.0, 0.5, 3.0)
    residual = averages - MESH
    mean_variance = np.cumsum(residual.var(axis=1)) / np.arange(1, 5)
    moment = np.mean(
        (residual - residual.mean(axis=1)[:, None]) ** 4,
        axis=1,
    )

    assert_allclose(na4(averages, TEETH), moment / mean_variance**2)


def test_nb4_of_a_modulation_that_deepens():
    depth = np.array([0.1, 0.1, 0.1, 0.3])
    averages = (1 + depth[:, None] * wave(2)) * wave(TEETH)
    mean_variance = np.cumsum(depth**2 / 2) / np.arange(1, 5)
    expected = 3 / 8 * depth**4 / mean_variance**2

    assert_allclose(nb4(averages, TEETH), expected)


def test_a_record_of_too_few_turns_is_passed_over():
    averages = history(1.0, 2.0, 3.0)
    values = na4(
        np.insert(averages, 1, np.nan, axis=0),
        TEETH,
    )
    assert np.isnan(values).tolist() == [False, True, False, False]
    assert_allclose(
        values[[0, 2, 3]],
        na4(averages, TEETH),
    )


def test_records_without_residual_and_the_first_that_has_one():
    averages = np.stack([MESH, MESH, MESH + 0.1 * wave(7)])
    values = na4(averages, TEETH)
    assert np.isnan(values[:2]).all()
    assert_allclose(
        values[2],
        1.5 * 3**2,
        rtol=1e-6,
    )  # its variance counts a third
