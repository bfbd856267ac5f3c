"""From what severity a fault is found at 5 % false alarms, whatever class it is then given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.groups import groups_of
from diagnose.scoring.detection_curve import (
    LEAST_RECORDS,
    LEAST_SIZES,
    SHARES,
    curve_at,
    fit_curves,
    limits,
)
from diagnose.scoring.judged import (
    Interval,
    Judged,
    interval_text,
    share_with_interval,
    units_drawn,
    with_interval,
)

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

IntArray = NDArray[np.integer]
FloatArray = NDArray[np.floating]
HEALTHY = "healthy"
FALSE_ALARMS = 0.05
RECORDS_A_GROUP = 8  # fewer say nothing of a share
MOST_GROUPS = 5
CURVE_POINTS = 41
CURVE_NEEDS = f"a curve needs {LEAST_RECORDS} records of {LEAST_SIZES} severities"
SIZE_FOLLOWS_SEVERITY = (
    0.95  # least rank correlation of a fault parameter that is called its size
)


def detection_score(log_probability: FloatArray, healthy: int) -> FloatArray:
    """(...) log P(any fault) - log P(healthy), from log-probabilities (..., class) of any common
    offset.
    """
    from scipy.special import logsumexp

    faulty = np.delete(log_probability, healthy, axis=-1)
    return logsumexp(faulty, axis=-1) - log_probability[..., healthy]


def alarm_threshold(
    scores: FloatArray, weight: NDArray[np.int64], *, new: bool
) -> FloatArray:
    """(resample,) score above which at most 5 % of healthy records lie.

    With `new`, of healthy records like these but not among them: the score of rank ceil(0.95 (n +
    1)), for which n must be at least 19, else the highest one. Without it, of these records
    themselves: rank ceil(0.95 n).

    Parameters
    ----------
    scores : (record,) of healthy records
    weight : (resample, record) how often each was drawn

    Source: Vovk, Gammerman & Shafer (2005), "Algorithmic learning in a random world", chapter 2
    (conformal prediction).
    """
    order = np.argsort(scores, kind="stable")
    below = np.cumsum(weight[:, order], axis=1)
    total = below[:, -1]
    rank = np.minimum(np.ceil((1 - FALSE_ALARMS) * (total + new) - 1e-9), total)
    return scores[order][np.argmax(below >= rank[:, None], axis=1)]


def size_columns(
    dataset: Dataset, record: IntArray, severity: FloatArray
) -> dict[str, FloatArray]:
    """Parameters of one fault class that grow with its severity, (record,) each: its size in
    physical units.

    Parameters
    ----------
    dataset : with columns ``params/fault.NAME_UNIT``
    record : records of the class
    severity : (record,) of them
    """
    from scipy.stats import spearmanr

    found = {}
    for name in dataset.column_names:
        if not name.startswith("params/fault."):
            continue
        values = np.asarray(dataset.column(name))[record]
        if (
            values.ndim != 1
            or values.dtype.kind != "f"
            or not np.isfinite(values).all()
            or (values <= 0).any()
        ):
            continue
        enough = min(np.unique(values).size, np.unique(severity).size) >= LEAST_SIZES
        if enough and spearmanr(values, severity).statistic >= SIZE_FOLLOWS_SEVERITY:
            found[name.removeprefix("params/fault.")] = values
    return found


def detection(
    judged: Judged,
    validation: Judged | None,
    *,
    class_names: Sequence[str],
    sizes: Mapping[str, Mapping[str, FloatArray]],
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """How many faults one method finds at 5 % false alarms: by class, by size, and from what size
    on.

    The threshold of each training is set on the healthy validation records; on the healthy test
    records where there are fewer than 19 of the former, which is said under ``threshold_from``.

    Parameters
    ----------
    judged : one method on the test records
    validation : the same on the validation records; None where they were not judged
    class_names : one of them "healthy"
    sizes : for each class, sizes (record,) of its test records in their order, by name
    n_bootstrap : resamples of the units of both parts, so that the intervals hold for the threshold too
    rng : source of the resamples
    """
    healthy = list(class_names).index(HEALTHY)
    scores = detection_score(judged.log_probability, healthy)
    drawn = _drawn(judged, n_bootstrap, rng)
    thresholds, source = _thresholds(judged, validation, scores, drawn, healthy, rng)
    seeds = rng.integers(judged.n_seeds, size=(n_bootstrap, judged.n_seeds))
    seeds = np.concatenate([np.arange(judged.n_seeds)[None], seeds])
    found = _found(scores, thresholds, seeds)
    weight = drawn[:, judged.unit].astype(float)

    def share(member: NDArray[np.bool_]) -> Interval:
        inside = weight[:, member]
        total = inside.sum(axis=1)
        values = np.divide(
            (inside * found[:, member]).sum(axis=1),
            total,
            out=np.full(total.shape, np.nan),
            where=total > 0,
        )
        return share_with_interval(
            float(values[0]), values[1:], np.unique(judged.unit[member]).size
        )

    false_alarms = share(judged.label == healthy)
    classes = {}
    for index, name in enumerate(class_names):
        member = judged.label == index
        if index == healthy or not member.any():
            continue
        area = _area(scores, judged, member, judged.label == healthy, drawn, seeds)
        n_units = np.unique(judged.unit[member]).size
        by_size = sizes.get(name, {})
        classes[name] = {
            "n_records": int(member.sum()),
            "n_units": int(n_units),
            "auroc": with_interval(
                area[0], area[1:], min(n_units, np.unique(judged.unit).size)
            ),
            "share_found": share(member),
            "by_severity": _by_severity(by_size.get("severity"), member, judged, share),
            "limits": [
                row
                for quantity, size in by_size.items()
                for row in _limit_rows(
                    quantity, size, found[:, member], weight[:, member], int(n_units)
                )
            ],
            "curve": _curve(
                by_size.get("severity"), found[:1, member], weight[:1, member]
            ),
        }
        classes[name]["summary"] = _sentence(name, classes[name], false_alarms)
    return {
        "method": judged.method,
        "false_alarms_wanted": FALSE_ALARMS,
        "threshold_from": source,
        "false_alarms": false_alarms,
        "too_many_false_alarms": false_alarms["low"] is not None
        and false_alarms["low"] > FALSE_ALARMS,
        "classes": classes,
    }


def _drawn(
    judged: Judged, n_bootstrap: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """All units once, then the resamples: (1 + resample, unit)."""
    once = np.ones((1, judged.n_units), dtype=np.int64)
    return np.concatenate([once, units_drawn(judged.n_units, n_bootstrap, rng)])


def _thresholds(
    judged: Judged,
    validation: Judged | None,
    scores: FloatArray,
    drawn: NDArray[np.int64],
    healthy: int,
    rng: np.random.Generator,
) -> tuple[FloatArray, str]:
    """(1 + resample, seed) thresholds, and the part that they were set on."""
    new = (
        validation is not None
        and (validation.label == healthy).sum() + 1 >= 1 / FALSE_ALARMS - 1e-9
    )
    if new and validation is not None:
        part = validation.of(validation.label == healthy)
        weight = _drawn(part, len(drawn) - 1, rng)[:, part.unit]
        weight[weight.sum(axis=1) == 0] = 1  # a resample without a healthy record
        values = detection_score(part.log_probability, healthy)
    else:
        member = judged.label == healthy
        weight, values = drawn[:, judged.unit[member]].copy(), scores[:, member]
        weight[weight.sum(axis=1) == 0] = 1
    thresholds = np.stack(
        [alarm_threshold(row, weight, new=new) for row in values], axis=1
    )
    return thresholds, "healthy validation records" if new else "healthy test records"


def _found(
    scores: FloatArray, thresholds: FloatArray, seeds: IntArray
) -> NDArray[np.float32]:
    """(1 + resample, record) share of the trainings drawn whose score is above their threshold."""
    found = np.empty((len(seeds), scores.shape[1]), dtype=np.float32)
    for row, drawn in enumerate(seeds):
        found[row] = (scores[drawn] > thresholds[row, drawn, None]).mean(axis=0)
    return found


def _area(
    scores: FloatArray,
    judged: Judged,
    faulty: NDArray[np.bool_],
    healthy: NDArray[np.bool_],
    drawn: NDArray[np.int64],
    seeds: IntArray,
) -> FloatArray:
    """(1 + resample,) area under the ROC curve, mean over the trainings drawn.

    The share of pairs, one faulty and one healthy record, in which the faulty one scores higher,
    ties counting half: counted once for each pair of units, then weighted by how often both were
    drawn.
    """
    pairs = np.zeros((judged.n_units, judged.n_units))
    np.add.at(pairs, (judged.unit[healthy][:, None], judged.unit[faulty][None]), 1.0)
    n_pairs = np.einsum("bu,bv,uv->b", drawn, drawn, pairs, optimize=True)
    areas = np.full((len(drawn), judged.n_seeds), np.nan)
    for seed, values in enumerate(scores):
        won = np.zeros_like(pairs)
        for unit in np.unique(judged.unit[healthy]):
            ordered = np.sort(values[healthy & (judged.unit == unit)])
            smaller, not_larger = (
                np.searchsorted(ordered, values[faulty], side)
                for side in ("left", "right")
            )
            below = (smaller + not_larger) / 2
            won[unit] = np.bincount(
                judged.unit[faulty], weights=below, minlength=judged.n_units
            )
        n_won = np.einsum("bu,bv,uv->b", drawn, drawn, won, optimize=True)
        areas[:, seed] = np.divide(
            n_won, n_pairs, out=np.full(len(drawn), np.nan), where=n_pairs > 0
        )
    return np.take_along_axis(areas, seeds, axis=1).mean(axis=1)


def _by_severity(
    severity: FloatArray | None, member: NDArray[np.bool_], judged: Judged, share: Any
) -> list[dict[str, Any]]:
    """Share found and share given the right class in groups of severity.

    Empty where it does not vary.
    """
    if severity is None or np.unique(severity).size < 2:
        return []
    rows = []
    place = np.flatnonzero(member)
    right = (judged.predicted == judged.label).mean(axis=0)
    for group in groups_of(
        severity, most=int(np.clip(severity.size // RECORDS_A_GROUP, 2, MOST_GROUPS))
    ):
        inside = np.zeros_like(member)
        inside[place[group.member]] = True
        rows.append(
            {
                "severity_low": group.low,
                "severity_high": group.high,
                "n_records": int(inside.sum()),
                "n_units": int(np.unique(judged.unit[inside]).size),
                "share_found": share(inside),
                "share_right_class": float(right[inside].mean()),
            }
        )
    return rows


def _has_curve(size: FloatArray | None) -> bool:
    return (
        size is not None
        and size.size >= LEAST_RECORDS
        and np.unique(size).size >= LEAST_SIZES
    )


def _limit_rows(
    quantity: str, size: FloatArray, found: FloatArray, weight: FloatArray, n_units: int
) -> list[dict[str, Any]]:
    """Detection limits of one class in one quantity, one row for each of `SHARES`."""
    if not _has_curve(size):
        return []
    coefficients = fit_curves(size, found, weight)
    rows = []
    for share in SHARES:
        values = limits(coefficients, size, share)
        interval = with_interval(values[0], values[1:], n_units)
        status = "reached" if np.isfinite(values[0]) else "not_reached"
        if values[0] == size.min():
            status = "at_smallest_tested"
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
    severity: FloatArray | None, found: FloatArray, weight: FloatArray
) -> dict[str, list[float]]:
    """The fitted curve over severity, for figures; empty where there is none."""
    if severity is None or not _has_curve(severity):
        return {"severity": [], "share_found": []}
    at = np.linspace(severity.min(), severity.max(), CURVE_POINTS)
    share = curve_at(fit_curves(severity, found, weight), at, severity)[0]
    return {"severity": at.tolist(), "share_found": share.tolist()}


def _sentence(name: str, found: Mapping[str, Any], false_alarms: Interval) -> str:
    rows = [row for row in found["limits"] if row["quantity"] == "severity"]
    alarms = (
        f"at {false_alarms['mean']:.0%} false alarms"
        if false_alarms["mean"] is not None
        else ""
    )
    text = f"{name}: {interval_text(found['share_found'])} of {records_behind(found)} found {alarms}"
    if too_few_for_curve(found):
        text += f"; from what severity on is not told: {CURVE_NEEDS}"
    for row in rows:
        text += f"; {row['share']:.0%} are found {_limit_text(row)}"
        others = [
            other
            for other in found["limits"]
            if other["share"] == row["share"]
            and other["quantity"] != "severity"
            and other["status"] == "reached"
        ]
        if row["status"] == "reached" and others:
            text += (
                " ("
                + ", ".join(f"{other['quantity']} {_ends(other)}" for other in others)
                + ")"
            )
    return text + "."


def records_behind(found: Mapping[str, Any]) -> str:
    """What a class's figures rest on."""
    return f"{found['n_records']} records of {found['n_units']} machines"


def too_few_for_curve(found: Mapping[str, Any]) -> bool:
    """Whether the severity of a class varies, over too few records for a curve."""
    return bool(found["by_severity"]) and not found["curve"]["severity"]


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
    high = "beyond the largest tested" if row["high"] is None else f"{row['high']:.2f}"
    return f"{row['value']:.2f} [{row['low']:.2f}, {high}]"
