"""The independent pieces of a study, run on every core: same results whatever their number and
order.

Each piece runs with one thread, in a spawned process or, when there is one core, in this one.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import torch

from diagnose.baselines.base import Role, Source
from diagnose.baselines.features import Cache
from diagnose.baselines.oracle import oracle_windows
from diagnose.baselines.registry import baseline_names
from diagnose.data.inputs import NetworkInput
from diagnose.data.protocols import HEALTHY_ONLY, OPEN_PROTOCOLS
from diagnose.data.window_input import Windows
from diagnose.data.windows import SUBSETS, Task, WindowSet, subset_segments
from diagnose.networks.adaptation import healthy_statistics
from diagnose.networks.domain import Domain, fit_domain
from diagnose.networks.registry import input_of
from diagnose.scoring.metrics import over_records
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.settings import TrainSettings
from diagnose.studies.baseline_runs import baseline_predictions
from diagnose.studies.novelty import NoveltyRun, fitted_runs, trained_runs
from diagnose.training.classes import Classes, predict_windows, with_shuffled_labels
from diagnose.training.heads import predict_heads
from diagnose.training.sham import sham_method, sham_task
from diagnose.training.tensorboard import epoch_log
from diagnose.training.train import train_network
from gensig.errors import GensigError

# Controls of a job beside the label shuffle, and the network that sees the level.
PROBE, ORACLE, SHAM, LEVEL_KEPT = "probe", "oracle", "sham", "level_kept"
WINDOWS = Windows()
# Names of trained controls in metrics.json; those of `SHAM` and `LEVEL_KEPT` are their own.
LABEL_SHUFFLE, ORACLE_NETWORK = "label_shuffle", "oracle_network"


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One training (with or without shuffled labels), or with seed None the baselines of all the
    protocols.

    One of `OPEN_PROTOCOLS` is a job of its own: with seed None the scores that are fitted, else
    those of a network. ``control`` is "" or one of the controls, which then takes the place of
    the training or of the baselines.
    """

    protocols: tuple[str, ...]
    seed: int | None
    shuffled: bool = False
    control: str = ""


Outcome = Prediction | NoveltyRun


def run_jobs(
    task: Task,
    settings: TrainSettings,
    jobs: Sequence[Job],
    *,
    n_workers: int,
    on_done: Callable[[list[Any]], None],
    run: Callable[[Task, TrainSettings, Job], list[Any]] | None = None,
) -> list[Any]:
    """Run all jobs, each by `run_job` or ``run``, and collect what they give in the order of the
    jobs.

    Raises
    ------
    GensigError    as raised by a job, or if a worker was killed
    """
    run = run or run_job
    if n_workers == 1 or len(jobs) == 1:
        results = []
        try:
            with _one_thread():
                for job in jobs:
                    results.append(run(task, settings, job))
                    on_done(results[-1])
        finally:
            _forget_inputs()
        return [prediction for result in results for prediction in result]
    context = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(
        min(n_workers, len(jobs)), context, _start_worker, (task, settings, run)
    )
    try:
        futures = [executor.submit(_run_in_worker, job) for job in jobs]
        for future in as_completed(futures):
            on_done(future.result())
        return [prediction for future in futures for prediction in future.result()]
    except BrokenProcessPool:
        raise GensigError(
            "a worker process was killed (out of memory?); set n_threads=1 or use fewer records"
        ) from None
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _forget_inputs() -> None:
    """Drop what the jobs of one study share, so that the next study in this process loads its
    own.
    """
    _loaded.clear()
    _domains.clear()
    _shams.clear()


def run_job(task: Task, settings: TrainSettings, job: Job) -> list[Outcome]:
    """Predictions, or scores of novelty, on the test part of each of the job's protocols."""
    if job.protocols[0] in OPEN_PROTOCOLS:
        name = job.protocols[0]
        if job.seed is None:
            return [*fitted_runs(task, settings, name, _windows(task, name))]
        inputs = input_of(settings.model)
        if name == HEALTHY_ONLY:
            inputs = WINDOWS  # of the autoencoder
        return [
            *trained_runs(settings, name, job.seed, _windows(task, name, "", inputs))
        ]
    if job.control == SHAM:
        task = _sham(task, settings)
    if job.seed is not None:
        return [
            _run_training(task, settings, name, job.seed, job.shuffled, job.control)
            for name in job.protocols
        ]
    return [*_run_baselines(task, settings, job)]


