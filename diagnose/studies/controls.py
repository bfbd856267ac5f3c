"""Controls that a study runs beside its methods, and their part in the result of a protocol."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from diagnose.baselines.base import Role
from diagnose.baselines.oracle import has_twin
from diagnose.baselines.registry import baseline_names
from diagnose.data.turns import NO_REFERENCE
from diagnose.data.windows import CROSS_SENSOR, Task
from diagnose.scoring.judged import class_scores, judged_answers, judged_runs, score
from diagnose.scoring.metrics import ACCURACY
from diagnose.scoring.predictions import VALIDATION, Prediction, by_method, run_notes
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.baseline_runs import LABEL_SHUFFLE
from diagnose.studies.class_jobs import (
    LEVEL_KEPT,
    ORACLE,
    ORACLE_NETWORK,
    PROBE,
    WITH_REFERENCE,
)
from diagnose.studies.jobs import Job
from diagnose.studies.result_files import Entry
from diagnose.training import sham


def control_jobs(
    task: Task, settings: TrainSettings, clean: Sequence[str]
) -> list[Job]:
    """Jobs of the controls on protocols that are not leaky; the label shuffle is not among them.

    Raises
    ------
    ConfigError    for a sham data set that does not fit, or lacks references that are wanted
    """
    protocols = tuple(clean)
    shams: tuple[str, ...] = ()
    if settings.sham is not None:
        other = sham.sham_task(task, settings.sham)
        shams = sham.sham_protocols(other, protocols)
        if settings.reference != NO_REFERENCE:
            sham.check_references(other, settings.reference)
    if not protocols:
        return []
    with_oracle: tuple[str, ...] = ()
    if settings.oracle == "auto" and has_twin(task.dataset):
        # a twin of the same channels says nothing of channels never seen
        with_oracle = tuple(name for name in protocols if name != CROSS_SENSOR)
    fitted = {PROBE: protocols, ORACLE: with_oracle}
    if not settings.metadata_probe:
        fitted[PROBE] = ()
    jobs = [
        Job(protocols=names, seed=None, control=control)
        for control, names in fitted.items()
        if names
    ]
    if shams and settings.baselines:
        jobs.append(Job(protocols=shams, seed=None, sham=True))
    first = min(settings.seeds)
    few = range(first, first + settings.n_seeds_control)
    variants = _variants(settings)
    for protocol in protocols:
        seeds: dict[str, Sequence[int]] = dict.fromkeys(variants, settings.seeds)
        if protocol in with_oracle:
            seeds[ORACLE] = few
        jobs += [
            Job(protocols=(protocol,), seed=seed, control=control)
            for control, of_control in seeds.items()
            for seed in of_control
        ]
        if protocol in shams:
            jobs += [
                Job(protocols=(protocol,), seed=seed, control=control, sham=True)
                for control in ("", *variants)
                for seed in few
            ]
        if settings.shuffle_control:
            jobs += [
                Job(protocols=(protocol,), seed=seed, control=control, shuffled=True)
                for control in variants
                for seed in few
            ]
    return jobs


def _variants(settings: TrainSettings) -> tuple[str, ...]:
    """Trainings of the same network that see more: the level, or a healthy record."""
    wanted = {
        LEVEL_KEPT: settings.normalise == BOTH,
        WITH_REFERENCE: settings.reference != NO_REFERENCE,
    }
    return tuple(name for name, is_wanted in wanted.items() if is_wanted)


def without_sham(predictions: Sequence[Prediction]) -> list[Prediction]:
    """Predictions on the data set itself."""
    return [prediction for prediction in predictions if not is_sham(prediction.method)]


def is_sham(method: str) -> bool:
    """True if a method was trained on the sham data set."""
    return method == sham.NETWORK or method.startswith(f"{sham.NETWORK}_")


def sham_methods(
    task: Task,
    settings: TrainSettings,
    predictions: Sequence[Prediction],
) -> dict[str, Entry]:
    """Protocol -> method -> scores of the trainings on the sham data set."""
    if settings.sham is None:
        return {}
    other = sham.sham_task(task, settings.sham)
    on_sham = [run for run in predictions if is_sham(run.method)]
    results: dict[str, Entry] = {}
    for protocol in dict.fromkeys(run.protocol for run in on_sham):
        results[protocol] = {}
        for method, runs in by_method(on_sham, protocol).items():
            results[protocol][method] = method_result(other, settings, runs)
    return results


def chosen_oracle(task: Task, runs: Sequence[Prediction]) -> str | None:
    """Name of the oracle that is best on the validation units; None where none ran."""
    oracles = (ORACLE_NETWORK, *baseline_names(Role.BOUND))
    return best_on_validation(task, runs, oracles)


def best_on_validation(
    task: Task, runs: Sequence[Prediction], methods: Iterable[str]
) -> str | None:
    """Method with the best mean balanced accuracy on the validation units; None where none ran.

    A choice on the test records would flatter the chosen one.
    """
    among = set(methods)
    scores: dict[str, list[float]] = {}
    for run in runs:
        if run.method not in among or VALIDATION not in run.parts:
            continue
        rows = run.parts[VALIDATION]
        judged = judged_answers(task, run.method, rows.record, rows.answers[None])
        scores.setdefault(run.method, []).append(score(judged, ACCURACY))
    return max(scores, key=lambda name: float(np.mean(scores[name])), default=None)


def method_result(
    task: Task, settings: TrainSettings, runs: Sequence[Prediction]
) -> Entry:
    """Entry of a method in ``metrics.json``."""
    shuffled = runs[0].method.startswith(LABEL_SHUFFLE)
    judged = judged_runs(task, runs)
    scores = class_scores(
        judged, task.class_names, settings.n_bootstrap, shuffled=shuffled
    )
    return {**scores, **run_notes(runs)}
