"""Jobs of a study that tells classes apart: baselines, trainings and their controls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from diagnose.baselines.base import Role, Source
from diagnose.baselines.features import Cache
from diagnose.baselines.oracle import oracle_windows
from diagnose.baselines.registry import baseline_names
from diagnose.data.inputs import NetworkInput
from diagnose.data.protocols import HEALTHY_ONLY, OPEN_PROTOCOLS
from diagnose.data.turns import REFERENCE
from diagnose.data.window_input import Windows
from diagnose.data.windows import (
    REFERENCES,
    SUBSETS,
    FloatArray,
    Task,
    WindowSet,
    subset_segments,
    subsets_of,
)
from diagnose.networks.domain import fit_domain
from diagnose.networks.network import Network
from diagnose.networks.registry import input_of
from diagnose.scoring.metrics import over_records
from diagnose.scoring.predictions import (
    LAST_EPOCH,
    VALIDATION,
    WINDOWS,
    Prediction,
    Rows,
)
from diagnose.settings import TrainSettings
from diagnose.studies.baseline_runs import (
    LABEL_SHUFFLE,
    baseline_predictions,
    shuffle_method,
)
from diagnose.studies.canaries import canary_labels, counted, with_canaries
from diagnose.studies.jobs import Job, once
from diagnose.studies.novelty import fitted_runs, rows_of_records, trained_runs
from diagnose.studies.result_files import network_name
from diagnose.training.classes import Classes, predict_windows, with_shuffled_labels
from diagnose.training.entries import predict_entries
from diagnose.training.heads import predict_heads
from diagnose.training.sham import sham_method, sham_task
from diagnose.training.tensorboard import epoch_log
from diagnose.training.train import Training, train_network

# Controls of a job beside label shuffle and sham, and the network that sees the level.
PROBE, ORACLE, LEVEL_KEPT = "probe", "oracle", "level_kept"
# The network that also sees a healthy record of the machine.
WITH_REFERENCE = "with_reference"
OF_TIME = Windows()
# Names of trained controls in metrics.json; that of `LEVEL_KEPT` is the same.
ORACLE_NETWORK = "oracle_network"


def run_job(task: Task, settings: TrainSettings, job: Job) -> list[Prediction]:
    """Predictions, or scores of novelty, on the test part of each of the job's protocols.

    Those on the sham data set have names of their own.
    """
    first = job.protocols[0]
    if first in OPEN_PROTOCOLS:
        return _novelty_runs(task, settings, first, job.seed)
    if not job.sham:
        return _predictions(task, settings, job)
    folder, network = str(settings.sham), network_name(settings)
    sham = once("sham", folder, lambda: sham_task(task, folder))
    return [
        replace(run, method=sham_method(run.method, network))
        for run in _predictions(sham, settings, job)
    ]


def _predictions(task: Task, settings: TrainSettings, job: Job) -> list[Prediction]:
    if job.seed is None:
        return _run_baselines(task, settings, job)
    return [
        _run_training(task, settings, job, name, job.seed) for name in job.protocols
    ]


def _novelty_runs(
    task: Task, settings: TrainSettings, protocol: str, seed: int | None
) -> list[Prediction]:
    if seed is None:
        return fitted_runs(task, settings, protocol, _windows(task, protocol))
    inputs = input_of(settings.model)
    if protocol == HEALTHY_ONLY:
        inputs = OF_TIME  # of the autoencoder
    return trained_runs(settings, protocol, seed, _windows(task, protocol, "", inputs))


def _run_training(
    task: Task,
    settings: TrainSettings,
    job: Job,
    protocol: str,
    seed: int,
) -> Prediction:
    n_classes, control = len(task.class_names), job.control
    if control == WITH_REFERENCE:
        settings = with_reference(settings)
    sets = _windows(task, protocol, control, input_of(settings.model))
    canaries = canary_labels(task, protocol)
    train, validation, test = (
        with_canaries(sets[subset], canaries) for subset in SUBSETS
    )
    if job.shuffled:
        settings = replace(settings, patience=0)
        rng = np.random.default_rng([seed, 2])
        train = with_shuffled_labels(train, n_classes, rng)
        validation = with_shuffled_labels(validation, n_classes, rng)
    log = _log_name(settings, job, protocol, seed)
    with epoch_log(settings.out, log, wanted=settings.tensorboard) as on_epoch:
        training = train_network(
            train,
            validation,
            target=Classes(n_classes=n_classes),
            settings=settings,
            seed=seed,
            on_epoch=on_epoch,
        )
    model = training.model
    by_window = predict_windows(model, test)
    record, answers = over_records(by_window, test.record)
    parts = {
        VALIDATION: rows_of_records(model, validation),
        WINDOWS: Rows(record=test.record, answers=by_window),
    }
    further = {LAST_EPOCH: answers}
    if not job.shuffled:
        if REFERENCES in sets:
            parts[REFERENCES] = rows_of_records(model, sets[REFERENCES])
        further |= _further_answers(training, test)
    prediction = Prediction(
        protocol=protocol,
        method=_method(settings, job),
        seed=seed,
        record=record,
        answers=answers,
        detail=training.detail,
        parts=parts,
        further=further,
        best_epoch=training.best_epoch,
        validation_loss=training.validation_loss,
        temperature=training.temperature,
    )
    prediction = counted(prediction, canaries)
    if job.shuffled or job.sham or control not in ("", WITH_REFERENCE):
        return prediction
    key = (protocol, control)  # the same region for every seed
    domain = once("domain", key, lambda: fit_domain(train, validation))
    return replace(prediction, weights=training.weights(), domain=domain)


def _further_answers(
    training: Training[Network], test: WindowSet
) -> dict[str, FloatArray]:
    """Answers of the last epoch if it is not the best one, of further heads and other entries."""
    further = predict_heads(training.model, test)
    further |= predict_entries(training.model, test)
    if training.last_model is not None:
        last = rows_of_records(training.last_model, test)
        further[LAST_EPOCH] = last.answers
    return further


def with_reference(settings: TrainSettings) -> TrainSettings:
    """Settings of the network that also sees a healthy record of the machine."""
    return replace(settings, model=settings.model | {REFERENCE: settings.reference})


def _method(settings: TrainSettings, job: Job) -> str:
    """Name of the result of a training in ``metrics.json``, but for that of the sham."""
    if job.shuffled and job.control:
        return shuffle_method(job.control)
    if job.shuffled:
        return LABEL_SHUFFLE
    if job.control == ORACLE:
        return ORACLE_NETWORK
    return job.control or network_name(settings)


def _log_name(settings: TrainSettings, job: Job, protocol: str, seed: int) -> str:
    """Name of the losses of a training in the folder of tensorboard."""
    network = network_name(settings)
    method = _method(settings, job)
    if job.sham:
        method = sham_method(method, network)
    words = [protocol, f"seed{seed}"]
    if method != network:
        words.insert(1, method)
    return "-".join(words)


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
            windows=partial(_windows, task, protocol),
            caches=caches,
        )
        shuffled = settings.shuffle_control and not (job.control or job.sham)
        predictions += baseline_predictions(source, names, shuffled=shuffled)
    return predictions


def _names_of_baselines(settings: TrainSettings, control: str) -> tuple[str, ...]:
    """Names of the baselines that a control runs; without one, those of the settings."""
    if control == PROBE:
        return baseline_names(Role.AT_CHANCE, Role.FOLLOWER)
    if control == ORACLE:
        return baseline_names(Role.BOUND)
    return settings.baselines


def _windows(
    task: Task,
    protocol: str,
    control: str = "",
    inputs: NetworkInput = OF_TIME,
) -> dict[str, WindowSet]:
    """Windows of time, or the inputs that a network reads, of each subset."""
    load: Callable[..., WindowSet] = inputs.load
    if control == ORACLE:
        load = partial(oracle_windows, inputs=inputs)

    def make() -> dict[str, WindowSet]:
        return {
            name: load(
                task.part(protocol, name),
                subset_segments(task, protocol, name),
                training=name == "train",
            )
            for name in _subsets(task, protocol, control, inputs)
        }

    key = (str(task.dataset.folder), protocol, control == ORACLE, inputs)
    sets = once("inputs", key, make)
    if control == LEVEL_KEPT:
        return {name: replace(part, normalise="none") for name, part in sets.items()}
    return sets


def _subsets(
    task: Task, protocol: str, control: str, inputs: NetworkInput
) -> tuple[str, ...]:
    """Subsets to load; references stand alone, and have no twin of an oracle."""
    if inputs.compares or control == ORACLE or protocol in OPEN_PROTOCOLS:
        return SUBSETS
    return subsets_of(task, protocol)
