"""Probabilities that mean what they say: one temperature, fitted on validation units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
N_BINS = 10
LOG_TEMPERATURE_BOUNDS = (-4.0, 4.0)


def probabilities(log_probability: FloatArray, temperature: float = 1.0) -> FloatArray:
    """Class probabilities (record, class) at a temperature; which class is the largest does not depend on it.

    Parameters
    ----------
    log_probability : (record, class) mean over the windows of a record, as `diagnose.metrics.over_records` gives it
    temperature : above 1 makes probabilities more equal, below 1 more different

    Source: Guo, Pleiss, Sun & Weinberger (2017), "On calibration of modern neural networks", ICML, section 4.2.
    """
    return np.exp(_scaled(log_probability, temperature))


def fit_temperature(log_probability: FloatArray, label: IntArray) -> float:
    """Temperature with the least cross-entropy over records that took no part in the training.

    A class with n records has the target (n + 1) / (n + c) for itself and 1 / (n + c) for each of the other c - 1,
    which is what n right ones in a row tell. With targets of 1 and 0, a network that errs on none of few records would
    be certain of everything. Convex in 1 / temperature, so that the minimum is the only one.

    Parameters
    ----------
    log_probability : (record, class) mean over the windows of a record
    label : (record,)

    Source: temperature by Guo et al. (2017), section 4.2; targets by Platt (1999), "Probabilistic outputs for support
    vector machines", section 2.2, for two classes, here for c.
    """
    from scipy.optimize import minimize_scalar

    n_classes = log_probability.shape[1]
    count = np.bincount(label, minlength=n_classes)[label]
    target = np.repeat(1 / (count + n_classes)[:, None], n_classes, axis=1)
    target[np.arange(label.size), label] = (count + 1) / (count + n_classes)

    def cross_entropy(log_temperature: float) -> float:
        return -float(np.mean(np.sum(target * _scaled(log_probability, np.exp(log_temperature)), axis=1)))

    return float(np.exp(minimize_scalar(cross_entropy, bounds=LOG_TEMPERATURE_BOUNDS, method="bounded").x))


def reliability(probability: FloatArray, label: IntArray) -> list[dict[str, float | int]]:
    """Share of right predictions against the probability given to them, in `N_BINS` equal bins; empty ones left out.

    Parameters
    ----------
    probability : (record, class)
    label : (record,)
    """
    confidence = probability.max(axis=1)
    right = probability.argmax(axis=1) == label
    place = np.clip(np.ceil(confidence * N_BINS).astype(int) - 1, 0, N_BINS - 1)
    return [
        {
            "confidence": float(confidence[place == index].mean()),
            "accuracy": float(right[place == index].mean()),
            "n_records": int((place == index).sum()),
        }
        for index in np.unique(place)
    ]


def calibration_error(rows: Sequence[dict[str, float | int]]) -> float:
    """Expected calibration error of the rows of `reliability`: mean distance of confidence and accuracy over records.

    Few records make it large by chance alone: it is no smaller than their scatter.

    Source: Naeini, Cooper & Hauskrecht (2015), "Obtaining well calibrated probabilities using Bayesian binning", AAAI.
    """
    total = sum(row["n_records"] for row in rows)
    return float(sum(row["n_records"] * abs(row["confidence"] - row["accuracy"]) for row in rows) / total)


def calibration_scores(
    log_probabilities: Sequence[FloatArray], labels: Sequence[IntArray], temperatures: Sequence[float]
) -> dict[str, Any]:
    """Calibration over test records before and after scaling, one entry a seed; reliability of all seeds together.

    Parameters
    ----------
    log_probabilities : for each seed (record, class)
    labels : for each seed (record,)
    temperatures : one a seed
    """
    result: dict[str, Any] = {"temperature": [float(value) for value in temperatures], "n_bins": N_BINS}
    label = np.concatenate(labels)
    for name, scales in (("before", [1.0] * len(temperatures)), ("after", temperatures)):
        parts = [probabilities(values, scale) for values, scale in zip(log_probabilities, scales, strict=True)]
        losses = [
            -float(np.mean(_scaled(values, scale)[np.arange(truth.size), truth]))
            for values, truth, scale in zip(log_probabilities, labels, scales, strict=True)
        ]
        result[name] = {
            "expected_calibration_error": [
                calibration_error(reliability(part, truth)) for part, truth in zip(parts, labels, strict=True)
            ],
            "cross_entropy": losses,
            "reliability": reliability(np.concatenate(parts), label),
        }
    return result


def _scaled(log_probability: FloatArray, temperature: float) -> FloatArray:
    """(record, class) log-probabilities at a temperature, each row summing to 1 as probabilities."""
    scores = np.asarray(log_probability, dtype=float) / temperature
    scores = scores - scores.max(axis=1, keepdims=True)
    return scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
