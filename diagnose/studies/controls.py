"""Which controls a study runs beside its methods, and what they add to the result of a protocol."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from diagnose.baselines.base import Role
from diagnose.baselines.oracle import has_twin
from diagnose.baselines.registry import baseline_names
from diagnose.data.windows import CROSS_SENSOR, Task
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit
from diagnose.scoring.predictions import Prediction
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.jobs import LEVEL_KEPT, ORACLE, ORACLE_NETWORK, PROBE, SHAM, Job
from diagnose.training import sham

Pairs = Sequence[tuple[Any, Any]]


def control_jobs(
    task: Task, settings: TrainSettings, clean: Sequence[str]
) -> list[Job]:
    """Jobs of the controls on protocols that are not leaky; the label shuffle is not among them.

    Raises
    ------
    ConfigError    for a sham data set that does not fit
    """
    clean, first = tuple(clean), min(settings.seeds)
    shams: tuple[str, ...] = ()
    if settings.sham is not None:
        shams = sham.sham_protocols(sham.sham_task(task, settings.sham), clean)
    if not clean:
        return []
    with_oracle = settings.oracle == "auto" and has_twin(task.dataset)
    jobs = (
        [Job(protocols=clean, seed=None, control=PROBE)]
        if settings.metadata_probe
        else []
    )
    # a twin of the same channels says nothing of channels never seen
    known = tuple(name for name in clean if name != CROSS_SENSOR) if with_oracle else ()
    if known:
        jobs.append(Job(protocols=known, seed=None, control=ORACLE))
    if shams and settings.baselines:
        jobs.append(Job(protocols=shams, seed=None, control=SHAM))
    few = range(first, first + settings.n_seeds_control)
    for protocol in clean:
        if settings.normalise == BOTH:
            jobs += [
                Job(protocols=(protocol,), seed=seed, control=LEVEL_KEPT)
                for seed in settings.seeds
            ]
        if protocol in known:
            jobs += [
                Job(protocols=(protocol,), seed=seed, control=ORACLE) for seed in few
            ]
        if protocol in shams:
            jobs += [
                Job(protocols=(protocol,), seed=seed, control=SHAM) for seed in few
            ]
    return jobs


def without_sham(predictions: Sequence[Prediction]) -> list[Prediction]:
    """Those on the data set itself."""
    return [prediction for prediction in predictions if not is_sham(prediction.method)]


def is_sham(method: str) -> bool:
    """Whether a method was trained on the sham data set."""
    return method == sham.NETWORK or method.startswith(f"{sham.NETWORK}_")


def sham_methods(
    task: Task,
    settings: TrainSettings,
    predictions: Sequence[Prediction],
    score: Callable[[Task, Pairs], dict[str, Any]],
) -> dict[str, dict[str, Any]]:
    """Protocol -> method -> scores of the trainings on the sham data set, as ``score`` makes them
    of a task.
    """
    found: dict[str, dict[str, Any]] = {}
    if settings.sham is None:
        return found
    other = sham.sham_task(task, settings.sham)
    runs: dict[tuple[str, str], list[Prediction]] = {}
    for prediction in predictions:
        if is_sham(prediction.method):
            runs.setdefault((prediction.protocol, prediction.method), []).append(
                prediction
            )
    for (protocol, method), mine in runs.items():
        scores = score(other, [(run.record, run.predicted) for run in mine])
        told = {
            "seeds": [run.seed for run in mine],
            "detail": [run.detail for run in mine],
        }
        found.setdefault(protocol, {})[method] = {**scores, **told}
    return found


def chosen_oracle(task: Task, runs: Sequence[Prediction]) -> str | None:
    """Name of the oracle with the best mean score on the validation units; None where none ran."""
    oracles = (ORACLE_NETWORK, *baseline_names(Role.BOUND))
    labels, n_classes = task.labels(), len(task.class_names)
    scores: dict[str, list[float]] = {}
    for run in runs:
        if run.method not in oracles or run.validation is None:
            continue
        label = labels[run.validation.record]
        predicted = run.validation.log_probability.argmax(axis=1)
        confusion = confusion_by_unit(
            label, predicted, np.zeros_like(label), n_classes
        )[0]
        scores.setdefault(run.method, []).append(float(balanced_accuracy(confusion)))
    return max(scores, key=lambda name: float(np.mean(scores[name])), default=None)
