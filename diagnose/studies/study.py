"""A study that tells classes apart: every protocol, seed, control and baseline, with its scores."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.baselines.base import StorableBaseline
from diagnose.baselines.registry import BASELINES
from diagnose.data.at_rate import at_rate
from diagnose.data.protocols import OPEN_PROTOCOLS, channels_to_cross, choose_protocols
from diagnose.data.window_choice import chosen_window
from diagnose.data.windows import (
    NORMALISATIONS,
    REFERENCES,
    SUBSETS,
    Segments,
    Task,
    check_names,
    subset_segments,
    subsets_of,
    task_of,
)
from diagnose.networks.domain import Domain
from diagnose.networks.registry import (
    build_model,
    check_example,
    has_window_length,
    input_of,
)
from diagnose.scoring.predictions import Prediction, Rows, write_predictions
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.answers import leak_answer
from diagnose.studies.baseline_runs import reasons_left_out
from diagnose.studies.controls import control_jobs, sham_methods, without_sham
from diagnose.studies.counts import by_method
from diagnose.studies.jobs import (
    WITH_REFERENCE,
    Job,
    Outcome,
    run_jobs,
    with_reference,
)
from diagnose.studies.kept_jobs import kept_jobs
from diagnose.studies.novelty import NoveltyRun
from diagnose.studies.novelty_metrics import (
    check_open_protocol,
    novelty_protocol_result,
    write_novelty,
)
from diagnose.studies.protocol_results import (
    BOOTSTRAP_SEED,
    is_leaky,
    main_protocol,
    protocol_result,
    score_predictions,
    test_score,
)
from diagnose.studies.result_files import Entry, network_name, save_network, study_facts
from diagnose.training.autoencoder import check_window_for_autoencoder
from diagnose.training.tensorboard import need_tensorboard, write_scores
from diagnose.training.train import device_of
from gensig.errors import ConfigError
from gensig.execution.base import read_n_workers
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

OUTCOME_KINDS = (Prediction, Rows, Domain, NoveltyRun)


def plan_study(
    task: Task, settings: TrainSettings
) -> tuple[tuple[str, ...], list[Job]]:
    """Protocols, leaky ones last, and their jobs, after checking that every subset can be used.

    Raises
    ------
    ConfigError    for a protocol that does not exist or cannot be trained on, a device that does
        not exist, an empty subset or a window that does not fit
    """
    wanted, _ = choose_protocols(task, settings.protocols)
    protocols = tuple(sorted(wanted, key=is_leaky))
    parts: list[Segments] = []
    for protocol in protocols:
        parts += _checked_parts(task, protocol)
    if "healthy_only" in protocols:
        check_window_for_autoencoder(task.window_samples)
    check_network(task, settings, parts)
    if settings.tensorboard:
        need_tensorboard()
    closed = tuple(name for name in protocols if name not in OPEN_PROTOCOLS)
    jobs: list[Job] = []
    if settings.baselines and closed:
        jobs.append(Job(protocols=closed, seed=None))
    for protocol in protocols:
        jobs += _jobs_of(settings, protocol)
    clean = [name for name in closed if not is_leaky(name)]
    return protocols, jobs + control_jobs(task, settings, clean)


def _checked_parts(task: Task, protocol: str) -> list[Segments]:
    """Stretches of every subset of a protocol; refuses one that cannot be judged."""
    labels = task.labels()
    is_open = protocol in OPEN_PROTOCOLS
    subsets: tuple[str, ...] = SUBSETS
    if not is_open:
        subsets = subsets_of(task, protocol)
    parts = []
    for subset in subsets:
        segments = subset_segments(task, protocol, subset)
        parts.append(segments)
        if is_open or subset in ("validation", REFERENCES):
            continue
        present = np.unique(labels[segments.record])
        if present.size < 2:
            name = task.class_names[int(present[0])]
            raise ConfigError(
                f"protocol {protocol}: one class only in its {subset} part ({name})"
            )
    if is_open:
        check_open_protocol(task, protocol)
    return parts


def _jobs_of(settings: TrainSettings, protocol: str) -> list[Job]:
    """Trainings on a protocol, and the fitted scores of an open one."""
    seeds: tuple[int | None, ...] = settings.seeds
    if protocol in OPEN_PROTOCOLS:
        return [Job(protocols=(protocol,), seed=seed) for seed in (None, *seeds)]
    jobs = [Job(protocols=(protocol,), seed=seed) for seed in seeds]
    if settings.shuffle_control:
        first = min(settings.seeds)
        for seed in range(first, first + settings.n_seeds_control):
            jobs.append(Job(protocols=(protocol,), seed=seed, shuffled=True))
    return jobs


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


def run_study(
    task: Task,
    settings: TrainSettings,
    folder: Path,
    *,
    protocols: Sequence[str],
    jobs: Sequence[Job],
    kept_in: Path | None = None,
    on_done: Callable[[str], None] = lambda line: None,
) -> Entry:
    """Run the jobs, write the models below `folder` and return the content of ``metrics.json``.

    Parameters
    ----------
    task, settings : of the study
    folder : exists; receives ``models/<protocol>-seed<k>`` and ``predictions.csv``
    protocols, jobs : of `plan_study`
    kept_in : folder of finished jobs, from which a study that was stopped goes on; None keeps none
    on_done : is given one line for each finished job
    """
    started = time.perf_counter()
    outcomes: list[Outcome] = run_jobs(
        task,
        settings,
        jobs,
        n_workers=read_n_workers(settings.n_threads),
        on_done=lambda runs: on_done(_progress_line(runs)),
        kept=kept_jobs(task, settings, protocols, kept_in, OUTCOME_KINDS),
    )
    predictions = [run for run in outcomes if isinstance(run, Prediction)]
    novelty = [run for run in outcomes if isinstance(run, NoveltyRun)]
    on_data = without_sham(predictions)
    for prediction in on_data:
        if prediction.weights is not None:
            _save(folder, task, settings, prediction)
    write_predictions(folder / "predictions.csv", task, on_data)
    if novelty:
        write_novelty(folder / "novelty.csv", task, novelty)
    n_bootstrap = settings.n_bootstrap
    score = functools.partial(score_predictions, n_bootstrap=n_bootstrap)
    shams = sham_methods(task, settings, predictions, score)
    results: Entry = {}
    novelty_results: Entry = {}
    for name in protocols:
        if name in OPEN_PROTOCOLS:
            novelty_results[name] = novelty_protocol_result(
                task, name, novelty, n_bootstrap=n_bootstrap, seed=BOOTSTRAP_SEED
            )
        else:
            results[name] = protocol_result(
                task, settings, name, on_data, shams.get(name, {})
            )
    _add_leaks(task, settings, results, on_data)
    if settings.tensorboard:
        write_scores(folder, results)
    return {
        **study_facts(task, settings),
        "n_records_unusable": int(np.sum(~np.asarray(task.dataset.usable, dtype=bool))),
        "class_names": list(task.class_names),
        "protocols": results,
        "novelty": novelty_results,
        "protocols_left_out": choose_protocols(task, settings.protocols)[1],
        "baselines_left_out": baselines_left_out(task, settings, protocols),
        "duration_s": round(time.perf_counter() - started, 1),
    }


def _add_leaks(
    task: Task,
    settings: TrainSettings,
    results: Entry,
    predictions: Sequence[Prediction],
) -> None:
    """Write ``leak`` into the result of each leaky protocol, where a clean one was run."""
    against = main_protocol(results)
    if against is None:
        return
    name = network_name(settings)
    clean = by_method(predictions, against)[name]
    for protocol, result in results.items():
        if result["leaky"]:
            leaky = by_method(predictions, protocol)[name]
            result["leak"] = leak_answer(task, settings, leaky, clean)


def baselines_left_out(
    task: Task, settings: TrainSettings, protocols: Sequence[str]
) -> dict[str, str]:
    """Baseline of the settings -> protocols that it is left out of, and why."""
    closed = [name for name in protocols if name not in OPEN_PROTOCOLS]
    return reasons_left_out(task, closed, settings.baselines)


def _progress_line(runs: Sequence[Outcome]) -> str:
    """Line on a finished job: its training, or the names of its baselines."""
    last = runs[-1]
    if isinstance(last, NoveltyRun) or last.best_epoch:
        return f"{last.protocol}, {last.method}, seed {last.seed}: {last.detail}"
    return ", ".join(dict.fromkeys(run.method for run in runs))


def _save(
    folder: Path, task: Task, settings: TrainSettings, prediction: Prediction
) -> None:
    """Write the model of a prediction, with its score; a network's also with its domain."""
    tensors = dict(prediction.weights or {})
    if prediction.domain is not None:
        tensors |= prediction.domain.tensors()
    score = test_score(task, prediction, settings.n_bootstrap)
    name, baseline = prediction.protocol, BASELINES.get(prediction.method)
    if prediction.method == WITH_REFERENCE:
        settings, name = with_reference(settings), f"{name}-{WITH_REFERENCE}"
    if baseline is not None and issubclass(baseline, StorableBaseline):
        name = f"{name}-{prediction.method}"
        settings = replace(settings, model=Section("model", baseline.description(task)))
    save_network(
        folder,
        name,
        task,
        settings,
        prediction,
        tensors,
        test_score=score,
    )
