"""Values with 95 % intervals over resampled machines, and their words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypedDict

import numpy as np

from diagnose.data.windows import FloatArray
from diagnose.scoring.machines import MACHINES, Support

Quantile = Literal["linear", "inverted_cdf"]  # of numpy
Side = Literal["above", "below", "neither"]


class Interval(TypedDict):
    """Value with its 95 % interval; ``too_few`` names the groups that are too few for one."""

    mean: float | None
    low: float | None
    high: float | None
    too_few: str | None


def percentile_interval(
    resampled: FloatArray, support: Support, quantile: Quantile = "linear"
) -> tuple[float | None, float | None]:
    """95 % interval of (resample,) values, NaN left out; None for few groups or no value.

    Source: Efron & Tibshirani (1993), "An introduction to the bootstrap", section 13.3. With few
    groups it is too narrow: it is no wider than what those at hand show.
    """
    known = resampled[~np.isnan(resampled)]
    if support.too_few or not known.size:
        return None, None
    low, high = np.quantile(known, [0.025, 0.975], method=quantile)
    return finite(low), finite(high)


def with_interval(
    values: FloatArray, support: Support, quantile: Quantile = "inverted_cdf"
) -> Interval:
    """Value with its `percentile_interval`.

    Parameters
    ----------
    values : (1 + resample,) of all machines, then of resampled ones; NaN if a resample has none
    support : groups behind the value; `diagnose.scoring.machines.LEAST_UNITS` are needed
    quantile : ``inverted_cdf`` for values that may be infinite
    """
    low, high = percentile_interval(values[1:], support, quantile)
    return {
        "mean": finite(values[0]),
        "low": low,
        "high": high,
        "too_few": support.too_few,
    }


def of_seeds(
    per_seed: FloatArray, resampled: FloatArray, support: Support
) -> dict[str, Any]:
    """Mean of the values (seed,) of trainings with the interval of (resample,) means of them."""
    low, high = percentile_interval(resampled, support)
    return {
        "mean": float(np.mean(per_seed)),
        "low": low,
        "high": high,
        "per_seed": tuple(per_seed.tolist()),
        "too_few": support.too_few,
    }


def share_with_interval(values: FloatArray, support: Support) -> Interval:
    """A share of records with its interval; values as of `with_interval`.

    It is the exact interval of as many independent trials as there are groups of machines, extended
    to that of `with_interval`, which has the spread of trainings and thresholds too. A resample of
    few groups cannot show what none of them did.

    Source: Clopper & Pearson (1934), "The use of confidence or fiducial limits illustrated in the
    case of the binomial", Biometrika 26 (4).
    """
    interval = with_interval(values, support)
    ends = interval["low"], interval["high"]
    interval["low"], interval["high"] = extended(*ends, float(values[0]), support)
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


def side_of(score: Mapping[str, Any], level: float = 0.0) -> Side | None:
    """Side of a level on which a whole interval lies; None without an interval."""
    low, high = score["low"], score["high"]
    if low is None or high is None:
        return None
    if low > level:
        return "above"
    return "below" if high < level else "neither"


def is_above(score: Mapping[str, Any], level: float) -> bool:
    """True if a whole interval lies above a level; False without an interval."""
    return side_of(score, level) == "above"
