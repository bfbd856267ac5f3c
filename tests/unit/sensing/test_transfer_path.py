"""A bank of housing modes: linear, causal, with the frequencies, damping and gain at rest that it
states."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose
from scipy.signal import sosfreqz

from gensig.sensing.transfer_path import ModalPath, draw_housing, mode_section

RATE = 51200.0
RANGES = {
    "n_modes": (8, 20),
    "natural_frequency": (300.0, 12e3),
    "damping_ratio": (0.01, 0.05),
}


def housing(seed=0, **changes):
    path = ModalPath(**{**RANGES, "transmissibility": 0.2, **changes})
    return draw_housing(default_rng(seed), path, 4, 3)


def signals(*shape):
    return default_rng(7).standard_normal(shape)


def test_causal():
    path, source = housing(), signals(4, 2000)
    changed = source.copy()
    changed[:, 1000:] = 0.0
    difference = path.apply(source, RATE) - path.apply(changed, RATE)

    assert not difference[:, :1000].any()
    assert np.abs(difference).max() > 0.1


@pytest.mark.parametrize(
    "frequency",
    [100.0, 800.0, 1000.0, 1250.0, 3000.0],
)
def test_a_mode_answers_a_tone_as_its_formula_says(frequency):
    section = mode_section(1000.0, 0.03, RATE)
    _, (result,) = sosfreqz(
        section,
        [frequency],
        fs=RATE,
    )
    ratio = frequency / 1000.0
    # the input goes straight from sample to sample, which takes the square of a sinc
    exact = np.sinc(frequency / RATE) ** 2 / (1.0 - ratio**2 + 0.06j * ratio)

    assert_allclose(abs(result), abs(exact), rtol=2e-3)
    assert abs(np.angle(result / exact)) < 0.01


def test_gain_at_rest_has_the_stated_size():
    squares = []
    for seed in range(300):
        path = housing(seed)
        squares.append(np.mean((path.to_sensors @ path.from_bearings) ** 2))
    assert_allclose(
        np.sqrt(np.mean(squares)),
        0.2,
        rtol=0.05,
    )


def test_ranges_are_kept_and_used():
    drawn = [housing(seed) for seed in range(200)]
    counts = [len(path.natural_frequency) for path in drawn]
    assert (min(counts), max(counts)) == RANGES["n_modes"]
    for name in ("natural_frequency", "damping_ratio"):
        low, high = RANGES[name]
        values = np.concatenate([getattr(path, name) for path in drawn])
        assert low <= values.min() < 1.02 * low
        assert 0.98 * high < values.max() <= high
    assert all(np.all(np.diff(path.natural_frequency) >= 0.0) for path in drawn)


def test_memory_is_when_the_slowest_mode_has_died_out():
    path = housing(
        n_modes=(1, 1), natural_frequency=(500.0, 500.0), damping_ratio=(0.02, 0.02)
    )
    impulse = np.zeros((4, 20_000))
    impulse[:, 0] = 1.0
    answer = np.abs(path.apply(impulse, RATE)[0])
    late = answer[round(path.memory * RATE) :].max() / answer.max()

    assert 0.5 * np.exp(-5.0) < late < 1.5 * np.exp(-5.0)
