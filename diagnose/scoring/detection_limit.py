"""Detection limits: severities from which a fault of any class is found at 5 % false alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.groups import groups_of
from diagnose.data.windows import HEALTHY, FloatArray, IntArray
from diagnose.scoring.alarms import (
    FALSE_ALARMS,
    LEAST_HEALTHY,
    Mask,
    alarm_threshold,
    areas,
)
from diagnose.scoring.detection_curve import (
    LEAST_RECORDS,
    LEAST_SIZES,
    SHARES,
    curve_at,
    fit_curves,
    limits,
)
from diagnose.scoring.intervals import (
    Interval,
    interval_text,
    is_above,
    share_with_interval,
    with_interval,
)
from diagnose.scoring.judged import Judged
from diagnose.scoring.machines import CountArray, Support
from diagnose.scoring.metrics import ratio
from gensig.text.amounts import finite

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

Sizes = Mapping[
    str, FloatArray
]  # quantity -> (record,) values of the records of a class
RECORDS_A_GROUP = 8  # fewer make a share meaningless
MOST_GROUPS = 5
CURVE_POINTS = 41
NO_CURVE: dict[str, list[float]] = {"severity": [], "share_found": []}
CURVE_NEEDS = f"a curve needs {LEAST_RECORDS} records of {LEAST_SIZES} severities"
SIZE_FOLLOWS_SEVERITY = (
    0.95  # least rank correlation of a fault parameter that is its size
)


def detection_score(log_probability: FloatArray, healthy: int) -> FloatArray:
    """(...) log P(any fault) - log P(healthy), from log-probabilities (..., class).

    A common offset of the log-probabilities has no effect.
    """
    from scipy.special import logsumexp

    faulty = np.delete(log_probability, healthy, axis=-1)
    return logsumexp(faulty, axis=-1) - log_probability[..., healthy]


def size_columns(
    dataset: Dataset, record: IntArray, severity: FloatArray
) -> dict[str, FloatArray]:
    """Parameters of one fault class that grow with its severity: its size in physical units.

    Parameters
    ----------
    dataset : with columns ``params/fault.NAME_UNIT``
    record : records of the class
    severity : (record,) of them

    Returns
    -------
    parameter -> (record,) values
    """
    from scipy.stats import spearmanr

    sizes = {}
    for name in dataset.column_names:
        if not name.startswith("params/fault."):
            continue
        values = np.asarray(dataset.column(name))[record]
        if values.ndim != 1 or values.dtype.kind != "f":
            continue
        if not (np.isfinite(values).all() and (values > 0).all()):
            continue
        enough = min(np.unique(values).size, np.unique(severity).size) >= LEAST_SIZES
        if enough and spearmanr(values, severity).statistic >= SIZE_FOLLOWS_SEVERITY:
            sizes[name.removeprefix("params/fault.")] = values
    return sizes


@dataclass(frozen=True, slots=True, kw_only=True)
class _Alarms:
    """Alarms of one method on all machines, then on resampled machines and trainings.

    Attributes
    ----------
    judged : the method on the test records
    healthy : (record,) bool
    scores : (seed, record) of `detection_score`
    drawn : (1 + resample, unit) number of times that each unit was drawn
    seeds : (1 + resample, seed) trainings drawn
    weight : (1 + resample, record) number of times that each record was drawn
    detected : (1 + resample, record) share of the drawn trainings that raise an alarm; NaN where
        there is no threshold
    has_threshold : whether there is one
    """

    judged: Judged
    healthy: Mask
    scores: FloatArray
    drawn: CountArray
    seeds: IntArray
    weight: FloatArray
    detected: FloatArray
    has_threshold: bool

    def n_units(self, member: Mask) -> int:
        """Number of units of some records."""
        return int(np.unique(self.judged.unit[member]).size)

    def support(self, member: Mask) -> Support:
        """Groups of machines behind some records."""
        return self.judged.of(member).support

    def share(self, member: Mask) -> Interval:
        """Share of some records that raise an alarm."""
        weight = self.weight[:, member]
        alarms = (weight * self.detected[:, member]).sum(axis=1)
        shares = ratio(alarms, weight.sum(axis=1))
        return share_with_interval(shares, self.support(member))

    def area(self, faulty: Mask) -> Interval:
        """Area under the ROC curve, mean over the trainings drawn."""
        unit = self.judged.unit
        of_seeds = areas(self.scores, faulty, self.healthy, unit, self.drawn)
        area = np.take_along_axis(of_seeds, self.seeds, axis=1).mean(axis=1)
        return with_interval(area, self.support(faulty))

    def of_class(self, member: Mask, sizes: Sizes) -> dict[str, Any]:
        """Results of one class, without its summary."""
        result: dict[str, Any] = {
            "n_records": int(member.sum()),
            "n_units": self.n_units(member),
            "auroc": self.area(member),
            "share_found": self.share(member),
            "by_severity": [],
            "limits": [],
            "curve": NO_CURVE,
        }
        if not self.has_threshold:
            return result
        support = self.support(member)
        detected, weight = self.detected[:, member], self.weight[:, member]
        for quantity, size in sizes.items():
            result["limits"] += _limit_rows(quantity, size, detected, weight, support)
        severity = sizes.get("severity")
        result["by_severity"] = self.by_severity(severity, member)
        result["curve"] = _curve(severity, detected[:1], weight[:1])
        return result

    def by_severity(
        self, severity: FloatArray | None, member: Mask
    ) -> list[dict[str, Any]]:
        """Share found and share given the right class in groups of severity.

        Empty if it does not vary.
        """
        if severity is None or np.unique(severity).size < 2:
            return []
        judged = self.judged
        rows = []
        right = (judged.predicted == judged.truth).mean(axis=0)
        most = int(np.clip(severity.size // RECORDS_A_GROUP, 2, MOST_GROUPS))
        for group in groups_of(severity, most=most):
            inside = np.zeros_like(member)
            inside[np.flatnonzero(member)[group.member]] = True
            rows.append(
                {
                    "severity_low": group.low,
                    "severity_high": group.high,
                    "n_records": int(inside.sum()),
                    "n_units": self.n_units(inside),
                    "share_found": self.share(inside),
                    "share_right_class": float(right[inside].mean()),
                }
            )
        return rows


def detection(
    judged: Judged,
    held_back: Judged | None,
    *,
    class_names: Sequence[str],
    sizes: Mapping[str, Sizes],
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Faults that one method finds at 5 % false alarms, by class and by size, and its limits.

    The threshold of each training is set on healthy records of other machines. Fewer than
    `LEAST_HEALTHY` give none: areas alone are told then, and ``missing`` says the reason.

    Parameters
    ----------
    judged : one method on the test records
    held_back : the same on healthy and reference records of validation machines; None without any
    class_names : one of them "healthy"
    sizes : for each class, sizes (record,) of its test records in their order, by name
    n_bootstrap : resamples of the machines of both parts, so that the intervals include the
        uncertainty of the threshold
    rng : source of the resamples
    """
    healthy = list(class_names).index(HEALTHY)
    scores = detection_score(judged.answers, healthy)
    drawn = _drawn(judged, n_bootstrap, rng)
    missing = why_no_threshold(held_back)
    thresholds = np.full((1 + n_bootstrap, judged.n_seeds), np.nan)
    if held_back is not None and missing is None:
        thresholds = _thresholds(held_back, healthy, n_bootstrap, rng)
    resampled_seeds = rng.integers(judged.n_seeds, size=(n_bootstrap, judged.n_seeds))
    seeds = np.concatenate([np.arange(judged.n_seeds)[None], resampled_seeds])
    alarms = _Alarms(
        judged=judged,
        healthy=judged.truth == healthy,
        scores=scores,
        drawn=drawn,
        seeds=seeds,
        weight=drawn[:, judged.unit].astype(float),
        detected=_detected(scores, thresholds, seeds),
        has_threshold=missing is None,
    )
    false_alarms = alarms.share(alarms.healthy)
    classes = {}
    for index, name in enumerate(class_names):
        member = judged.truth == index
        if index != healthy and member.any():
            result = alarms.of_class(member, sizes.get(name, {}))
            result["summary"] = _sentence(name, result, false_alarms, missing)
            classes[name] = result
    return {
        "method": judged.method,
        "false_alarms_wanted": FALSE_ALARMS,
        "missing": missing,
        "threshold": [finite(value) for value in thresholds[0]],
        "threshold_from": _source(held_back),
        "false_alarms": false_alarms,
        "too_many_false_alarms": is_above(false_alarms, FALSE_ALARMS),
        "classes": classes,
    }


