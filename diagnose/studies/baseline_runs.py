"""Predictions of baselines on one protocol, each kind of input made once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnose.baselines.base import Baseline, Input, Parts, Source, StorableBaseline
from diagnose.baselines.estimators import record_scores
from diagnose.baselines.registry import BASELINES
from diagnose.data.windows import Task
from diagnose.scoring.predictions import Prediction, Rows


def baseline_predictions(source: Source, names: Sequence[str]) -> list[Prediction]:
    """Predictions of each baseline on the test and the validation records of a protocol.

    Baselines whose input the task lacks are left out.

    Parameters
    ----------
    source : data of the protocol
    names : keys of `diagnose.baselines.registry.BASELINES`
    """
    made: dict[Input, Parts] = {}
    predictions = []
    for name in names:
        baseline = BASELINES[name]()
        if baseline.reads.why_not(source.task, source.protocol):
            continue
        if baseline.reads not in made:
            made[baseline.reads] = baseline.reads.make(source)
        predictions.append(_prediction(baseline, made[baseline.reads], source))
    return predictions


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
    held_out = Rows(record=record[~tested], log_probability=scores[~tested])
    weights = None
    if isinstance(baseline, StorableBaseline):
        weights = baseline.tensors()
    return Prediction(
        protocol=source.protocol,
        method=baseline.text.name,
        seed=0,
        record=record[tested],
        log_probability=scores[tested],
        detail=detail,
        validation=held_out if held_out.record.size else None,
        weights=weights,
    )
