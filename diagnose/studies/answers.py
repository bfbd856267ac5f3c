"""Answers of a study beside its scores.

Conditions in which it fails, severities that are found, length of signal, comparisons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial, reduce

import numpy as np

from diagnose.baselines.base import Role
from diagnose.baselines.registry import baseline_names
from diagnose.data.windows import (
    FloatArray,
    IntArray,
    Task,
)
from diagnose.scoring.conditions import by_condition, condition_columns
from diagnose.scoring.detection_limit import HEALTHY, detection, size_columns
from diagnose.scoring.judged import Judged, resampled_score, score, with_interval
from diagnose.scoring.machines import machines_of
from diagnose.scoring.paired import ACCURACY, compare
from diagnose.scoring.predictions import Prediction
from diagnose.scoring.window_length import by_window_length
from diagnose.settings import TrainSettings
from diagnose.studies.controls import best_on_validation
from diagnose.studies.counts import unit_ids
from diagnose.studies.result_files import Entry, network_name

ANSWERS_SEED = 20240608


def protocol_answers(
    task: Task, settings: TrainSettings, predictions: Sequence[Prediction]
) -> Entry:
    """Part ``answers`` of one clean protocol in ``metrics.json``; see docs/howto/report.md.

    Parameters
    ----------
    task, settings : of the study
    predictions : of one protocol; those of the network and of the baselines are used

    Notes
    -----
    A part for which the data have nothing is left out: no ``detection`` without a healthy class,
    no ``window_length`` where no windows were kept.
    """
    name = network_name(settings)
    compared = (name, *baseline_names(Role.RIVAL))
    runs: dict[str, list[Prediction]] = {}
    for run in predictions:
        if run.method in compared:
            runs.setdefault(run.method, []).append(run)
    record = reduce(np.intersect1d, [mine[0].record for mine in runs.values()])
    rivals = {
        method: _judged(task, method, mine, record) for method, mine in runs.items()
    }
    network = rivals.pop(name)
    best = rivals.get(best_on_validation(task, predictions, rivals) or "")
    shown = [method for method in (network, best) if method is not None]
    n_bootstrap = settings.n_bootstrap
    columns = condition_columns(task.dataset, record)
    result: Entry = {
        "network": name,
        "best_baseline": getattr(best, "method", None),
        "n_records": int(record.size),
        "n_units": network.n_units,
        "conditions": by_condition(
            columns, shown, n_bootstrap=n_bootstrap, rng=_generator()
        ),
        "comparisons": compare(
            network, list(rivals.values()), n_bootstrap=n_bootstrap, rng=_generator()
        ),
    }
    if _has_healthy(task, network):
        detect = partial(
            detection,
            class_names=task.class_names,
            sizes=_sizes(task, record),
            n_bootstrap=n_bootstrap,
        )
        result["detection"] = {
            method.method: detect(
                method,
                _held_back(task, method.method, runs[method.method]),
                rng=_generator(),
            )
            for method in shown
        }
    if any(run.windows is not None for run in runs[name]):
        result["window_length"] = _window_length(task, settings, runs[name])
    return result


def leak_answer(
    task: Task,
    settings: TrainSettings,
    leaky: Sequence[Prediction],
    clean: Sequence[Prediction],
) -> Entry:
    """Balanced accuracy of the network on a leaky protocol less that on a clean one.

    The interval resamples the machines of both test parts and the seeds, each part for itself.
    Where they share machines it is wider than it need be.

    Parameters
    ----------
    leaky, clean : of the network, one a seed
    """
    judged = [
        _judged(task, runs[0].method, runs, runs[0].record) for runs in (leaky, clean)
    ]
    rng = _generator()
    resampled = [
        resampled_score(
            one, ACCURACY, one.machines.drawn(settings.n_bootstrap, rng), rng
        )
        for one in judged
    ]
    difference = score(judged[0], ACCURACY) - score(judged[1], ACCURACY)
    support = min((one.support for one in judged), key=lambda part: part.n_groups)
    return {
        "against": clean[0].protocol,
        "difference": with_interval(difference, resampled[0] - resampled[1], support),
    }


def _generator() -> np.random.Generator:
    """Generator of one question, so that no answer depends on the other questions."""
    return np.random.default_rng(ANSWERS_SEED)


def _has_healthy(task: Task, network: Judged) -> bool:
    """True if there are healthy test records."""
    if HEALTHY not in task.class_names:
        return False
    return bool((network.label == task.class_names.index(HEALTHY)).any())


def _window_length(
    task: Task, settings: TrainSettings, runs: Sequence[Prediction]
) -> Entry:
    """Scores of the network by length of the signal judged."""
    rate = task.dataset.sampling_rate
    windows = [run.windows for run in runs if run.windows is not None]
    return by_window_length(
        _judged(task, runs[0].method, runs, runs[0].record),
        [(part.record, part.log_probability) for part in windows],
        window_seconds=task.window_samples / rate,
        step_seconds=task.stride_samples / rate,
        n_bootstrap=settings.n_bootstrap,
        rng=_generator(),
    )


def _judged(
    task: Task, method: str, runs: Sequence[Prediction], record: IntArray
) -> Judged:
    """A method on some of its test records."""
    scores = [run.log_probability[np.searchsorted(run.record, record)] for run in runs]
    return _of_records(task, method, record, np.stack(scores))


def _held_back(task: Task, method: str, runs: Sequence[Prediction]) -> Judged | None:
    """A method on healthy and reference records of validation machines; None without any."""
    rows = [run.held_back for run in runs if run.held_back is not None]
    if len(rows) < len(runs):
        return None
    healthy = task.class_names.index(HEALTHY)
    is_healthy = task.labels() == healthy
    is_healthy |= replace(task, of_references=True).labels() == healthy
    chosen = is_healthy[rows[0].record]
    if not chosen.any():
        return None
    scores = np.stack([one.log_probability[chosen] for one in rows])
    return _of_records(task, method, rows[0].record[chosen], scores, label=healthy)


def _of_records(
    task: Task,
    method: str,
    record: IntArray,
    scores: FloatArray,
    label: int | None = None,
) -> Judged:
    """A method on some records, all of one label where it is given."""
    unit = np.unique(unit_ids(task)[record], return_inverse=True)[1]
    labels = task.labels()[record]
    if label is not None:
        labels = np.full_like(record, label)
    return Judged(
        method=method,
        label=labels,
        unit=unit,
        machines=machines_of(task.dataset, record),
        log_probability=scores,
    )


def _sizes(task: Task, record: IntArray) -> dict[str, dict[str, FloatArray]]:
    """Severity, and what grows with it in physical units, of the records of each faulty class.

    Classes of unknown or zero severity are left out.
    """
    label = task.labels()[record]
    severity = np.asarray(task.dataset.column("severity"), dtype=float)[record]
    sizes = {}
    for index, name in enumerate(task.class_names):
        mine = severity[label == index]
        graded = mine.size and np.isfinite(mine).all() and (mine > 0).all()
        if name != HEALTHY and graded:
            physical = size_columns(task.dataset, record[label == index], mine)
            sizes[name] = {"severity": mine} | physical
    return sizes
