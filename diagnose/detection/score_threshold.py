"""Threshold of a score from held-back healthy recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Assumed, of the logarithm of a healthy recording's score: mean and standard deviation that stand
# where few recordings were held back, and the recordings that they weigh as. Of the order of twelve
# simulated two-stage gearboxes (benchmarks.detection, seeds 7 and 8): 0.4 to 0.55, and 0.3 to 0.37.
PRIOR_MEAN, MEAN_WEIGHT = math.log(1.75), 4.0
PRIOR_DEVIATION, DEVIATION_WEIGHT = 0.3, 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Threshold:
    """Score that a healthy recording exceeds with a given probability.

    Attributes
    ----------
    value : of the score
    false_alarms : the probability
    n_held_back : recordings that it was calibrated with
    is_rank : True for a rank among them, which assumes only that they are exchangeable with the
        next one; False for a normal distribution of the logarithm of the score, with a prior
    """

    value: float
    false_alarms: float
    n_held_back: int
    is_rank: bool


def threshold_of(scores: Sequence[float], false_alarms: float) -> Threshold:
    """Threshold from the scores of held-back healthy recordings.

    Notes
    -----
    With n recordings the rank ceil((1 - false_alarms)(n + 1)) is taken where there is one: a
    conformal predictor, Shafer & Vovk (2008), Journal of Machine Learning Research 9, 371-421.
    Fewer cannot promise so little, and the predictive t distribution of the logarithms takes its
    place: Gelman et al. (2013), "Bayesian data analysis", section 3.3. Recordings that are held
    back against each other share their distances: of two, both scores are one distance. So n scores
    count as n - 1 there.
    """
    from scipy.stats import t as student

    n_held_back = len(scores)
    rank = math.ceil((1.0 - false_alarms) * (n_held_back + 1))
    if rank <= n_held_back:
        value, is_rank = float(np.sort(scores)[rank - 1]), True
    else:
        logs = np.log(np.maximum(np.asarray(scores, dtype=float), 1e-9))
        n_alone = max(n_held_back - 1, 0)
        share = n_alone / max(n_held_back, 1)
        weight = MEAN_WEIGHT + n_alone
        mean = (MEAN_WEIGHT * PRIOR_MEAN + share * logs.sum()) / weight
        freedom = DEVIATION_WEIGHT + max(n_alone - 1, 0)
        sums = share * np.square(logs - mean).sum()
        variance = (DEVIATION_WEIGHT * PRIOR_DEVIATION**2 + sums) / freedom
        quantile = float(student.ppf(1.0 - false_alarms, freedom))
        value = math.exp(mean + quantile * math.sqrt(variance * (1.0 + 1.0 / weight)))
        is_rank = False
    return Threshold(
        value=value,
        false_alarms=false_alarms,
        n_held_back=n_held_back,
        is_rank=is_rank,
    )
