"""Calibration of probabilities by one temperature, fitted on validation units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray, IntArray

N_BINS = 10
LOG_TEMPERATURE_BOUNDS = (-4.0, 4.0)
N_DRAWS = 100


def probabilities(log_probability: FloatArray, temperature: float = 1.0) -> FloatArray:
    """Class probabilities (record, class) at a temperature, which keeps their order.

    Parameters
    ----------
    log_probability : (record, class) mean over a record's windows, of
        `diagnose.scoring.metrics.over_records`
    temperature : above 1 makes probabilities more equal, below 1 more different

    Source: Guo, Pleiss, Sun & Weinberger (2017), "On calibration of modern neural networks",
    ICML, section 4.2.
    """
    return np.exp(_scaled(log_probability, temperature))


def fit_temperature(log_probability: FloatArray, label: IntArray) -> float:
    """Temperature with the least cross-entropy over records that took no part in the training.

    Cross-entropy alone would make a network certain of everything if it errs on none of few
    records. So the logarithm of the temperature has a normal prior, mean 0 and standard deviation
    1, which weighs as much as one record. This is ours.

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

    best = minimize_scalar(loss, bounds=LOG_TEMPERATURE_BOUNDS, method="bounded")
    return float(np.exp(best.x))


def reliability(
    confidence: FloatArray, right: NDArray[np.bool_]
) -> list[dict[str, float | int]]:
    """Share of right predictions and mean probability in `N_BINS` equal bins, but empty ones.

    Parameters
    ----------
    confidence : (record,) probability of the predicted class
    right : (record,) True if the predicted class is the true one
    """
    bins = np.clip(np.ceil(confidence * N_BINS).astype(int) - 1, 0, N_BINS - 1)
    rows: list[dict[str, float | int]] = []
    for index in np.unique(bins):
        inside = bins == index
        rows.append(
            {
                "confidence": float(confidence[inside].mean()),
                "accuracy": float(right[inside].mean()),
                "n_records": int(inside.sum()),
            }
        )
    return rows


def calibration_error(rows: Sequence[dict[str, float | int]]) -> float:
    """Expected calibration error: mean distance of confidence and accuracy over records.

    `rows` are those of `reliability`. Few records make it large by chance, see `error_by_chance`.

    Source: Naeini, Cooper & Hauskrecht (2015), "Obtaining well calibrated probabilities using
    Bayesian binning", AAAI.
    """
    total = sum(row["n_records"] for row in rows)
    errors = (
        row["n_records"] * abs(row["confidence"] - row["accuracy"]) for row in rows
    )
    return float(sum(errors) / total)


def error_by_chance(confidence: FloatArray) -> float:
    """Mean calibration error of probabilities (record,) that are all true."""
    rng = np.random.default_rng(0)
    draws = rng.uniform(size=(N_DRAWS, confidence.size)) < confidence
    errors = [calibration_error(reliability(confidence, right)) for right in draws]
    return float(np.mean(errors))


def calibration_scores(
    log_probabilities: Sequence[FloatArray],
    labels: Sequence[IntArray],
    temperatures: Sequence[float],
) -> dict[str, Any]:
    """Calibration over test records before and after scaling.

    Lists have one entry a seed; the reliability is that of all seeds together.

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
    ones = [1.0] * len(temperatures)
    for name, scales in (("before", ones), ("after", temperatures)):
        confidences, hits, errors, losses = [], [], [], []
        for values, label, scale in zip(log_probabilities, labels, scales, strict=True):
            scaled = _scaled(values, scale)
            confidence = np.exp(scaled.max(axis=1))
            right = values.argmax(axis=1) == label
            confidences.append(confidence)
            hits.append(right)
            errors.append(calibration_error(reliability(confidence, right)))
            losses.append(-float(np.mean(scaled[np.arange(label.size), label])))
        result[name] = {
            "expected_calibration_error": errors,
            "error_by_chance": [error_by_chance(values) for values in confidences],
            "cross_entropy": losses,
            "reliability": reliability(
                np.concatenate(confidences), np.concatenate(hits)
            ),
        }
    return result


def _scaled(log_probability: FloatArray, temperature: float) -> FloatArray:
    """(record, class) log-probabilities at a temperature; probabilities of a row sum to 1."""
    scores = np.asarray(log_probability, dtype=float) / temperature
    scores = scores - scores.max(axis=1, keepdims=True)
    return scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
