"""What a method said of the test records of a protocol, and its scores on resampled units, alike
for every question.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.scoring.metrics import LEAST_UNITS, balanced_accuracy

IntArray = NDArray[np.integer]
FloatArray = NDArray[np.floating]
BoolArray = NDArray[np.bool_]
Interval = dict[str, float | None]

NO_INTERVAL = "[too few machines]"


def share_right(confusion: NDArray[np.integer]) -> FloatArray:
    """(...) share of records given their own class, from counts (..., true, predicted).

    NaN where there is none.
    """
    total = confusion.sum(axis=(-2, -1))
    right = np.trace(confusion, axis1=-2, axis2=-1).astype(float)
    return np.divide(right, total, out=np.full(total.shape, np.nan), where=total > 0)


MEASURES: dict[str, Callable[[NDArray[np.integer]], FloatArray]] = {
    "balanced_accuracy": balanced_accuracy,
    "share_right": share_right,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """One method on test records.

    Attributes
    ----------
    method : its name
    label : (record,) true class
    unit : (record,) 0 to n_units - 1, the unit of each record
    n_units : of the whole test part
    log_probability : (seed, record, class), or scores that rank alike; one seed where the method has none
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
        """Trainings."""
        return int(self.log_probability.shape[0])

    def of(self, records: IntArray | BoolArray) -> Judged:
        """The same method on some of the records, the units numbered as before."""
        return replace(
            self,
            label=self.label[records],
            unit=self.unit[records],
            log_probability=self.log_probability[:, records],
        )

    def confusion(self) -> NDArray[np.int64]:
        """Counts of records, (seed, unit, true class, predicted class)."""
        n_classes = self.log_probability.shape[-1]
        counts = np.zeros(
            (self.n_seeds, self.n_units, n_classes, n_classes), dtype=np.int64
        )
        for seed, predicted in enumerate(self.predicted):
            np.add.at(counts[seed], (self.unit, self.label, predicted), 1)
        return counts


def units_drawn(
    n_units: int, n_bootstrap: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """How often each resample holds each unit, (resample, unit): as many draws with replacement
    as there are units.

    Source: Efron & Tibshirani (1993), "An introduction to the bootstrap", section 8.3 (units, not
    records, are drawn).
    """
    return rng.multinomial(n_units, np.full(n_units, 1 / n_units), size=n_bootstrap)


def resampled_score(
    judged: Judged, measure: str, drawn: NDArray[np.int64], rng: np.random.Generator
) -> FloatArray:
    """(resample,) score of `MEASURES`, mean over seeds that are drawn anew too; NaN where no
    record was drawn.

    Parameters
    ----------
    judged : the method on the records to score
    measure : key of `MEASURES`
    drawn : (resample, unit) of `units_drawn`, the same for scores that are to be compared
    rng : draws the seeds
    """
    per_seed = MEASURES[measure](np.einsum("bu,sutp->bstp", drawn, judged.confusion()))
    seeds = rng.integers(judged.n_seeds, size=per_seed.shape)
    return np.take_along_axis(per_seed, seeds, axis=1).mean(axis=1)


def score(judged: Judged, measure: str) -> float:
    """Score of `MEASURES`, mean over the seeds."""
    return float(MEASURES[measure](judged.confusion().sum(axis=1)).mean())


def with_interval(value: float, resampled: FloatArray, n_units: int) -> Interval:
    """Value with its 95 % percentile interval; None for fewer units than
    `diagnose.scoring.metrics.LEAST_UNITS`.

    Parameters
    ----------
    value : of all units
    resampled : (resample,) values of resampled units; NaN where a resample has none
    n_units : that the value rests on

    Source: Efron & Tibshirani (1993), section 13.3.
    """
    known = resampled[~np.isnan(resampled)]
    if n_units < LEAST_UNITS or not known.size:
        return {"mean": finite(value), "low": None, "high": None}
    low, high = np.quantile(known, [0.025, 0.975], method="inverted_cdf")
    return {"mean": finite(value), "low": finite(low), "high": finite(high)}


def share_with_interval(value: float, resampled: FloatArray, n_units: int) -> Interval:
    """A share with its interval; none or all of few units do not show that it is 0 or 1.

    As `with_interval`, and for a share of 0 or 1, which no resample can leave, also what so many
    units say if each of them is one trial.

    Source: Clopper & Pearson (1934), "The use of confidence or fiducial limits illustrated in the
    case of the binomial", Biometrika 26 (4).
    """
    from scipy.stats import binomtest

    interval = with_interval(value, resampled, n_units)
    if (
        value in (0.0, 1.0)
        and interval["low"] is not None
        and interval["high"] is not None
    ):
        exact = binomtest(round(value * n_units), n_units).proportion_ci(
            0.95, method="exact"
        )
        interval["low"] = min(interval["low"], float(exact.low))
        interval["high"] = max(interval["high"], float(exact.high))
    return interval


def finite(value: float) -> float | None:
    """A number that JSON can hold; None for one that is not finite."""
    return float(value) if np.isfinite(value) else None


def interval_text(scored: Mapping[str, Any], form: str = ".2f") -> str:
    """Value and interval in words, as ``0.53 [0.46, 0.59]``, or `NO_INTERVAL` behind a value that
    has none.
    """
    mean, low, high = (scored[key] for key in ("mean", "low", "high"))
    if mean is None:
        return "unknown"
    if low is None and high is None:
        return f"{mean:{form}} {NO_INTERVAL}"
    ends = ["?" if end is None else f"{end:{form}}" for end in (low, high)]
    return f"{mean:{form}} [{ends[0]}, {ends[1]}]"
