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
from diagnose.data.windows import FloatArray, IntArray, Task
from diagnose.scoring.conditions import by_condition, condition_columns
from diagnose.scoring.detection_limit import HEALTHY, detection, size_columns
from diagnose.scoring.intervals import with_interval
from diagnose.scoring.judged import (
    ANSWERS_SEED,
    Judged,
    drawn_scores,
    judged_answers,
    judged_runs,
)
from diagnose.scoring.metrics import ACCURACY
from diagnose.scoring.paired import compare
from diagnose.scoring.predictions import WINDOWS, Prediction
from diagnose.scoring.window_length import by_window_length
from diagnose.settings import TrainSettings
from diagnose.studies.controls import best_on_validation
from diagnose.studies.result_files import Entry, network_name


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
    rivals = {method: judged_runs(task, mine, record) for method, mine in runs.items()}
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
                _held_back(task, runs[method.method]),
                rng=_generator(),
            )
            for method in shown
        }
    if any(WINDOWS in run.parts for run in runs[name]):
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
    judged = [judged_runs(task, runs) for runs in (leaky, clean)]
    rng, n_bootstrap = _generator(), settings.n_bootstrap
    leaky_scores, clean_scores = (
        drawn_scores(one, ACCURACY, one.machines.drawn(n_bootstrap, rng), rng)
        for one in judged
    )
    support = min((one.support for one in judged), key=lambda part: part.n_groups)
    return {
        "against": clean[0].protocol,
        "difference": with_interval(leaky_scores - clean_scores, support),
    }


def _generator() -> np.random.Generator:
    """Generator of one question, so that no answer depends on the other questions."""
    return np.random.default_rng(ANSWERS_SEED)


def _has_healthy(task: Task, network: Judged) -> bool:
    """True if there are healthy test records."""
    if HEALTHY not in task.class_names:
        return False
    return bool((network.truth == task.class_names.index(HEALTHY)).any())


def _window_length(
    task: Task, settings: TrainSettings, runs: Sequence[Prediction]
) -> Entry:
    """Scores of the network by length of the signal judged."""
    rate = task.dataset.sampling_rate
    return by_window_length(
        judged_runs(task, runs),
        [run.parts[WINDOWS] for run in runs if WINDOWS in run.parts],
        window_seconds=task.window_samples / rate,
        step_seconds=task.stride_samples / rate,
        n_bootstrap=settings.n_bootstrap,
        rng=_generator(),
    )


def _held_back(task: Task, runs: Sequence[Prediction]) -> Judged | None:
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
    record = rows[0].record[chosen]
    answers = np.stack([one.answers[chosen] for one in rows])
    truth = np.full_like(record, healthy)
    return judged_answers(task, runs[0].method, record, answers, truth)


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
