"""Predictions of a method for the test records of a protocol, and scores on resamples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.machines import MACHINES, CountArray, Machines, Support
from diagnose.scoring.metrics import balanced_accuracy, over_drawn_seeds


class Interval(TypedDict):
    """Value with its 95 % interval; ``too_few`` names the groups that are too few for one."""

    mean: float | None
    low: float | None
    high: float | None
    too_few: str | None


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
    machines : the units of the whole test part
    log_probability : (seed, record, class), or scores that rank in the same order; one seed for a
        method without seeds
    """

    method: str
    label: IntArray
    unit: IntArray
    machines: Machines
    log_probability: FloatArray

    @property
    def predicted(self) -> IntArray:
        """(seed, record) the most probable class."""
        return self.log_probability.argmax(axis=-1)

    @property
    def n_units(self) -> int:
        """Number of units of the whole test part."""
        return self.machines.n_units

    @property
    def support(self) -> Support:
        """Groups of machines behind a score of these records."""
        return self.machines.support(np.unique(self.unit))

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
    drawn : (resample, unit) of `diagnose.scoring.machines.Machines.drawn`, the same for all scores
        of a comparison
    rng : draws the seeds
    """
    counts = np.einsum("bu,sutp->bstp", drawn, judged.confusion())
    return over_drawn_seeds(MEASURES[measure](counts), rng)


def score(judged: Judged, measure: str) -> float:
    """Score of `MEASURES`, mean over the seeds."""
    return float(MEASURES[measure](judged.confusion().sum(axis=1)).mean())


def with_interval(value: float, resampled: FloatArray, support: Support) -> Interval:
    """Value with its 95 % percentile interval, which is None for few groups of machines.

    Parameters
    ----------
    value : of all machines
    resampled : (resample,) values of resampled machines; NaN if a resample has none
    support : groups behind the value; `diagnose.scoring.machines.LEAST_UNITS` are needed

    Source: Efron & Tibshirani (1993), section 13.3.
    """
    known = resampled[~np.isnan(resampled)]
    low, high = np.nan, np.nan
    if support.too_few is None and known.size:
        low, high = np.quantile(known, [0.025, 0.975], method="inverted_cdf")
    return {
        "mean": finite(value),
        "low": finite(low),
        "high": finite(high),
        "too_few": support.too_few,
    }


def share_with_interval(
    value: float, resampled: FloatArray, support: Support
) -> Interval:
    """A share of records with its interval.

    It is the exact interval of as many independent trials as there are groups of machines, extended
    to that of `with_interval`, which has the spread of trainings and thresholds too. A resample of
    few groups cannot show what none of them did.

    Source: Clopper & Pearson (1934), "The use of confidence or fiducial limits illustrated in the
    case of the binomial", Biometrika 26 (4).
    """
    interval = with_interval(value, resampled, support)
    ends = interval["low"], interval["high"]
    interval["low"], interval["high"] = extended(*ends, value, support)
    return interval


def extended(
    low: float | None, high: float | None, share: float, support: Support
) -> tuple[float | None, float | None]:
    """Ends of the interval of a share, extended to those of `exact_interval`.

    None stays, as of too few groups.
    """
    if low is None or high is None:
        return low, high
    exact = exact_interval(share, support.n_groups)
    return min(low, exact[0]), max(high, exact[1])


def exact_interval(share: float, n_trials: int) -> tuple[float, float]:
    """95 % interval of a share of independent trials, which need not be a whole number of them.

    Source: as `share_with_interval`; its quantiles of the beta distribution take any share.
    """
    from scipy.stats import beta

    hits = share * n_trials
    misses = n_trials - hits
    low, high = 0.0, 1.0
    if hits > 0:
        low = float(beta.ppf(0.025, hits, misses + 1))
    if misses > 0:
        high = float(beta.ppf(0.975, hits + 1, misses))
    return low, high


def finite(value: float) -> float | None:
    """A number that JSON can hold; None for one that is not finite."""
    return float(value) if np.isfinite(value) else None


def interval_text(scored: Mapping[str, Any], form: str = ".2f") -> str:
    """Value and interval in words, as ``0.53 [0.46, 0.59]``, or with `too_few_text`."""
    mean, low, high = (scored[key] for key in ("mean", "low", "high"))
    if mean is None:
        return "unknown"
    if low is None and high is None:
        return f"{mean:{form}} [{too_few_text(scored)}]"
    ends = ["?" if end is None else f"{end:{form}}" for end in (low, high)]
    return f"{mean:{form}} [{ends[0]}, {ends[1]}]"


def too_few_text(scored: Mapping[str, Any]) -> str:
    """Reason why a score has no interval, as ``too few sets of gears``."""
    return f"too few {scored.get('too_few') or MACHINES}"


def drawn_text(resampled: Mapping[str, int]) -> str:
    """Names of what an interval resamples, of `diagnose.scoring.machines.Machines.counts`."""
    return " and ".join(resampled)


def spread_text(
    scored: Mapping[str, Any], resampled: Mapping[str, int], form: str
) -> str:
    """Interval of a score in words, with what it resamples, or why there is none."""
    low, high = scored["low"], scored["high"]
    if low is None or high is None:
        return f"no 95 % interval: {too_few_text(scored)}"
    return f"95 % interval over {drawn_text(resampled)} {low:{form}} to {high:{form}}"
