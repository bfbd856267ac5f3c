"""Alarms: threshold from healthy records of machines that are not scored, and ROC areas."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.machines import CountArray
from diagnose.scoring.metrics import ratio

Mask = NDArray[np.bool_]

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


def areas(
    scores: FloatArray, faulty: Mask, sound: Mask, unit: IntArray, drawn: CountArray
) -> FloatArray:
    """(resample, seed) areas under the ROC curve; NaN for a resample without a pair.

    It is the share of pairs of a faulty and a sound record in which the faulty one scores higher;
    ties count half. Pairs are counted once for each pair of units, then weighted by the number of
    times that both were drawn.

    Parameters
    ----------
    scores : (seed, record)
    faulty, sound : (record,) records that are compared
    unit : (record,)
    drawn : (resample, unit) number of times that each unit was drawn
    """
    n_units = drawn.shape[1]
    won = np.zeros((len(scores), n_units, n_units))
    for of_seed, values in zip(won, scores, strict=True):
        for index in np.unique(unit[sound]):
            ordered = np.sort(values[sound & (unit == index)])
            below = np.searchsorted(ordered, values[faulty], "left")
            below = below + np.searchsorted(ordered, values[faulty], "right")
            of_seed[index] = np.bincount(unit[faulty], below / 2, n_units)
    n_faulty, n_sound = (
        drawn @ np.bincount(unit[member], minlength=n_units)
        for member in (faulty, sound)
    )
    total = np.einsum("bu,suv,bv->bs", drawn, won, drawn, optimize=True)
    return ratio(total, (n_faulty * n_sound)[:, None])
