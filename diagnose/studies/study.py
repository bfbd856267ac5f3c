"""A study of any learning target: its task, its jobs, its models and ``metrics.json``."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from diagnose.data.at_rate import at_rate
from diagnose.data.protocols import channels_to_cross
from diagnose.data.window_choice import chosen_window
from diagnose.data.windows import NORMALISATIONS, Segments, Task, check_names, task_of
from diagnose.networks.registry import (
    build_model,
    check_example,
    has_window_length,
    input_of,
)
from diagnose.scoring.predictions import Prediction
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.jobs import LearningStudy, Plan, run_jobs
from diagnose.studies.kept_jobs import kept_jobs
from diagnose.studies.result_files import Entry, network_name, study_facts
from diagnose.training.train import device_of
from gensig.execution.base import read_n_workers

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


def task_from(dataset: Any, settings: TrainSettings) -> Task:
    """Task that the settings describe on an open data set."""
    check_names("normalisation", (settings.normalise,), (*NORMALISATIONS, BOTH))
    dataset = at_rate(dataset, settings.sampling_rate_hz)
    window = settings.window_samples or chosen_window(dataset)[0]
    normalise = settings.normalise
    if normalise == BOTH:
        normalise = "rms"
    task = task_of(
        dataset,
        window_samples=window,
        stride_samples=settings.stride_samples or window,
        normalise=normalise,
        classes=settings.classes,
        channels=settings.channels,
        one_class=settings.task == "remaining_life",
    )
    crossed = channels_to_cross(
        dataset.channel_names, settings.channels, settings.test_channels
    )
    return replace(task, cross_channels=crossed)


def window_note(dataset: Dataset, settings: TrainSettings) -> str | None:
    """Line on windows of another length than usual; None where they are usual, given or not read.

    Parameters
    ----------
    dataset : at the rate that is trained at
    """
    if settings.window_samples or not has_window_length(settings.model):
        return None
    return chosen_window(dataset)[1]


def check_network(
    task: Task, settings: TrainSettings, parts: Sequence[Segments]
) -> None:
    """Refuse a network or a device that cannot be trained on every one of these parts.

    Raises
    ------
    ConfigError    for parameters, stretches or windows that do not fit, and a missing device
    """
    inputs = input_of(settings.model)
    for segments in parts:
        inputs.check(task, segments, network_name(settings))
    example = inputs.example(len(task.channel_names), task.window_samples)
    model = build_model(
        settings.model,
        n_channels=example.shape[1],
        n_classes=len(task.class_names),
    )
    check_example(model, example)
    device_of(settings.device)


def run_study(
    study: LearningStudy,
    plan: Plan,
    *,
    kept_in: Path | None = None,
    on_done: Callable[[str], None] = lambda line: None,
) -> tuple[Entry, list[Prediction]]:
    """Run the jobs, write their models, and return the content of ``metrics.json`` and outcomes.

    Parameters
    ----------
    study : its folder ``out`` exists; it receives ``models/`` and the predictions
    kept_in : folder of finished jobs, from which a study that was stopped goes on; None keeps none
    on_done : is given one line for each finished job
    """
    started, task, settings = time.perf_counter(), study.task, study.settings
    runs = run_jobs(
        study,
        plan.jobs,
        n_workers=read_n_workers(settings.n_threads),
        on_done=lambda done: on_done(study.progress(done)),
        kept=kept_jobs(task, settings, plan.protocols, kept_in),
    )
    folder = Path(settings.out)
    for run in runs:
        if run.weights is not None:
            study.save(folder, run)
    return {
        **study_facts(task, settings),
        **study.results(folder, plan, runs),
        "duration_s": round(time.perf_counter() - started, 1),
    }, runs