def why_no_threshold(held_back: Judged | None) -> str | None:
    """Reason why healthy records of validation machines give no threshold; None if they do."""
    n_records = 0 if held_back is None else held_back.truth.size
    if n_records >= LEAST_HEALTHY:
        return None
    return (
        f"a threshold for {FALSE_ALARMS:.0%} false alarms needs {LEAST_HEALTHY} healthy or "
        f"reference records of validation machines, and there are {n_records}: "
        "raise plan.n_units or plan.n_reference"
    )


def _source(held_back: Judged | None) -> str:
    """Records that a threshold is set on, in words."""
    if held_back is None:
        return "no healthy record of a validation machine"
    n_units = np.unique(held_back.unit).size
    return f"{held_back.truth.size} healthy records of {n_units} validation machines"


def _drawn(judged: Judged, n_bootstrap: int, rng: np.random.Generator) -> CountArray:
    """All machines once, then the resamples: (1 + resample, unit)."""
    once = np.ones((1, judged.n_units), dtype=np.int64)
    return np.concatenate([once, judged.machines.drawn(n_bootstrap, rng)])


def _thresholds(
    held_back: Judged, healthy: int, n_bootstrap: int, rng: np.random.Generator
) -> FloatArray:
    """(1 + resample, seed) thresholds, all machines once and then resampled."""
    weight = _drawn(held_back, n_bootstrap, rng)[:, held_back.unit]
    weight[weight.sum(axis=1) == 0] = 1  # a resample without a healthy record
    scores = detection_score(held_back.answers, healthy)
    return np.stack([alarm_threshold(row, weight) for row in scores], axis=1)


