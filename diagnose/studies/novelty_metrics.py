"""How well a score tells what was never trained on from what was: AUROC, FPR95, alarms.

Intervals over units.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import SUBSETS, Task, subset_segments
from diagnose.scoring.metrics import (
    Score,
    confusion_by_unit,
    percentile_interval,
    score_with_interval,
)
from diagnose.studies.novelty import NoveltyRun
from gensig.errors import ConfigError

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
Mask = NDArray[np.bool_]
FALSE_ALARMS = 0.05  # share of known records that the threshold is meant to call novel
TRUE_POSITIVES = 0.95  # of FPR95
LEAST_VALIDATION = 19  # records: with fewer no threshold promises the share


def alarm_threshold(validation_score: FloatArray) -> float:
    """Score that a new known record exceeds with a probability of at most `FALSE_ALARMS`.

    Of n validation scores the one of rank (n + 1) (1 - share), rounded up, from below. Fewer than
    `LEAST_VALIDATION` cannot promise the share: then it is the largest. Records of one unit
    resemble each other, so that the promise is weaker than it reads; the share on test units says
    what came of it.

    Source: Shafer & Vovk (2008), "A tutorial on conformal prediction", Journal of Machine
    Learning Research 9.
    """
    n = validation_score.size
    rank = min(int(np.ceil((n + 1) * (1 - FALSE_ALARMS) - 1e-9)), n)
    return float(np.sort(validation_score)[rank - 1])


def false_positive_rate_95(
    novel: Mask, score: FloatArray, weight: FloatArray | None = None
) -> float:
    """Share of the novel records taken for known by the threshold that takes `TRUE_POSITIVES` of
    the known for known.

    Known is the positive class, as in Liu, Wang, Owens & Li (2020), "Energy-based
    out-of-distribution detection", NeurIPS, section 4.1.
    """
    from sklearn.metrics import roc_curve

    false_positives, true_positives, _ = roc_curve(
        ~novel, -score, sample_weight=weight, drop_intermediate=False
    )
    return float(
        false_positives[int(np.argmax(true_positives >= TRUE_POSITIVES - 1e-9))]
    )


def check_open_protocol(task: Task, protocol: str) -> None:
    """Refuse a protocol whose test has nothing new, or nothing known, or where there are no two
    classes to tell apart.

    Raises
    ------
    ConfigError    with the classes that it has
    """
    labels = task.labels()
    trained, _, tested = (
        set(labels[subset_segments(task, protocol, subset).record].tolist())
        for subset in SUBSETS
    )
    known, shown = (
        ", ".join(task.class_names[index] for index in sorted(found))
        for found in (trained, tested)
    )
    if not tested - trained or not tested & trained:
        raise ConfigError(
            f"protocol {protocol}: it trains on {known} and tests on {shown}; it needs known and new ones"
        )
    if protocol == "open_set" and len(trained) < 2:
        raise ConfigError(
            f"protocol {protocol}: one known class only ({known}): nothing to tell apart"
        )


def novelty_protocol_result(
    task: Task,
    protocol: str,
    runs: Sequence[NoveltyRun],
    *,
    n_bootstrap: int,
    seed: int,
) -> dict[str, Any]:
    """Entry of an open protocol in ``metrics.json``; every method is judged on the same resamples.

    Parameters
    ----------
    task, n_bootstrap : of the study
    runs : of all protocols
    seed : of the resamples
    """
    labels, unit = task.labels(), np.asarray(task.dataset.column("unit_id"))
    parts = {
        subset: np.unique(subset_segments(task, protocol, subset).record)
        for subset in SUBSETS
    }
    known = np.unique(labels[parts["train"]])
    by_method: dict[str, list[NoveltyRun]] = {}
    for run in runs:
        if run.protocol == protocol:
            by_method.setdefault(run.method, []).append(run)
    result: dict[str, Any] = {
        "known_classes": [task.class_names[index] for index in known],
        "novel_classes": [
            task.class_names[index]
            for index in np.setdiff1d(labels[parts["test"]], known)
        ],
        "n_records": {subset: int(record.size) for subset, record in parts.items()},
        "n_units": {
            subset: int(np.unique(unit[record]).size)
            for subset, record in parts.items()
        },
        "false_alarms_wanted": FALSE_ALARMS,
        "methods": {
            name: novelty_result(
                task,
                of_method,
                known.tolist(),
                n_bootstrap,
                np.random.default_rng(seed),
            )
            for name, of_method in by_method.items()
        },
    }
    networks = next(
        (found for found in by_method.values() if found[0].predicted is not None), None
    )
    if networks is not None:
        result["known"] = _accuracy_on_known(
            task, networks, known, n_bootstrap, np.random.default_rng(seed)
        )
    return result


def _accuracy_on_known(
    task: Task,
    runs: Sequence[NoveltyRun],
    known: IntArray,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Balanced accuracy over the test records of known classes, every one of them given a known
    class.
    """
    record = runs[0].record
    mine = np.isin(task.labels()[record], known)
    label, unit = (
        task.labels()[record][mine],
        np.asarray(task.dataset.column("unit_id"))[record][mine],
    )
    predicted = [run.predicted[mine] for run in runs if run.predicted is not None]
    confusion = np.stack(
        [
            confusion_by_unit(label, given, unit, len(task.class_names))
            for given in predicted
        ]
    )
    score = score_with_interval(
        "balanced_accuracy", confusion, n_bootstrap=n_bootstrap, rng=rng
    )
    return {"balanced_accuracy": asdict(score), "chance": 1 / np.unique(label).size}


