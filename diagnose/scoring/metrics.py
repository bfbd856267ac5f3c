"""Scores over records with intervals over machines: windows of one are not independent."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.intervals import Interval, of_seeds, with_interval
from diagnose.scoring.machines import CountArray, Machines


def over_records(
    log_probability: FloatArray, record: IntArray
) -> tuple[IntArray, FloatArray]:
    """Prediction of a record: the mean of the log-probabilities of its windows.

    Parameters
    ----------
    log_probability : (window, class)
    record : (window,)

    Returns
    -------
    record : (record,) sorted, each once
    log_probability : (record, class)
    """
    records, position = np.unique(record, return_inverse=True)
    total = np.zeros((records.size, log_probability.shape[1]))
    np.add.at(total, position, log_probability)
    return records, total / np.bincount(position)[:, None]


def confusion_by_unit(
    label: IntArray, predicted: IntArray, unit: NDArray[Any], n_classes: int
) -> CountArray:
    """Counts (unit, true class, predicted class) of three (record,) arrays, units sorted."""
    names, position = np.unique(unit, return_inverse=True)
    counts = np.zeros((names.size, n_classes, n_classes), dtype=np.int64)
    np.add.at(counts, (position, label, predicted), 1)
    return counts


def ratio(part: NDArray[Any], total: NDArray[Any]) -> FloatArray:
    """Quotient of two arrays of shapes that fit; NaN for a total of 0."""
    shape = np.broadcast_shapes(part.shape, total.shape)
    return np.divide(part, total, out=np.full(shape, np.nan), where=total > 0)


def recall(confusion: CountArray) -> FloatArray:
    """(..., class) share of each true class found, from counts (..., true, predicted).

    NaN for an absent class.
    """
    hits = np.diagonal(confusion, axis1=-2, axis2=-1)
    return ratio(hits, confusion.sum(axis=-1))


def balanced_accuracy(confusion: CountArray) -> FloatArray:
    """(...) mean recall over the classes present, from counts (..., true, predicted)."""
    return _nanmean(recall(confusion))


def macro_f1(confusion: CountArray) -> FloatArray:
    """(...) mean over the classes present of the harmonic mean of precision and recall."""
    true_total, predicted_total = confusion.sum(axis=-1), confusion.sum(axis=-2)
    hits = np.diagonal(confusion, axis1=-2, axis2=-1).astype(float)
    total = true_total + predicted_total
    f1 = np.divide(
        2 * hits, total, out=np.full(total.shape, np.nan), where=true_total > 0
    )
    return _nanmean(f1)


def share_right(confusion: CountArray) -> FloatArray:
    """(...) share of right predictions, from counts (..., true, predicted).

    NaN without any record.
    """
    right = np.trace(confusion, axis1=-2, axis2=-1)
    return ratio(right, confusion.sum(axis=(-2, -1)))


MEASURES: dict[str, Callable[[CountArray], FloatArray]] = {
    "balanced_accuracy": balanced_accuracy,
    "macro_f1": macro_f1,
    "share_right": share_right,
}
ACCURACY = "balanced_accuracy"
SCORES = (ACCURACY, "macro_f1")  # of every method, in ``metrics.json``


def score_with_interval(
    name: str,
    confusion: CountArray,
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
    machines: Machines | None = None,
    shuffled: bool = False,
) -> dict[str, Any]:
    """Score with a 95 % interval by bootstrap over machines, or over what they share.

    Parameters
    ----------
    name : key of `MEASURES`
    confusion : (seed, unit, true class, predicted class) counts of records
    n_bootstrap : resamples of the machines, with all their records, and of the seeds
    rng : source of the resamples
    machines : of the units, in their order; None for units that share nothing
    shuffled : True for shuffled training labels; the interval then covers the luck of the shuffle

    Returns
    -------
    as `diagnose.scoring.intervals.of_seeds`
    """
    score = MEASURES[name]
    per_seed = score(confusion.sum(axis=1))
    machines = machines or Machines.alone(confusion.shape[1])
    support, drawn = machines.support(), machines.drawn(n_bootstrap, rng)
    resampled = score(np.einsum("bu,sutp->bstp", drawn, confusion))
    if shuffled:
        luck = _renaming_luck(name, confusion.sum(axis=1), n_bootstrap, rng)
        resampled = resampled + luck
    values = np.clip(over_drawn_seeds(resampled, rng), 0, 1)
    return of_seeds(per_seed, values, support)


def ratio_with_interval(
    name: str,
    confusion: CountArray,
    reference: CountArray,
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
    machines: Machines | None = None,
) -> Interval:
    """Ratio of a score to that of a reference on the same machines, with a 95 % interval.

    Parameters
    ----------
    name : key of `MEASURES`
    confusion, reference : (seed, unit, true class, predicted class) counts of records; the same
        units in the same order. Both scores are means over their seeds
    n_bootstrap : resamples; each draws the machines once for both, and the seeds of each
    rng : source of the resamples
    machines : of the units, in their order; None for units that share nothing
    """
    score, machines = MEASURES[name], machines or Machines.alone(confusion.shape[1])
    support, drawn = machines.support(), machines.drawn(n_bootstrap, rng)
    values = []
    for counts in (confusion, reference):
        resampled = score(np.einsum("bu,sutp->bstp", drawn, counts))
        mean = score(counts.sum(axis=1)).mean()
        values.append(np.concatenate([[mean], over_drawn_seeds(resampled, rng)]))
    least = np.finfo(float).tiny  # for a reference that finds nothing in a resample
    return with_interval(values[0] / np.maximum(values[1], least), support, "linear")


def over_drawn_seeds(resampled: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(draw,) means of (draw, seed) values over as many seeds, drawn for each draw."""
    seeds = rng.integers(resampled.shape[1], size=resampled.shape)
    return np.take_along_axis(resampled, seeds, axis=1).mean(axis=1)


def _renaming_luck(
    name: str, confusion: CountArray, n_draws: int, rng: np.random.Generator
) -> FloatArray:
    """Deviation of a score, (draw, seed), if the predicted classes are renamed at random.

    A network that finds the groups without their names scores by luck: all of a class right or
    wrong. Without a leak all namings are equally likely, so that the other namings show the
    spread of the one at hand.
    """
    n_seeds, n_classes = confusion.shape[:2]
    names = rng.permuted(np.tile(np.arange(n_classes), (n_draws, n_seeds, 1)), axis=2)
    renamed = np.take_along_axis(confusion[None], names[:, :, None, :], axis=3)
    scores = MEASURES[name](renamed)
    return scores - scores.mean(axis=0)


def _nanmean(values: FloatArray) -> FloatArray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", category=RuntimeWarning)
        return np.nanmean(values, axis=-1)