def _detected(
    scores: FloatArray, thresholds: FloatArray, seeds: IntArray
) -> NDArray[np.float32]:
    """(1 + resample, record) share of the trainings drawn whose score is above their threshold.

    NaN without thresholds.
    """
    detected = np.full((len(seeds), scores.shape[1]), np.nan, dtype=np.float32)
    if np.isfinite(thresholds).all():
        for row, drawn in enumerate(seeds):
            detected[row] = (scores[drawn] > thresholds[row, drawn, None]).mean(axis=0)
    return detected


def _has_curve(size: FloatArray) -> bool:
    return size.size >= LEAST_RECORDS and np.unique(size).size >= LEAST_SIZES


def _limit_rows(
    quantity: str,
    size: FloatArray,
    detected: FloatArray,
    weight: FloatArray,
    support: Support,
) -> list[dict[str, Any]]:
    """Detection limits of one class in one quantity, one row for each of `SHARES`."""
    if not _has_curve(size):
        return []
    coefficients = fit_curves(size, detected, weight)
    rows = []
    for share in SHARES:
        values = limits(coefficients, size, share)
        interval = with_interval(values, support)
        status = "reached"
        if values[0] == size.min():
            status = "at_smallest_tested"
        elif np.isinf(values[0]):
            status = "not_reached"
        rows.append(
            {
                "quantity": quantity,
                "share": share,
                "status": status,
                "value": interval["mean"],
                "low": interval["low"],
                "high": interval["high"],
                "share_of_resamples_reached": float(np.isfinite(values[1:]).mean()),
                "smallest_tested": float(size.min()),
                "largest_tested": float(size.max()),
            }
        )
    return rows


def _curve(
    severity: FloatArray | None, detected: FloatArray, weight: FloatArray
) -> dict[str, list[float]]:
    """The fitted curve over severity, for figures; empty if there is none."""
    if severity is None or not _has_curve(severity):
        return NO_CURVE
    at = np.linspace(severity.min(), severity.max(), CURVE_POINTS)
    share = curve_at(fit_curves(severity, detected, weight), at, severity)[0]
    return {"severity": at.tolist(), "share_found": share.tolist()}


def _sentence(
    name: str, result: Mapping[str, Any], false_alarms: Interval, missing: str | None
) -> str:
    if missing is not None:
        return f"{name}: AUROC {interval_text(result['auroc'])}; {missing}."
    text = f"{name}: {interval_text(result['share_found'])} of {records_behind(result)} found "
    if false_alarms["mean"] is not None:
        text += f"at {false_alarms['mean']:.0%} false alarms"
    if too_few_for_curve(result):
        text += f"; from what severity on is not told: {CURVE_NEEDS}"
    for row in result["limits"]:
        if row["quantity"] != "severity":
            continue
        text += f"; {row['share']:.0%} are found {_limit_text(row)}"
        others = [
            f"{other['quantity']} {_ends(other)}"
            for other in result["limits"]
            if other["share"] == row["share"]
            and other["quantity"] != "severity"
            and other["status"] == "reached"
        ]
        if row["status"] == "reached" and others:
            text += f" ({', '.join(others)})"
    return text + "."


def records_behind(result: Mapping[str, Any]) -> str:
    """Numbers of records and machines behind the results of a class, in words."""
    return f"{result['n_records']} records of {result['n_units']} machines"


def too_few_for_curve(result: Mapping[str, Any]) -> bool:
    """True if the severity of a class varies, but over too few records for a curve."""
    return bool(result["by_severity"]) and not result["curve"]["severity"]


def _limit_text(row: Mapping[str, Any]) -> str:
    if row["status"] == "not_reached":
        return f"at no severity up to {row['largest_tested']:.2f}"
    if row["status"] == "at_smallest_tested":
        return f"at every severity from {row['smallest_tested']:.2f} on"
    return f"from severity {_ends(row)} on"


def _ends(row: Mapping[str, Any]) -> str:
    """Limit with its interval; an open upper end lies beyond what was tested."""
    if row["low"] is None and row["high"] is None:
        return f"{row['value']:.2f}"
    high = "beyond the largest tested"
    if row["high"] is not None:
        high = f"{row['high']:.2f}"
    return f"{row['value']:.2f} [{row['low']:.2f}, {high}]"
