"""Scores of novelty: AUROC, FPR95 and alarms, with intervals over machines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import (
    FloatArray,
    IntArray,
    Task,
)
from diagnose.scoring.alarm_threshold import FALSE_ALARMS, alarm_threshold
from diagnose.scoring.judged import extended
from diagnose.scoring.machines import Machines, machines_of
from diagnose.scoring.metrics import Score, percentile_interval, score_with_interval
from diagnose.studies.counts import (
    by_method,
    confusion_counts,
    n_different,
    part_records,
    part_sizes,
    run_notes,
    unit_ids,
)
from diagnose.studies.novelty import NoveltyRun
from diagnose.studies.result_files import Entry, write_rows
from gensig.errors import ConfigError

Mask = NDArray[np.bool_]
TRUE_POSITIVES = 0.95  # of FPR95


def false_positive_rate_95(
    novel: Mask, score: FloatArray, weight: FloatArray | None = None
) -> float:
    """Share of novel records called known, where `TRUE_POSITIVES` of the known are called known.

    Known is the positive class, as in Liu, Wang, Owens & Li (2020), "Energy-based
    out-of-distribution detection", NeurIPS, section 4.1.
    """
    from sklearn.metrics import roc_curve

    false_positives, true_positives, _ = roc_curve(
        ~novel, -score, sample_weight=weight, drop_intermediate=False
    )
    first = int(np.argmax(true_positives >= TRUE_POSITIVES - 1e-9))
    return float(false_positives[first])


def check_open_protocol(task: Task, protocol: str) -> None:
    """Refuse a protocol without new or known classes in its test, or with one known class only.

    Raises
    ------
    ConfigError    with the classes that it has
    """
    labels = task.labels()
    parts = part_records(task, protocol)
    trained, tested = (
        np.unique(labels[parts["train"]]),
        np.unique(labels[parts["test"]]),
    )
    known, shown = (
        ", ".join(task.class_names[index] for index in classes)
        for classes in (trained, tested)
    )
    is_known = np.isin(tested, trained)
    if is_known.all() or not is_known.any():
        raise ConfigError(
            f"protocol {protocol}: it trains on {known} and tests on {shown}; "
            "it needs known and new ones"
        )
    if protocol == "open_set" and trained.size < 2:
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
) -> Entry:
    """Entry of an open protocol in ``metrics.json``; every method is judged on the same resamples.

    Parameters
    ----------
    task, n_bootstrap : of the study
    runs : of all protocols
    seed : of the resamples
    """
    labels = task.labels()
    parts = part_records(task, protocol)
    known = np.unique(labels[parts["train"]])
    novel = np.setdiff1d(labels[parts["test"]], known)
    methods = by_method(runs, protocol)
    result: Entry = {
        "known_classes": [task.class_names[index] for index in known],
        "novel_classes": [task.class_names[index] for index in novel],
        **part_sizes(task, parts),
        "resampled": machines_of(task.dataset, parts["test"]).counts(),
        "false_alarms_wanted": FALSE_ALARMS,
        "methods": {},
    }
    for name, mine in methods.items():
        rng = np.random.default_rng(seed)
        result["methods"][name] = novelty_result(
            task, mine, known.tolist(), n_bootstrap, rng
        )
    for mine in methods.values():
        if mine[0].predicted is not None:
            rng = np.random.default_rng(seed)
            result["known"] = _accuracy_on_known(task, mine, known, n_bootstrap, rng)
            break
    return result


def _accuracy_on_known(
    task: Task,
    runs: Sequence[NoveltyRun],
    known: IntArray,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> Entry:
    """Balanced accuracy over the test records of known classes."""
    record = runs[0].record
    mine = np.isin(task.labels()[record], known)
    record = record[mine]
    pairs = [(record, run.predicted[mine]) for run in runs if run.predicted is not None]
    confusion = confusion_counts(task, pairs)
    score = score_with_interval(
        "balanced_accuracy",
        confusion,
        n_bootstrap=n_bootstrap,
        rng=rng,
        machines=machines_of(task.dataset, record),
    )
    chance = 1 / n_different(task.labels()[record])
    return {"balanced_accuracy": asdict(score), "chance": chance}


def write_novelty(path: Path, task: Task, runs: Sequence[NoveltyRun]) -> None:
    """Write one row a score."""
    write_rows(path, _rows(task, runs))


def _rows(task: Task, runs: Sequence[NoveltyRun]) -> Iterator[Entry]:
    labels, unit = task.labels(), unit_ids(task)
    ids = np.asarray(task.dataset.column("record_id"))
    for run in runs:
        (threshold,) = alarm_threshold(run.validation_score)
        for record, score in zip(run.record, run.score, strict=True):
            yield {
                "protocol": run.protocol,
                "method": run.method,
                "seed": run.seed,
                "record_id": ids[record],
                "unit_id": unit[record],
                "label": task.class_names[labels[record]],
                "score": f"{score:.9g}",
                "threshold": f"{threshold:.9g}",
            }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Resamples:
    """Machines and seeds drawn with replacement.

    Attributes
    ----------
    unit : (record,) index of the unit of each test record
    machines : the units
    drawn : (resample, unit) how often a resample holds each unit
    seeds : (resample, draw) seeds
    """

    unit: IntArray
    machines: Machines
    drawn: IntArray
    seeds: IntArray

    @property
    def n_units(self) -> int:
        return int(self.drawn.shape[1])

    def count(self, chosen: Mask, weights: FloatArray | Mask | None = None) -> Any:
        """(unit,) number, or sum of the weights, of chosen records."""
        return np.bincount(self.unit[chosen], weights=weights, minlength=self.n_units)

    def score(self, per_seed: Sequence[float], resampled: FloatArray) -> Entry:
        """Mean and percentile interval of (resample, seed) values over drawn seeds."""
        means = np.take_along_axis(resampled, self.seeds, axis=1).mean(axis=1)
        support = self.machines.support()
        low, high = percentile_interval(means, support)
        score = Score(
            mean=float(np.mean(per_seed)),
            low=low,
            high=high,
            per_seed=tuple(per_seed),
            too_few=support.too_few,
        )
        return asdict(score)


def novelty_result(
    task: Task,
    runs: Sequence[NoveltyRun],
    known: Sequence[int],
    n_bootstrap: int,
    rng: np.random.Generator,
) -> Entry:
    """Scores of one method on one protocol, with intervals by bootstrap over machines and seeds.

    Parameters
    ----------
    task : gives labels and machines
    runs : one a seed, of the same records
    known : labels that were trained on
    n_bootstrap : resamples of the machines
    rng : source of the resamples

    Returns
    -------
    plain dictionary:
        ``auroc`` of novel against known records;
        ``auroc_by_class`` of each novel class against all known ones;
        ``auroc_by_known_class`` of all novel ones against each known class;
        ``false_alarms``, share of known records above the threshold;
        ``found``, share of each novel class above it;
        ``threshold`` a seed; and of networks that tell classes apart ``fpr95``
    """
    record = runs[0].record
    label = task.labels()[record]
    unit = np.unique(unit_ids(task)[record], return_inverse=True)[1]
    machines = machines_of(task.dataset, record)
    drawn = machines.drawn(n_bootstrap, rng)
    seeds = rng.integers(len(runs), size=(n_bootstrap, len(runs)))
    resamples = _Resamples(unit=unit, machines=machines, drawn=drawn, seeds=seeds)
    novel = ~np.isin(label, known)
    scores = np.stack([run.score for run in runs])
    threshold = np.concatenate([alarm_threshold(run.validation_score) for run in runs])
    alarm = scores > threshold[:, None]
    of_class = {task.class_names[index]: label == index for index in np.unique(label)}
    new = {name: mine for name, mine in of_class.items() if novel[mine].any()}
    trained = {name: mine for name, mine in of_class.items() if name not in new}

    def area(chosen: Mask) -> Entry:
        return _area(scores, novel & chosen, ~novel & chosen, resamples)

    result = {
        "auroc": area(np.ones_like(novel)),
        "auroc_by_class": {name: area(mine | ~novel) for name, mine in new.items()},
        "auroc_by_known_class": {
            name: area(mine | novel) for name, mine in trained.items()
        },
        "false_alarms": _share(alarm, ~novel, resamples),
        "found": {name: _share(alarm, mine, resamples) for name, mine in new.items()},
        "threshold": threshold.tolist(),
        "n_validation_records": int(runs[0].validation_score.size),
        **run_notes(runs),
    }
    if runs[0].predicted is not None:
        result["fpr95"] = _false_positives(scores, novel, resamples)
    return result


def _area(scores: FloatArray, novel: Mask, known: Mask, resamples: _Resamples) -> Entry:
    """Area under the ROC curve of (seed, record) scores, of novel against known records.

    A resample weighs the comparisons of each pair of units.
    """
    from sklearn.metrics import roc_auc_score

    drawn, chosen = resamples.drawn, novel | known
    won = np.stack([_won_by_units(score, novel, known, resamples) for score in scores])
    pairs = (drawn @ resamples.count(novel)) * (drawn @ resamples.count(known))
    total = np.einsum("bu,suv,bv->bs", drawn, won, drawn, optimize=True)
    per_seed = [float(roc_auc_score(novel[chosen], score[chosen])) for score in scores]
    return resamples.score(per_seed, _ratio(total, pairs))


def _ratio(total: FloatArray, count: NDArray[Any]) -> FloatArray:
    """(resample, seed) share of a total in a count (resample,); NaN where the count is 0."""
    nothing = np.full(total.shape, np.nan)
    return np.divide(total, count[:, None], out=nothing, where=count[:, None] > 0)


def _won_by_units(
    score: FloatArray, novel: Mask, known: Mask, resamples: _Resamples
) -> FloatArray:
    """(unit of novel, unit of known) record pairs in which the novel score is larger.

    Equal scores count half.
    """
    won = np.zeros((resamples.n_units, resamples.n_units))
    for other in np.unique(resamples.unit[known]):
        sound = np.sort(score[known & (resamples.unit == other)])
        below = np.searchsorted(sound, score[novel], "left")
        below = below + np.searchsorted(sound, score[novel], "right")
        won[:, other] = resamples.count(novel, below / 2)
    return won


def _share(alarm: Mask, chosen: Mask, resamples: _Resamples) -> Entry:
    """Share of the chosen records with an alarm (seed, record)."""
    hits = np.stack([resamples.count(chosen, row[chosen]) for row in alarm])
    total = resamples.drawn @ resamples.count(chosen)
    per_seed = [float(row[chosen].mean()) for row in alarm]
    score = resamples.score(per_seed, _ratio(resamples.drawn @ hits.T, total))
    support = resamples.machines.support(np.unique(resamples.unit[chosen]))
    low, high = extended(score["low"], score["high"], score["mean"], support)
    return score | {"low": low, "high": high}


def _false_positives(scores: FloatArray, novel: Mask, resamples: _Resamples) -> Entry:
    resampled = np.full((len(resamples.drawn), len(scores)), np.nan)
    for row, times in zip(resampled, resamples.drawn, strict=True):
        weight = times[resamples.unit].astype(float)
        if weight[novel].any() and weight[~novel].any():
            row[:] = [false_positive_rate_95(novel, score, weight) for score in scores]
    per_seed = [false_positive_rate_95(novel, score) for score in scores]
    return resamples.score(per_seed, resampled)
