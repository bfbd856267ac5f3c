"""Threshold of an alarm, from healthy records of machines that are not scored."""

from __future__ import annotations

import numpy as np

from diagnose.data.windows import FloatArray
from diagnose.scoring.machines import CountArray

FALSE_ALARMS = 0.05  # share of healthy records above the threshold, intended
LEAST_HEALTHY = 19  # records; no rank of fewer promises that share


def alarm_threshold(scores: FloatArray, weight: CountArray | None = None) -> FloatArray:
    """(resample,) score that a new healthy record exceeds with a probability of `FALSE_ALARMS`.

    It is the score of rank ceil(0.95 (n + 1)) of n records, which promises at most that share. Of
    fewer than `LEAST_HEALTHY` it is the largest and promises less. Records of one machine resemble
    each other, so that the promise is weaker than it reads. The share on test machines shows the
    outcome.

    Parameters
    ----------
    scores : (record,) of healthy records
    weight : (resample, record) number of times that each was drawn; None: all once

    Source: Vovk, Gammerman & Shafer (2005), "Algorithmic learning in a random world", chapter 2;
    Shafer & Vovk (2008), "A tutorial on conformal prediction", Journal of Machine Learning
    Research 9.
    """
    if weight is None:
        weight = np.ones((1, scores.size), dtype=np.int64)
    order = np.argsort(scores, kind="stable")
    below = np.cumsum(weight[:, order], axis=1)
    total = below[:, -1]
    rank = np.minimum(np.ceil((1 - FALSE_ALARMS) * (total + 1) - 1e-9), total)
    return scores[order][np.argmax(below >= rank[:, None], axis=1)]
