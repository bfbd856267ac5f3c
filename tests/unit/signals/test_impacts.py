"""Impacts that are known: one, two or none a turn, with a ring-down of a known time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.signals.impacts import impact_decay, impacts_per_turn, peak_over_rms

RATE, PER_TURN, N_TURNS, TEETH = 5000.0, 500, 12, 23
DURATION = PER_TURN / RATE


def rings(decay, places=(100,), size=20.0, noise=1.0, seed=0):
    """Turns with a ring of 1.2 kHz at every place, its phase another in every turn."""
    rng = np.random.default_rng(seed)
    time = np.arange(PER_TURN) / RATE
    turns = noise * rng.standard_normal((N_TURNS, PER_TURN))
    for turn in turns:
        for place in places:
            late = time[: PER_TURN - place]
            phase = rng.uniform(0, 2 * np.pi)
            wave = np.cos(2 * np.pi * 1200 * late + phase)
            turn[place:] += size * np.exp(-late / decay) * wave
    return turns


@pytest.mark.parametrize(
    "places",
    [(), (100,), (100, 300), (20, 160, 400)],
)
def test_impacts_are_counted(places):
    count = impacts_per_turn(rings(1e-3, places), TEETH)
    assert_allclose(count, len(places), atol=0.1)


def test_threshold_is_in_deviations_of_what_lies_between():
    turns = rings(1e-3, size=7.0)
    assert impacts_per_turn(turns, TEETH) > 0.8
    assert impacts_per_turn(turns, TEETH, threshold=10.0) == 0.0
    assert impacts_per_turn(50.0 * turns, TEETH) == impacts_per_turn(turns, TEETH)


@pytest.mark.parametrize(
    "decay",
    [0.7e-3, 1.4e-3, 3e-3],
)
@pytest.mark.parametrize("noise", [0.01, 2.0])
def test_decay_is_recovered(decay, noise):
    signals = (rings(decay, noise=noise, seed=seed) for seed in range(8))
    result = [impact_decay(turns, DURATION) for turns in signals]
    assert_allclose(
        np.mean(result),
        decay,
        rtol=0.15 + 0.1 * (decay < 1e-3),
    )


def test_no_impact_no_decay():
    tone = np.cos(np.arange(100) * np.pi / 2)
    for turn in (np.zeros(100), tone):
        assert np.isnan(impact_decay(np.tile(turn, (3, 1)), DURATION))


def test_peak_over_rms_is_the_usual_peak_not_the_rarest():
    turns = np.tile(
        [2.0, -2.0, 0.0, 0.0],
        (9, 25),
    )
    assert_allclose(peak_over_rms(turns), np.sqrt(2))

    turns[4, 7] = 100.0
    assert_allclose(
        peak_over_rms(turns),
        2 / np.sqrt(np.mean(turns**2)),
    )
    assert np.isnan(peak_over_rms(np.zeros((2, 8))))


@pytest.mark.parametrize(
    ("indicator", "options"),
    [(impacts_per_turn, [TEETH]), (peak_over_rms, []), (impact_decay, [DURATION])],
)
def test_leading_axes_are_kept(indicator, options):
    turns = np.stack([rings(1e-3), rings(2e-3, (50, 300))])
    both, second = (indicator(part, *options) for part in (turns, turns[1]))
    assert both.shape == (2,)
    assert_allclose(both[1], float(second))
