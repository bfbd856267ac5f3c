"""What a study answers beside its scores.

Which condition fails, from what severity, with how much signal, who wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Role
from diagnose.baselines.registry import baseline_names
from diagnose.data.windows import Task
from diagnose.scoring.conditions import by_condition, condition_columns
from diagnose.scoring.detection_limit import HEALTHY, detection, size_columns
from diagnose.scoring.judged import Judged
from diagnose.scoring.metrics import balanced_accuracy
from diagnose.scoring.paired import compare
from diagnose.scoring.predictions import Prediction
from diagnose.scoring.window_length import by_window_length
from diagnose.settings import TrainSettings

ANSWERS_SEED = 20240608


def protocol_answers(
    task: Task, settings: TrainSettings, predictions: Sequence[Prediction]
) -> dict[str, Any]:
    """The part ``answers`` of one clean protocol in ``metrics.json``; docs/howto/report.md
    explains every key.

    Parameters
    ----------
    task, settings : of the study
    predictions : of one protocol; those of the network and of the baselines are used

    Notes
    -----
    A part for which the data have nothing is left out: no ``detection`` without a healthy class, no ``window_length``
    where no windows were kept.
    """
    network_name = str(settings.model.get("name", "network"))
    compared = (network_name, *baseline_names(Role.RIVAL))
    names = dict.fromkeys(p.method for p in predictions if p.method in compared)
    runs = {name: [p for p in predictions if p.method == name] for name in names}
    record = reduce(np.intersect1d, [run[0].record for run in runs.values()])
    judged = {name: _judged(task, name, run, record) for name, run in runs.items()}
    network = judged.pop(network_name)
    best = max(judged.values(), key=_accuracy, default=None)
    shown = [network] if best is None else [network, best]
    result: dict[str, Any] = {
        "network": network_name,
        "best_baseline": None if best is None else best.method,
        "n_records": int(record.size),
        "n_units": network.n_units,
        "conditions": by_condition(
            condition_columns(task.dataset, record),
            shown,
            n_bootstrap=settings.n_bootstrap,
            rng=_rng(),
        ),
        "comparisons": compare(
            network, list(judged.values()), n_bootstrap=settings.n_bootstrap, rng=_rng()
        ),
    }
    if (
        HEALTHY in task.class_names
        and (network.label == task.class_names.index(HEALTHY)).any()
    ):
        sizes = _sizes(task, record)
        result["detection"] = {
            method.method: detection(
                method,
                _validation(task, method.method, runs[method.method]),
                class_names=task.class_names,
                sizes=sizes,
                n_bootstrap=settings.n_bootstrap,
                rng=_rng(),
            )
            for method in shown
        }
    windows = [
        (p.windows.record, p.windows.log_probability)
        for p in runs[network_name]
        if p.windows is not None
    ]
    if windows:
        rate = task.dataset.sampling_rate
        result["window_length"] = by_window_length(
            _judged(
                task, network_name, runs[network_name], runs[network_name][0].record
            ),
            windows,
            window_seconds=task.window_samples / rate,
            step_seconds=task.stride_samples / rate,
            n_bootstrap=settings.n_bootstrap,
            rng=_rng(),
        )
    return result


def _rng() -> np.random.Generator:
    """The same for every question, so that no answer depends on which others were asked."""
    return np.random.default_rng(ANSWERS_SEED)


def _judged(
    task: Task, method: str, runs: Sequence[Prediction], record: NDArray[np.integer]
) -> Judged:
    scores = np.stack(
        [run.log_probability[np.searchsorted(run.record, record)] for run in runs]
    )
    return _of_records(task, method, record, scores)


def _validation(task: Task, method: str, runs: Sequence[Prediction]) -> Judged | None:
    parts = [run.validation for run in runs if run.validation is not None]
    if len(parts) < len(runs):
        return None
    return _of_records(
        task,
        method,
        parts[0].record,
        np.stack([part.log_probability for part in parts]),
    )


def _of_records(
    task: Task, method: str, record: NDArray[np.integer], scores: NDArray[np.floating]
) -> Judged:
    names, unit = np.unique(
        np.asarray(task.dataset.column("unit_id"))[record], return_inverse=True
    )
    return Judged(
        method=method,
        label=task.labels()[record],
        unit=unit,
        n_units=int(names.size),
        log_probability=scores,
    )


def _accuracy(judged: Judged) -> float:
    return float(balanced_accuracy(judged.confusion().sum(axis=1)).mean())


def _sizes(
    task: Task, record: NDArray[np.integer]
) -> dict[str, dict[str, NDArray[np.floating]]]:
    """Severity of the records of each faulty class, where it is above 0, and what grows with it
    in physical units.
    """
    label = task.labels()[record]
    severity = np.asarray(task.dataset.column("severity"), dtype=float)[record]
    sizes = {}
    for index, name in enumerate(task.class_names):
        mine = severity[label == index]
        if (
            name != HEALTHY
            and mine.size
            and np.isfinite(mine).all()
            and (mine > 0).all()
        ):
            sizes[name] = {"severity": mine} | size_columns(
                task.dataset, record[label == index], mine
            )
    return sizes
