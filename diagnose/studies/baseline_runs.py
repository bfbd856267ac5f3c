"""Predictions of baselines on one protocol, each kind of input made once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnose.baselines.base import Baseline, Input, Parts, Source, StorableBaseline
from diagnose.baselines.estimators import record_scores
from diagnose.baselines.registry import BASELINES
from diagnose.data.windows import Task
from diagnose.scoring.predictions import REFERENCES, VALIDATION, Prediction, Rows
from diagnose.studies.canaries import canary_labels, counted, parts_with_canaries
from diagnose.training.classes import shuffled_labels

LABEL_SHUFFLE = "label_shuffle"  # in metrics.json
MOST_DRAWS, WELL_ABOVE = 3, 0.05


def shuffle_method(method: str) -> str:
    """Name of the result of a method, not the network, on shuffled labels."""
    return f"{LABEL_SHUFFLE}_{method}"


def baseline_predictions(
    source: Source, names: Sequence[str], *, shuffled: bool = False
) -> list[Prediction]:
    """Predictions of each baseline on the test and the validation records of a protocol.

    Baselines whose input the task lacks are left out. All are handed random labels of the test
    records, see `diagnose.studies.canaries`.

    Parameters
    ----------
    source : data of the protocol
    names : keys of `diagnose.baselines.registry.BASELINES`
    shuffled : True adds each baseline on shuffled training labels, on the same inputs, where the
        protocol is not leaky
    """
    labels = canary_labels(source.task, source.protocol)
    made: dict[Input, Parts] = {}
    predictions = []
    for name in names:
        baseline = BASELINES[name]()
        if baseline.reads.why_not(source.task, source.protocol):
            continue
        if baseline.reads not in made:
            parts = baseline.reads.make(source)
            made[baseline.reads] = parts_with_canaries(parts, labels)
        prediction = _prediction(baseline, made[baseline.reads], source)
        predictions.append(counted(prediction, labels))
        if shuffled and labels is not None:
            predictions += _on_shuffled_labels(name, made[baseline.reads], source)
    return predictions


def _on_shuffled_labels(name: str, parts: Parts, source: Source) -> list[Prediction]:
    """Predictions of a baseline that is trained on shuffled labels.

    A draw of them that comes out well above chance is followed by another, up to `MOST_DRAWS`.
    """
    n_classes, truth = len(source.task.class_names), source.task.labels()
    runs: list[Prediction] = []
    for draw in range(MOST_DRAWS):
        rng = np.random.default_rng([draw, 2])
        train, validation = (
            replace(
                table,
                label=shuffled_labels(table.label, table.record, n_classes, rng),
            )
            for table in (parts.train, parts.validation)
        )
        of_draw = replace(parts, train=train, validation=validation)
        run = _prediction(BASELINES[name](), of_draw, source)
        runs.append(replace(run, method=shuffle_method(name), seed=draw, weights=None))
        label = truth[run.record]
        found = [np.mean(run.predicted[label == one] == one) for one in set(label)]
        if np.mean(found) < 1 / len(found) + WELL_ABOVE:
            break
    return runs


def reasons_left_out(
    task: Task, protocols: Sequence[str], names: Sequence[str]
) -> dict[str, str]:
    """Baseline -> protocols that it is left out of, and why; only those that lack their input."""
    reasons = {}
    for name in names:
        why_not = BASELINES[name].reads.why_not
        texts = [
            f"{protocol}, where {reason}"
            for protocol in protocols
            if (reason := why_not(task, protocol))
        ]
        if texts:
            reasons[name] = "; ".join(texts)
    return reasons


def _prediction(baseline: Baseline, parts: Parts, source: Source) -> Prediction:
    """Prediction of a baseline that is fitted here."""
    detail = baseline.fit(parts.train, parts.validation, len(source.task.class_names))
    judged = parts.judged()
    record, scores = record_scores(baseline.predict_proba(judged), judged.record)
    tested = np.isin(record, parts.test.record)

    beside = {}
    for name, table in ((VALIDATION, parts.validation), (REFERENCES, parts.references)):
        if table is None:
            continue
        mine = np.isin(record, table.record) & ~tested
        if mine.any():
            beside[name] = Rows(record=record[mine], answers=scores[mine])
    weights = None
    if isinstance(baseline, StorableBaseline):
        weights = baseline.tensors()
    return Prediction(
        protocol=source.protocol,
        method=baseline.text.name,
        seed=0,
        record=record[tested],
        answers=scores[tested],
        detail=detail,
        parts=beside,
        weights=weights,
    )
