"""Predictions of a method for the test records of a protocol, and scores on resampled units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.metrics import (
    LEAST_UNITS,
    CountArray,
    balanced_accuracy,
    over_drawn_seeds,
)

Interval = dict[str, float | None]

NO_INTERVAL = "[too few machines]"


def share_right(confusion: CountArray) -> FloatArray:
    """(...) share of right predictions, from counts (..., true, predicted).

    NaN without any record.
    """
    total = confusion.sum(axis=(-2, -1))
    right = np.trace(confusion, axis1=-2, axis2=-1).astype(float)
    return np.divide(right, total, out=np.full(total.shape, np.nan), where=total > 0)


MEASURES: dict[str, Callable[[CountArray], FloatArray]] = {
    "balanced_accuracy": balanced_accuracy,
    "share_right": share_right,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Predictions of one method for test records.

    Attributes
    ----------
    method : its name
    label : (record,) true class
    unit : (record,) 0 to n_units - 1, the unit of each record
    n_units : of the whole test part
    log_probability : (seed, record, class), or scores that rank in the same order; one seed for a
        method without seeds
    """

    method: str
    label: IntArray
    unit: IntArray
    n_units: int
    log_probability: FloatArray

    @property
    def predicted(self) -> IntArray:
        """(seed, record) the most probable class."""
        return self.log_probability.argmax(axis=-1)

    @property
    def n_seeds(self) -> int:
        """Number of trainings."""
        return int(self.log_probability.shape[0])

    def of(self, records: IntArray | NDArray[np.bool_]) -> Judged:
        """The same method on some of the records, with the same numbers of the units."""
        return replace(
            self,
            label=self.label[records],
            unit=self.unit[records],
            log_probability=self.log_probability[:, records],
        )

    def confusion(self) -> CountArray:
        """Counts of records, (seed, unit, true class, predicted class)."""
        n_classes = self.log_probability.shape[-1]
        counts = np.zeros(
            (self.n_seeds, self.n_units, n_classes, n_classes), dtype=np.int64
        )
        for seed, predicted in enumerate(self.predicted):
            np.add.at(counts[seed], (self.unit, self.label, predicted), 1)
        return counts


def resampled_score(
    judged: Judged, measure: str, drawn: CountArray, rng: np.random.Generator
) -> FloatArray:
    """(resample,) score of `MEASURES`, mean over resampled seeds; NaN without a drawn record.

    Parameters
    ----------
    judged : the method on the records to score
    measure : key of `MEASURES`
    drawn : (resample, unit) of `diagnose.scoring.metrics.units_drawn`, the same for all scores of
        a comparison
    rng : draws the seeds
    """
    counts = np.einsum("bu,sutp->bstp", drawn, judged.confusion())
    return over_drawn_seeds(MEASURES[measure](counts), rng)


def score(judged: Judged, measure: str) -> float:
    """Score of `MEASURES`, mean over the seeds."""
    return float(MEASURES[measure](judged.confusion().sum(axis=1)).mean())


def with_interval(value: float, resampled: FloatArray, n_units: int) -> Interval:
    """Value with its 95 % percentile interval, which is None for few units.

    Parameters
    ----------
    value : of all units
    resampled : (resample,) values of resampled units; NaN if a resample has none
    n_units : number of units behind the value; `diagnose.scoring.metrics.LEAST_UNITS` are needed

    Source: Efron & Tibshirani (1993), section 13.3.
    """
    known = resampled[~np.isnan(resampled)]
    low, high = np.nan, np.nan
    if n_units >= LEAST_UNITS and known.size:
        low, high = np.quantile(known, [0.025, 0.975], method="inverted_cdf")
    return {"mean": finite(value), "low": finite(low), "high": finite(high)}


def share_with_interval(value: float, resampled: FloatArray, n_units: int) -> Interval:
    """A share with its interval, also for 0 or 1.

    As `with_interval`. All resamples of a share of 0 or 1 are the same. Its interval is therefore
    extended to that of as many independent trials as there are units.

    Source: Clopper & Pearson (1934), "The use of confidence or fiducial limits illustrated in the
    case of the binomial", Biometrika 26 (4).
    """
    from scipy.stats import binomtest

    interval = with_interval(value, resampled, n_units)
    low, high = interval["low"], interval["high"]
    if value in (0.0, 1.0) and low is not None and high is not None:
        trials = binomtest(round(value * n_units), n_units)
        exact = trials.proportion_ci(0.95, method="exact")
        interval["low"] = min(low, float(exact.low))
        interval["high"] = max(high, float(exact.high))
    return interval


def finite(value: float) -> float | None:
    """A number that JSON can hold; None for one that is not finite."""
    return float(value) if np.isfinite(value) else None


def interval_text(scored: Mapping[str, Any], form: str = ".2f") -> str:
    """Value and interval in words, as ``0.53 [0.46, 0.59]``, or with `NO_INTERVAL`."""
    mean, low, high = (scored[key] for key in ("mean", "low", "high"))
    if mean is None:
        return "unknown"
    if low is None and high is None:
        return f"{mean:{form}} {NO_INTERVAL}"
    ends = ["?" if end is None else f"{end:{form}}" for end in (low, high)]
    return f"{mean:{form}} [{ends[0]}, {ends[1]}]"