def write_novelty(path: Path, task: Task, runs: Sequence[NoveltyRun]) -> None:
    """Write one row a score.

    Protocol, method, seed, record, its class and unit, the score and the threshold.
    """
    labels = task.labels()
    columns = [
        np.asarray(task.dataset.column(name)) for name in ("record_id", "unit_id")
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            [
                "protocol",
                "method",
                "seed",
                "record_id",
                "unit_id",
                "label",
                "score",
                "threshold",
            ]
        )
        for run in runs:
            threshold = f"{alarm_threshold(run.validation_score):.9g}"
            for record, score in zip(run.record, run.score, strict=True):
                truth = [
                    *(column[record] for column in columns),
                    task.class_names[labels[record]],
                ]
                writer.writerow(
                    [
                        run.protocol,
                        run.method,
                        run.seed,
                        *truth,
                        f"{score:.9g}",
                        threshold,
                    ]
                )


def novelty_result(
    task: Task,
    runs: Sequence[NoveltyRun],
    known: Sequence[int],
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """One method on one protocol, each figure with its interval by bootstrap over units and seeds.

    Parameters
    ----------
    task : gives labels and units
    runs : one a seed, of the same records
    known : labels that were trained on
    n_bootstrap : resamples of the units
    rng : source of the resamples

    Returns
    -------
    plain dictionary: ``auroc`` of novel against known records, ``auroc_by_class`` of each novel class against all
    known ones, ``auroc_by_known_class`` of all novel ones against each known class, ``false_alarms`` (share of known
    records above the threshold), ``found`` (share of each novel class above it), ``threshold`` a seed, and of networks
    that tell classes apart ``fpr95``
    """
    record = runs[0].record
    label = task.labels()[record]
    unit = np.unique(
        np.asarray(task.dataset.column("unit_id"))[record], return_inverse=True
    )[1]
    n_units = int(unit.max()) + 1
    drawn = rng.multinomial(n_units, np.full(n_units, 1 / n_units), size=n_bootstrap)
    seeds = rng.integers(len(runs), size=(n_bootstrap, len(runs)))
    novel = ~np.isin(label, known)
    scores = np.stack([run.score for run in runs])
    threshold = np.array([alarm_threshold(run.validation_score) for run in runs])
    alarm = scores > threshold[:, None]
    trained = [(index, task.class_names[index]) for index in np.unique(label[~novel])]
    classes = [
        (task.class_names[index], label == index) for index in np.unique(label[novel])
    ]

    def area(chosen: Mask) -> dict[str, Any]:
        return asdict(
            _area(scores[:, chosen], novel[chosen], unit[chosen], drawn, seeds)
        )

    result = {
        "auroc": area(np.ones_like(novel)),
        "auroc_by_class": {name: area(chosen | ~novel) for name, chosen in classes},
        "auroc_by_known_class": {
            name: area((label == index) | novel) for index, name in trained
        },
        "false_alarms": asdict(_share(alarm, ~novel, unit, drawn, seeds)),
        "found": {
            name: asdict(_share(alarm, chosen, unit, drawn, seeds))
            for name, chosen in classes
        },
        "threshold": threshold.tolist(),
        "n_validation_records": int(runs[0].validation_score.size),
        "seeds": [run.seed for run in runs],
        "detail": [run.detail for run in runs],
    }
    if runs[0].predicted is not None:
        result["fpr95"] = asdict(_false_positives(scores, novel, unit, drawn, seeds))
    return result


def _area(
    scores: FloatArray, novel: Mask, unit: IntArray, drawn: IntArray, seeds: IntArray
) -> Score:
    """Area under the ROC curve of (seed, record) scores.

    Resamples from the won comparisons of each pair of units.
    """
    from sklearn.metrics import roc_auc_score

    won = np.stack(
        [_won_by_units(score, novel, unit, drawn.shape[1]) for score in scores]
    )
    pairs = drawn @ np.bincount(unit[novel], minlength=drawn.shape[1])
    pairs = pairs * (drawn @ np.bincount(unit[~novel], minlength=drawn.shape[1]))
    total = np.einsum("bu,suv,bv->bs", drawn, won, drawn, optimize=True)
    resampled = np.divide(
        total,
        pairs[:, None],
        out=np.full(total.shape, np.nan),
        where=pairs[:, None] > 0,
    )
    return _score(
        [float(roc_auc_score(novel, score)) for score in scores],
        resampled,
        seeds,
        drawn.shape[1],
    )


def _won_by_units(
    score: FloatArray, novel: Mask, unit: IntArray, n_units: int
) -> FloatArray:
    """(unit of novel, unit of known) pairs of records in which the novel one has the larger
    score, equal ones half.
    """
    won = np.zeros((n_units, n_units))
    for other in np.unique(unit[~novel]):
        known = np.sort(score[~novel & (unit == other)])
        below = np.searchsorted(known, score[novel], "left") + np.searchsorted(
            known, score[novel], "right"
        )
        won[:, other] = np.bincount(unit[novel], weights=below / 2, minlength=n_units)
    return won


def _share(
    alarm: Mask, chosen: Mask, unit: IntArray, drawn: IntArray, seeds: IntArray
) -> Score:
    """Share of the chosen records with an alarm (seed, record)."""
    n_units = drawn.shape[1]
    hits = np.stack(
        [
            np.bincount(unit[chosen], weights=row[chosen], minlength=n_units)
            for row in alarm
        ]
    )
    total = drawn @ np.bincount(unit[chosen], minlength=n_units)
    raised = drawn @ hits.T
    resampled = np.divide(
        raised,
        total[:, None],
        out=np.full(raised.shape, np.nan),
        where=total[:, None] > 0,
    )
    return _score(
        [float(row[chosen].mean()) for row in alarm], resampled, seeds, drawn.shape[1]
    )


def _false_positives(
    scores: FloatArray, novel: Mask, unit: IntArray, drawn: IntArray, seeds: IntArray
) -> Score:
    def resample(weight: FloatArray) -> list[float]:
        whole = weight[novel].any() and weight[~novel].any()
        return [
            false_positive_rate_95(novel, score, weight) if whole else np.nan
            for score in scores
        ]

    resampled = np.array([resample(times[unit].astype(float)) for times in drawn])
    return _score(
        [false_positive_rate_95(novel, score) for score in scores],
        resampled,
        seeds,
        drawn.shape[1],
    )


def _score(
    per_seed: list[float], resampled: FloatArray, seeds: IntArray, n_units: int
) -> Score:
    """Percentile interval of (resample, seed) values over drawn seeds."""
    means = np.take_along_axis(resampled, seeds, axis=1).mean(axis=1)
    low, high = percentile_interval(means, n_units)
    return Score(
        mean=float(np.mean(per_seed)), low=low, high=high, per_seed=tuple(per_seed)
    )