def _run_training(
    task: Task,
    settings: TrainSettings,
    protocol: str,
    seed: int,
    shuffled: bool,
    control: str,
) -> Prediction:
    n_classes = len(task.class_names)
    sets = _windows(task, protocol, control, input_of(settings.model))
    train, validation, test = (sets[subset] for subset in SUBSETS)
    if shuffled:
        rng = np.random.default_rng([seed, 2])
        train = with_shuffled_labels(train, n_classes, rng)
        validation = with_shuffled_labels(validation, n_classes, rng)
    variant = LABEL_SHUFFLE if shuffled else control
    run = "-".join(word for word in (protocol, variant, f"seed{seed}") if word)
    with epoch_log(settings.out, run, wanted=settings.tensorboard) as on_epoch:
        training = train_network(
            train,
            validation,
            target=Classes(n_classes=n_classes),
            settings=settings,
            seed=seed,
            on_epoch=on_epoch,
        )
    by_window = predict_windows(training.model, test)
    record, log_probability = over_records(by_window, test.record)
    held_out, held_out_scores = over_records(
        predict_windows(training.model, validation), validation.record
    )
    is_model = not shuffled and not control
    domain = _domain(protocol, train, validation) if is_model else None
    network = str(settings.model.get("name", "network"))
    names = {
        ORACLE: ORACLE_NETWORK,
        SHAM: sham_method(network, network),
        LEVEL_KEPT: LEVEL_KEPT,
    }
    last = log_probability
    if training.last_model is not None and not shuffled:
        _, last = over_records(predict_windows(training.last_model, test), test.record)
    return Prediction(
        protocol=protocol,
        method=LABEL_SHUFFLE if shuffled else names.get(control, network),
        seed=seed,
        record=record,
        log_probability=log_probability,
        detail=training.detail,
        validation=Rows(record=held_out, log_probability=held_out_scores),
        windows=Rows(record=test.record, log_probability=by_window),
        weights=training.weights() if is_model else None,
        domain=domain,
        healthy=None
        if shuffled
        else healthy_statistics(training.model, train, task.class_names),
        best_epoch=training.best_epoch,
        validation_loss=training.validation_loss,
        temperature=training.temperature,
        last_predicted=last.argmax(axis=1),
        heads={} if shuffled else predict_heads(training.model, test),
    )


def _run_baselines(task: Task, settings: TrainSettings, job: Job) -> list[Prediction]:
    """Predictions of the baselines of a job on each of its protocols."""
    names = _names_of_baselines(settings, job.control)
    caches: dict[str, Cache] = {}
    predictions = []
    for protocol in job.protocols:
        source = Source(
            task=task,
            protocol=protocol,
            features=settings.features,
            minirocket_features=settings.minirocket_features,
            windows=partial(_windows, task, protocol),
            caches=caches,
        )
        predictions += baseline_predictions(source, names)
    if job.control != SHAM:
        return predictions
    network = str(settings.model.get("name", "network"))
    return [
        replace(run, method=sham_method(run.method, network)) for run in predictions
    ]


def _names_of_baselines(settings: TrainSettings, control: str) -> tuple[str, ...]:
    """Names of the baselines that a control runs; without one, those of the settings."""
    if control == PROBE:
        return baseline_names(Role.AT_CHANCE, Role.FOLLOWER)
    if control == ORACLE:
        return baseline_names(Role.BOUND)
    return settings.baselines


# Windows of the protocol a process works on; jobs come protocol by protocol.
_loaded: dict[tuple[str, str, bool, NetworkInput], dict[str, WindowSet]] = {}
_domains: dict[str, Domain] = {}
_shams: dict[str, Task] = {}
_work: dict[str, Any] = {}


def _windows(
    task: Task,
    protocol: str,
    control: str = "",
    inputs: NetworkInput = WINDOWS,
) -> dict[str, WindowSet]:
    """Windows of time, or the inputs that a network reads, of each subset."""
    key = (str(task.dataset.folder), protocol, control == ORACLE, inputs)
    if key not in _loaded:
        _loaded.clear()
        load = (
            partial(oracle_windows, inputs=inputs) if control == ORACLE else inputs.load
        )
        _loaded[key] = {
            name: load(
                task.part(protocol, name),
                subset_segments(task, protocol, name),
                training=name == "train",
            )
            for name in SUBSETS
        }
    if control == LEVEL_KEPT:
        return {
            name: replace(windows, normalise="none")
            for name, windows in _loaded[key].items()
        }
    return _loaded[key]


def _sham(task: Task, settings: TrainSettings) -> Task:
    """The task on the sham data set, opened once a process."""
    folder = str(settings.sham)
    if folder not in _shams:
        _shams[folder] = sham_task(task, folder)
    return _shams[folder]


def _domain(protocol: str, train: WindowSet, validation: WindowSet) -> Domain:
    """The same for every seed."""
    if protocol not in _domains:
        _domains.clear()
        _domains[protocol] = fit_domain(train, validation)
    return _domains[protocol]


def _start_worker(
    task: Task, settings: TrainSettings, run: Callable[..., list[Any]]
) -> None:
    from threadpoolctl import threadpool_limits

    torch.set_num_threads(1)
    threadpool_limits(1)
    _work.update(task=task, settings=settings, run=run)


def _run_in_worker(job: Job) -> list[Any]:
    return [*_work["run"](_work["task"], _work["settings"], job)]


@contextmanager
def _one_thread() -> Iterator[None]:
    """One thread for torch and the BLAS, as before afterwards."""
    from threadpoolctl import threadpool_limits

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        torch.set_num_threads(before)
