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
N_DRAWS = 100


def probabilities(log_probability: FloatArray, temperature: float = 1.0) -> FloatArray:
    """Class probabilities (record, class) at a temperature; which class is the largest does not
    depend on it.

    Parameters
    ----------
    log_probability : (record, class) mean over a record's windows; `diagnose.scoring.metrics.over_records`
    temperature : above 1 makes probabilities more equal, below 1 more different

    Source: Guo, Pleiss, Sun & Weinberger (2017), "On calibration of modern neural networks",
    ICML, section 4.2.
    """
    return np.exp(_scaled(log_probability, temperature))


def fit_temperature(log_probability: FloatArray, label: IntArray) -> float:
    """Temperature with the least cross-entropy over records that took no part in the training.

    Without more, a network that errs on none of few records would be certain of everything. So
    the logarithm of the temperature has a normal prior, mean 0 and standard deviation 1, which
    weighs as much as one record. This is ours.

    Parameters
    ----------
    log_probability : (record, class) mean over the windows of a record
    label : (record,)

    Source: Guo et al. (2017), section 4.2.
    """
    from scipy.optimize import minimize_scalar

    rows = np.arange(label.size)

    def loss(log_temperature: float) -> float:
        fitted = _scaled(log_probability, np.exp(log_temperature))[rows, label]
        return float(log_temperature**2 / 2 - fitted.sum())

    return float(
        np.exp(minimize_scalar(loss, bounds=LOG_TEMPERATURE_BOUNDS, method="bounded").x)
    )


def reliability(
    confidence: FloatArray, right: NDArray[np.bool_]
) -> list[dict[str, float | int]]:
    """Share of right predictions against the probability given to them, in `N_BINS` equal bins;
    empty ones left out.

    Parameters
    ----------
    confidence : (record,) probability of the predicted class
    right : (record,) whether the predicted class is the true one
    """
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
    """Expected calibration error of the rows of `reliability`: mean distance of confidence and
    accuracy over records.

    Few records make it large by chance alone, see `error_by_chance`.

    Source: Naeini, Cooper & Hauskrecht (2015), "Obtaining well calibrated probabilities using
    Bayesian binning", AAAI.
    """
    total = sum(row["n_records"] for row in rows)
    return float(
        sum(row["n_records"] * abs(row["confidence"] - row["accuracy"]) for row in rows)
        / total
    )


def error_by_chance(confidence: FloatArray) -> float:
    """Calibration error that such probabilities (record,) have on average when every one of them
    is true.
    """
    rng = np.random.default_rng(0)
    draws = rng.uniform(size=(N_DRAWS, confidence.size)) < confidence
    return float(
        np.mean([calibration_error(reliability(confidence, right)) for right in draws])
    )


def calibration_scores(
    log_probabilities: Sequence[FloatArray],
    labels: Sequence[IntArray],
    temperatures: Sequence[float],
) -> dict[str, Any]:
    """Calibration over test records before and after scaling, one entry a seed; reliability of
    all seeds together.

    Parameters
    ----------
    log_probabilities : for each seed (record, class)
    labels : for each seed (record,)
    temperatures : one a seed
    """
    result: dict[str, Any] = {
        "temperature": [float(value) for value in temperatures],
        "n_bins": N_BINS,
    }
    right = [
        values.argmax(axis=1) == truth
        for values, truth in zip(log_probabilities, labels, strict=True)
    ]
    for name, scales in (
        ("before", [1.0] * len(temperatures)),
        ("after", temperatures),
    ):
        logs = [
            _scaled(values, scale)
            for values, scale in zip(log_probabilities, scales, strict=True)
        ]
        confidence = [np.exp(values.max(axis=1)) for values in logs]
        result[name] = {
            "expected_calibration_error": [
                calibration_error(reliability(sure, hits))
                for sure, hits in zip(confidence, right, strict=True)
            ],
            "error_by_chance": [error_by_chance(sure) for sure in confidence],
            "cross_entropy": [
                -float(np.mean(values[np.arange(truth.size), truth]))
                for values, truth in zip(logs, labels, strict=True)
            ],
            "reliability": reliability(
                np.concatenate(confidence), np.concatenate(right)
            ),
        }
    return result


def _scaled(log_probability: FloatArray, temperature: float) -> FloatArray:
    """(record, class) log-probabilities at a temperature, each row summing to 1 as probabilities."""
    scores = np.asarray(log_probability, dtype=float) / temperature
    scores = scores - scores.max(axis=1, keepdims=True)
    return scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
