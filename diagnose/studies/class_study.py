"""A study that tells classes apart: every protocol, seed, control and baseline, with its scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from diagnose.baselines.base import StorableBaseline
from diagnose.baselines.registry import BASELINES
from diagnose.data.protocols import OPEN_PROTOCOLS, choose_protocols
from diagnose.data.windows import (
    REFERENCES,
    SUBSETS,
    Segments,
    Task,
    subset_segments,
    subsets_of,
)
from diagnose.scoring.predictions import Prediction, by_method, write_predictions
from diagnose.settings import TrainSettings
from diagnose.studies.answers import leak_answer
from diagnose.studies.baseline_runs import reasons_left_out
from diagnose.studies.class_jobs import (
    WITH_REFERENCE,
    run_job,
    with_reference,
)
from diagnose.studies.controls import (
    control_jobs,
    is_sham,
    sham_methods,
    without_sham,
)
from diagnose.studies.jobs import Job, LearningStudy, Plan
from diagnose.studies.novelty_metrics import (
    check_open_protocol,
    novelty_protocol_result,
    write_novelty,
)
from diagnose.studies.protocol_results import (
    is_leaky,
    main_protocol,
    protocol_result,
    test_score,
)
from diagnose.studies.result_files import Entry, network_name, save_network
from diagnose.studies.study import check_network
from diagnose.training.autoencoder import check_window_for_autoencoder
from diagnose.training.tensorboard import need_tensorboard, write_scores
from gensig.errors import ConfigError
from gensig.options.configuration import Section


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ClassStudy(LearningStudy):
    """Classes of records, and with open protocols their novelty; leaky protocols are last."""

    @staticmethod
    def check(settings: TrainSettings) -> None:
        """Refuse nothing: there is no setting that classes ignore."""

    def plan(self) -> Plan:
        """Plan of a study, after checking that every subset can be used."""
        task, settings = self.task, self.settings
        wanted, left_out = choose_protocols(task, settings.protocols)
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
        jobs += control_jobs(task, settings, clean)
        return Plan(
            protocols=protocols,
            jobs=jobs,
            left_out=left_out,
            baselines_left_out=reasons_left_out(task, closed, settings.baselines),
        )

    def run_job(self, job: Job) -> list[Prediction]:
        """Predictions, or scores of novelty."""
        return run_job(self.task, self.settings, job)

    def progress(self, runs: Sequence[Prediction]) -> str:
        """Line on a finished job: its training, or the names of its baselines."""
        last = runs[-1]
        if last.best_epoch or last.protocol in OPEN_PROTOCOLS:
            return f"{last.protocol}, {last.method}, seed {last.seed}: {last.detail}"
        return ", ".join(dict.fromkeys(run.method for run in runs))

    def save(self, folder: Path, run: Prediction) -> None:
        """Write a network or a baseline with its score; none of the sham data set."""
        if is_sham(run.method):
            return
        task, settings = self.task, self.settings
        score = test_score(task, run, settings.n_bootstrap)
        name, baseline = run.protocol, BASELINES.get(run.method)
        if run.method == WITH_REFERENCE:
            settings, name = with_reference(settings), f"{name}-{WITH_REFERENCE}"
        if baseline is not None and issubclass(baseline, StorableBaseline):
            name = f"{name}-{run.method}"
            described = Section("model", baseline.description(task))
            settings = replace(settings, model=described)
        save_network(folder, name, task, settings, run, test_score=score)

    def results(self, folder: Path, plan: Plan, runs: Sequence[Prediction]) -> Entry:
        """Write both tables of predictions, and return the results of all protocols."""
        task, settings = self.task, self.settings
        novelty = [run for run in runs if run.protocol in OPEN_PROTOCOLS]
        predictions = [run for run in runs if run.protocol not in OPEN_PROTOCOLS]
        on_data = without_sham(predictions)
        write_predictions(folder / "predictions.csv", task, on_data)
        if novelty:
            write_novelty(folder / "novelty.csv", task, novelty)
        shams = sham_methods(task, settings, predictions)
        results: Entry = {}
        novelty_results: Entry = {}
        for name in plan.protocols:
            if name in OPEN_PROTOCOLS:
                novelty_results[name] = novelty_protocol_result(
                    task, name, novelty, n_bootstrap=settings.n_bootstrap
                )
            else:
                results[name] = protocol_result(
                    task, settings, name, on_data, shams.get(name, {})
                )
        _add_leaks(task, settings, results, on_data)
        if settings.tensorboard:
            write_scores(folder, results)
        usable = np.asarray(task.dataset.usable, dtype=bool)
        return {
            "n_records_unusable": int(np.sum(~usable)),
            "class_names": list(task.class_names),
            "protocols": results,
            "novelty": novelty_results,
            "protocols_left_out": plan.left_out,
            "baselines_left_out": plan.baselines_left_out,
        }


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
