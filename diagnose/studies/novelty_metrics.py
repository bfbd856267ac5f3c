"""Scores of novelty: AUROC, FPR95 and alarms, with intervals over machines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diagnose.data.windows import FloatArray, IntArray, Task
from diagnose.scoring.alarms import FALSE_ALARMS, Mask, alarm_threshold, areas
from diagnose.scoring.intervals import extended, of_seeds
from diagnose.scoring.judged import BOOTSTRAP_SEED, Judged, judged_runs
from diagnose.scoring.machines import CountArray, machines_of
from diagnose.scoring.metrics import ACCURACY, ratio, score_with_interval
from diagnose.scoring.predictions import (
    KNOWN_CLASSES,
    VALIDATION,
    Prediction,
    by_method,
    run_notes,
)
from diagnose.studies.counts import n_different, part_records, part_sizes, unit_ids
from diagnose.studies.result_files import Entry, write_rows
from gensig.errors import ConfigError

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
    runs: Sequence[Prediction],
    *,
    n_bootstrap: int,
) -> Entry:
    """Entry of an open protocol in ``metrics.json``; every method is judged on the same resamples.

    Parameters
    ----------
    task, n_bootstrap : of the study
    runs : of all protocols
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
        rng = np.random.default_rng(BOOTSTRAP_SEED)
        result["methods"][name] = novelty_result(
            task, mine, known.tolist(), n_bootstrap, rng
        )
        if KNOWN_CLASSES in mine[0].further and "known" not in result:
            result["known"] = _accuracy_on_known(task, mine, known, n_bootstrap)
    return result


def _accuracy_on_known(
    task: Task, runs: Sequence[Prediction], known: IntArray, n_bootstrap: int
) -> Entry:
    """Balanced accuracy over the test records of known classes."""
    record = runs[0].record
    record = record[np.isin(task.labels()[record], known)]
    judged = judged_runs(task, runs, record, further=KNOWN_CLASSES)
    score = score_with_interval(
        ACCURACY,
        judged.confusion(),
        n_bootstrap=n_bootstrap,
        rng=np.random.default_rng(BOOTSTRAP_SEED),
        machines=judged.machines,
    )
    return {ACCURACY: score, "chance": 1 / n_different(judged.truth)}


def write_novelty(path: Path, task: Task, runs: Sequence[Prediction]) -> None:
    """Write one row a score."""
    write_rows(path, _rows(task, runs))


def _rows(task: Task, runs: Sequence[Prediction]) -> Iterator[Entry]:
    labels, unit = task.labels(), unit_ids(task)
    ids = np.asarray(task.dataset.column("record_id"))
    for run in runs:
        limit = f"{threshold(run):.9g}"
        for record, score in zip(run.record, run.answers[:, 0], strict=True):
            yield {
                "protocol": run.protocol,
                "method": run.method,
                "seed": run.seed,
                "record_id": ids[record],
                "unit_id": unit[record],
                "label": task.class_names[labels[record]],
                "score": f"{score:.9g}",
                "threshold": limit,
            }


def threshold(run: Prediction) -> float:
    """Score above which a record raises an alarm."""
    (score,) = alarm_threshold(run.parts[VALIDATION].answers[:, 0])
    return float(score)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Resamples:
    """Scores of novelty on machines and seeds drawn with replacement.

    Attributes
    ----------
    judged : one method on the test records
    drawn : (resample, unit) how often a resample holds each unit
    seeds : (resample, draw) seeds
    """

    judged: Judged
    drawn: CountArray
    seeds: IntArray

    @property
    def scores(self) -> FloatArray:
        """(seed, record) scores of novelty."""
        return self.judged.answers[..., 0]

    def score(self, per_seed: Sequence[float], resampled: FloatArray) -> Entry:
        """Mean and percentile interval of (resample, seed) values over drawn seeds."""
        means = np.take_along_axis(resampled, self.seeds, axis=1).mean(axis=1)
        return of_seeds(np.array(per_seed), means, self.judged.machines.support())

    def area(self, novel: Mask, known: Mask) -> Entry:
        """Area under the ROC curve of novel against known records."""
        from sklearn.metrics import roc_auc_score

        chosen = novel | known
        per_seed = [
            float(roc_auc_score(novel[chosen], score[chosen])) for score in self.scores
        ]
        resampled = areas(self.scores, novel, known, self.judged.unit, self.drawn)
        return self.score(per_seed, resampled)

    def share(self, alarm: Mask, chosen: Mask) -> Entry:
        """Share of the chosen records with an alarm (seed, record)."""
        unit, n_units = self.judged.unit[chosen], self.judged.n_units
        hits = np.stack([np.bincount(unit, row[chosen], n_units) for row in alarm])
        total = self.drawn @ np.bincount(unit, minlength=n_units)
        per_seed = [float(row[chosen].mean()) for row in alarm]
        score = self.score(per_seed, ratio(self.drawn @ hits.T, total[:, None]))
        support = self.judged.of(chosen).support
        low, high = extended(score["low"], score["high"], score["mean"], support)
        return score | {"low": low, "high": high}

    def false_positives(self, novel: Mask) -> Entry:
        """Rate of `false_positive_rate_95`."""
        resampled = np.full((len(self.drawn), len(self.scores)), np.nan)
        for row, times in zip(resampled, self.drawn, strict=True):
            weight = times[self.judged.unit].astype(float)
            if weight[novel].any() and weight[~novel].any():
                row[:] = [
                    false_positive_rate_95(novel, score, weight)
                    for score in self.scores
                ]
        per_seed = [false_positive_rate_95(novel, score) for score in self.scores]
        return self.score(per_seed, resampled)


def novelty_result(
    task: Task,
    runs: Sequence[Prediction],
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
    judged = judged_runs(task, runs)
    label, machines = judged.truth, judged.machines
    drawn = machines.drawn(n_bootstrap, rng)
    seeds = rng.integers(len(runs), size=(n_bootstrap, len(runs)))
    resamples = _Resamples(judged=judged, drawn=drawn, seeds=seeds)
    novel = ~np.isin(label, known)
    thresholds = np.array([threshold(run) for run in runs])
    alarm = resamples.scores > thresholds[:, None]
    of_class = {task.class_names[index]: label == index for index in np.unique(label)}
    new = {name: mine for name, mine in of_class.items() if novel[mine].any()}
    trained = {name: mine for name, mine in of_class.items() if name not in new}
    result = {
        "auroc": resamples.area(novel, ~novel),
        "auroc_by_class": {
            name: resamples.area(mine, ~novel) for name, mine in new.items()
        },
        "auroc_by_known_class": {
            name: resamples.area(novel, mine) for name, mine in trained.items()
        },
        "false_alarms": resamples.share(alarm, ~novel),
        "found": {name: resamples.share(alarm, mine) for name, mine in new.items()},
        "threshold": thresholds.tolist(),
        "n_validation_records": int(runs[0].parts[VALIDATION].record.size),
        **run_notes(runs),
    }
    if KNOWN_CLASSES in runs[0].further:
        result["fpr95"] = resamples.false_positives(novel)
    return result
