"""Thresholds keep the share of false alarms that they promise."""

import numpy as np
import pytest

from diagnose.detection.score_threshold import PRIOR_DEVIATION, PRIOR_MEAN, threshold_of


@pytest.mark.parametrize("n_healthy", [1, 3, 8, 19, 40])
def test_false_alarms_of_exchangeable_scores(n_healthy):
    rng = np.random.default_rng(n_healthy)
    scores = np.exp(rng.normal(PRIOR_MEAN, PRIOR_DEVIATION, (300, n_healthy + 1)))
    above = [row[-1] > threshold_of(row[:-1].tolist(), 0.05).value for row in scores]
    assert np.mean(above) < 0.09


def test_rank_needs_nineteen_for_five_percent():
    assert not threshold_of([1.0] * 18, 0.05).is_rank
    threshold = threshold_of(list(np.arange(1.0, 20.0)), 0.05)
    assert threshold.is_rank
    assert threshold.value == 19.0


def test_few_scores_that_scatter_raise_the_threshold():
    steady = threshold_of([1.3, 1.35, 1.4], 0.05)
    scattered = threshold_of([0.6, 1.3, 2.9], 0.05)
    assert scattered.value > 1.3 * steady.value
    assert threshold_of([], 0.05).value > threshold_of([], 0.2).value


def test_two_recordings_are_one_distance():
    """Held back against each other they have nearly one score, which says nothing of scatter."""
    usual = float(np.exp(PRIOR_MEAN))
    none, one, two, three = (threshold_of([usual] * n, 0.05).value for n in range(4))
    assert none == one > two > three
    # the scatter is that assumed: a normal quantile above the mean at the least
    assert two > usual * np.exp(1.645 * PRIOR_DEVIATION)
