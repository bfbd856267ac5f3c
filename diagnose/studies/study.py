"""A whole study: every protocol, seed, control and baseline, and the numbers that come of them."""

from __future__ import annotations

import functools
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.at_rate import at_rate
from diagnose.data.protocols import OPEN_PROTOCOLS, channels_to_cross, choose_protocols
from diagnose.data.window_choice import chosen_window
from diagnose.data.windows import (
    NORMALISATIONS,
    SUBSETS,
    Segments,
    Task,
    check_names,
    subset_segments,
    task_of,
)
from diagnose.networks.calibration import calibration_scores
from diagnose.networks.registry import (
    build_model,
    check_window,
    completed,
    has_window_length,
    input_of,
)
from diagnose.scoring.metrics import (
    SCORES,
    confusion_by_unit,
    ratio_with_interval,
    recall,
    score_with_interval,
)
from diagnose.scoring.predictions import Prediction, write_predictions
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.answers import protocol_answers
from diagnose.studies.controls import (
    chosen_oracle,
    control_jobs,
    sham_methods,
    without_sham,
)
from diagnose.studies.jobs import LABEL_SHUFFLE, ORACLE, Job, Outcome, run_jobs
from diagnose.studies.novelty import NoveltyRun
from diagnose.studies.novelty_metrics import (
    check_open_protocol,
    novelty_protocol_result,
    write_novelty,
)
from diagnose.training.autoencoder import check_window_for_autoencoder
from diagnose.training.heads import head_scores
from diagnose.training.store import data_fingerprint, model_description, save_model
from diagnose.training.tensorboard import need_tensorboard, write_scores
from diagnose.training.train import device_of
from gensig.errors import ConfigError
from gensig.version import __version__

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

METRICS_SCHEMA_VERSION = 1
BOOTSTRAP_SEED = 20240607


def is_leaky(protocol: str) -> bool:
    """Whether a protocol has the same record on both sides.

    Such a score is no measure of diagnosis.
    """
    return "leaky" in protocol


def plan_study(
    task: Task, settings: TrainSettings
) -> tuple[tuple[str, ...], list[Job]]:
    """Protocols, leaky ones last, and their jobs, after checking that every subset can be used.

    Raises
    ------
    ConfigError    for a protocol that does not exist or cannot be trained on, a device that does not exist, an empty
        subset or a window that does not fit
    """
    wanted, _ = choose_protocols(task, settings.protocols)
    protocols = tuple(
        sorted(wanted, key=lambda name: (is_leaky(name), wanted.index(name)))
    )
    labels = task.labels()
    parts: list[Segments] = []
    for protocol in protocols:
        for subset in SUBSETS:
            segments = subset_segments(task, protocol, subset)
            parts.append(segments)
            present = np.unique(labels[segments.record])
            if (
                protocol not in OPEN_PROTOCOLS
                and subset != "validation"
                and present.size < 2
            ):
                name = task.class_names[int(present[0])]
                raise ConfigError(
                    f"protocol {protocol}: one class only in its {subset} part ({name})"
                )
        if protocol in OPEN_PROTOCOLS:
            check_open_protocol(task, protocol)
    if "healthy_only" in protocols:
        check_window_for_autoencoder(task.window_samples)
    check_network(task, settings, parts)
    if settings.tensorboard:
        need_tensorboard()
    closed = tuple(name for name in protocols if name not in OPEN_PROTOCOLS)
    jobs = [Job(protocols=closed, seed=None)] if settings.baselines and closed else []
    for protocol in protocols:
        jobs += (
            [Job(protocols=(protocol,), seed=None)] if protocol not in closed else []
        )
        jobs += [Job(protocols=(protocol,), seed=seed) for seed in settings.seeds]
        if settings.shuffle_control and protocol in closed:
            first = min(settings.seeds)
            jobs += [
                Job(protocols=(protocol,), seed=first + k, shuffled=True)
                for k in range(settings.n_seeds_control)
            ]
    return protocols, jobs + control_jobs(
        task, settings, [name for name in closed if not is_leaky(name)]
    )


def check_network(
    task: Task, settings: TrainSettings, parts: Sequence[Segments]
) -> None:
    """Refuse a network or a device that cannot be trained on every one of these parts.

    Raises
    ------
    ConfigError    for parameters, stretches or windows that do not fit, and a missing device
    """
    n_channels = len(task.channel_names)
    model = build_model(
        settings.model, n_channels=n_channels, n_classes=len(task.class_names)
    )
    inputs, name = input_of(settings.model), str(settings.model.get("name", "network"))
    for segments in parts:
        inputs.check(task, segments, name)
    check_window(model, n_channels, inputs.n_points(task.window_samples))
    device_of(settings.device)


def task_from(dataset: Any, settings: TrainSettings) -> Task:
    """Task that the settings describe on an open data set."""
    check_names("normalisation", (settings.normalise,), (*NORMALISATIONS, BOTH))
    dataset = at_rate(dataset, settings.sampling_rate_hz)
    window = settings.window_samples or chosen_window(dataset)[0]
    task = task_of(
        dataset,
        window_samples=window,
        stride_samples=settings.stride_samples or window,
        normalise="rms" if settings.normalise == BOTH else settings.normalise,
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


def settings_for(dataset: Any, settings: TrainSettings) -> TrainSettings:
    """The settings with what an open data set decides: the window, and what turns need."""
    window = (
        settings.window_samples
        or chosen_window(at_rate(dataset, settings.sampling_rate_hz))[0]
    )
    return replace(
        settings,
        model=completed(settings.model, dataset.attributes, settings.heads),
        window_samples=window,
        stride_samples=settings.stride_samples or window,
    )


def run_study(
    task: Task,
    settings: TrainSettings,
    folder: Path,
    *,
    protocols: Sequence[str],
    jobs: Sequence[Job],
    on_done: Callable[[str], None] = lambda line: None,
) -> dict[str, Any]:
    """Run the jobs, write the models below `folder` and return what goes into ``metrics.json``.

    Parameters
    ----------
    task, settings : what to learn and how
    folder : exists; receives ``models/<protocol>-seed<k>`` and ``predictions.csv``
    protocols, jobs : of `plan_study`
    on_done : told one line for each finished piece
    """
    started = time.perf_counter()

    def report(predictions: list[Outcome]) -> None:
        last = predictions[-1]
        if isinstance(last, NoveltyRun) or last.best_epoch:
            on_done(f"{last.protocol}, {last.method}, seed {last.seed}: {last.detail}")
        else:
            on_done(", ".join(dict.fromkeys(one.method for one in predictions)))

    n_workers = settings.n_threads or n_cores()
    outcomes = run_jobs(task, settings, jobs, n_workers=n_workers, on_done=report)
    predictions = [outcome for outcome in outcomes if isinstance(outcome, Prediction)]
    novelty = [outcome for outcome in outcomes if isinstance(outcome, NoveltyRun)]
    for prediction in predictions:
        if prediction.weights is not None:
            target = folder / "models" / f"{prediction.protocol}-seed{prediction.seed}"
            parts = [
                part
                for part in (prediction.domain, prediction.healthy)
                if part is not None
            ]
            known = {
                name: tensor
                for part in parts
                for name, tensor in part.tensors().items()
            }
            described = model_description(task, settings, prediction)
            described = replace(
                described, test_score=test_score(task, prediction, settings.n_bootstrap)
            )
            save_model(target, prediction.weights | known, described)
    own = without_sham(predictions)
    write_predictions(folder / "predictions.csv", task, own)
    if novelty:
        write_novelty(folder / "novelty.csv", task, novelty)
    results = {
        name: _protocol_result(task, settings, name, own)
        for name in protocols
        if name not in OPEN_PROTOCOLS
    }
    shams = sham_methods(
        task,
        settings,
        predictions,
        functools.partial(score_predictions, n_bootstrap=settings.n_bootstrap),
    )
    for protocol, methods in shams.items():
        results[protocol]["methods"] |= methods
    novelty_results = {
        name: novelty_protocol_result(
            task, name, novelty, n_bootstrap=settings.n_bootstrap, seed=BOOTSTRAP_SEED
        )
        for name in protocols
        if name in OPEN_PROTOCOLS
    }
    if settings.tensorboard:
        write_scores(folder, results)
    return {
        "metrics_schema_version": METRICS_SCHEMA_VERSION,
        "data": str(task.dataset.folder),
        "data_fingerprint": data_fingerprint(task.dataset),
        "n_records": int(task.dataset.n_records),
        "n_records_unusable": int(np.sum(~np.asarray(task.dataset.usable, dtype=bool))),
        "sampling_rate_hz": float(task.dataset.sampling_rate),
        "class_names": list(task.class_names),
        "channel_names": list(task.channel_names),
        "model": str(settings.model.get("name", "network")),
        "settings": {**asdict(settings), "model": dict(settings.model)},
        "protocols": results,
        "novelty": novelty_results,
        "protocols_left_out": choose_protocols(task, settings.protocols)[1],
        "duration_s": round(time.perf_counter() - started, 1),
        "environment": environment(),
    }


def score_predictions(
    task: Task,
    runs: Sequence[tuple[NDArray[np.integer], NDArray[np.integer]]],
    n_bootstrap: int,
    *,
    shuffled: bool = False,
) -> dict[str, Any]:
    """Scores with intervals over units, confusion counts (true, predicted) and recall of one
    method.

    Parameters
    ----------
    task : gives labels and units
    runs : for each seed, records (record,) and predicted labels (record,); the same records in each
    n_bootstrap : resamples of the units
    shuffled : see `diagnose.scoring.metrics.score_with_interval`
    """
    confusion = _confusion(task, runs)
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    total = confusion.sum(axis=(0, 1))
    scores = {
        name: asdict(
            score_with_interval(
                name, confusion, n_bootstrap=n_bootstrap, rng=rng, shuffled=shuffled
            )
        )
        for name in SCORES
    }
    shares = {
        name: float(share)
        for name, share in zip(task.class_names, recall(total), strict=True)
        if np.isfinite(share)
    }
    return {**scores, "confusion": total.tolist(), "recall": shares}


def test_score(task: Task, prediction: Prediction, n_bootstrap: int) -> dict[str, Any]:
    """What is stored with a network of what it scored.

    Balanced accuracy with its interval, chance, and on how much.
    """
    scores = score_predictions(
        task, [(prediction.record, prediction.predicted)], n_bootstrap
    )["balanced_accuracy"]
    return {
        "balanced_accuracy": {key: scores[key] for key in ("mean", "low", "high")},
        "chance": 1.0 / int(np.unique(task.labels()[prediction.record]).size),
        "n_records": int(prediction.record.size),
        "n_units": int(
            np.unique(
                np.asarray(task.dataset.column("unit_id"))[prediction.record]
            ).size
        ),
        "leaky": is_leaky(prediction.protocol),
    }


def _confusion(
    task: Task, runs: Sequence[tuple[NDArray[np.integer], NDArray[np.integer]]]
) -> NDArray[np.int64]:
    """Counts (seed, unit, true class, predicted class)."""
    labels, unit = task.labels(), np.asarray(task.dataset.column("unit_id"))
    n_classes = len(task.class_names)
    return np.stack(
        [
            confusion_by_unit(labels[record], predicted, unit[record], n_classes)
            for record, predicted in runs
        ]
    )


def _protocol_result(
    task: Task,
    settings: TrainSettings,
    protocol: str,
    predictions: Sequence[Prediction],
) -> dict[str, Any]:
    labels, unit = task.labels(), np.asarray(task.dataset.column("unit_id"))
    mine = [prediction for prediction in predictions if prediction.protocol == protocol]
    methods: dict[str, Any] = {}
    for method in dict.fromkeys(prediction.method for prediction in mine):
        runs = [prediction for prediction in mine if prediction.method == method]
        pairs = [(run.record, run.predicted) for run in runs]
        shuffled = method == LABEL_SHUFFLE
        scores = score_predictions(task, pairs, settings.n_bootstrap, shuffled=shuffled)
        methods[method] = {
            **scores,
            "seeds": [run.seed for run in runs],
            "detail": [run.detail for run in runs],
        }
    network = [
        run for run in mine if run.method == str(settings.model.get("name", "network"))
    ]
    test = np.unique(network[0].record)
    counts = np.bincount(labels[test], minlength=len(task.class_names))
    methods["chance"] = {
        "balanced_accuracy": 1.0 / int((counts > 0).sum()),
        "majority_accuracy": float(counts.max() / counts.sum()),
    }
    parts = {
        subset: np.unique(subset_segments(task, protocol, subset).record)
        for subset in SUBSETS
    }
    oracle = chosen_oracle(task, mine)
    over_oracle: dict[str, Any] = {}
    if oracle is not None:
        methods[ORACLE] = {**methods[oracle], "chosen": oracle}
        found = [
            _confusion(
                task,
                [(run.record, run.predicted) for run in mine if run.method == name],
            )
            for name in (network[0].method, oracle)
        ]
        for name in SCORES:
            rng = np.random.default_rng(BOOTSTRAP_SEED)
            over_oracle[name] = ratio_with_interval(
                name, *found, n_bootstrap=settings.n_bootstrap, rng=rng
            )
    return {
        "leaky": is_leaky(protocol),
        "channels": {
            subset: list(task.part(protocol, subset).channel_names)
            for subset in ("train", "test")
        },
        "n_records": {subset: int(record.size) for subset, record in parts.items()},
        "n_units": {
            subset: int(np.unique(unit[record]).size)
            for subset, record in parts.items()
        },
        "methods": methods,
        "over_oracle": over_oracle,
        "validation_loss": [list(run.validation_loss) for run in network],
        "best_epoch": [run.best_epoch for run in network],
        "last_epoch": _last_epoch(task, settings, network),
        "calibration": _calibration(task, network),
        "heads": head_scores(
            task, parts["train"], network, n_bootstrap=settings.n_bootstrap
        ),
        "answers": None
        if is_leaky(protocol)
        else protocol_answers(task, settings, mine),
    }


def _last_epoch(
    task: Task, settings: TrainSettings, network: Sequence[Prediction]
) -> dict[str, Any]:
    """Epochs run and the scores of the weights of the last one.

    What choosing the best epoch brought.
    """
    pairs = [
        (run.record, run.last_predicted)
        for run in network
        if run.last_predicted is not None
    ]
    scores = score_predictions(task, pairs, settings.n_bootstrap)
    return {
        "epoch": [len(run.validation_loss) for run in network],
        **{name: scores[name] for name in SCORES},
    }


def _calibration(task: Task, network: Sequence[Prediction]) -> dict[str, Any]:
    """Calibration of the probabilities of test records, see
    `diagnose.networks.calibration.calibration_scores`.
    """
    labels = task.labels()
    runs = [
        (run.log_probability, labels[run.record], run.temperature) for run in network
    ]
    return calibration_scores(*(list(column) for column in zip(*runs, strict=True)))


def n_cores() -> int:
    """Cores this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def environment() -> dict[str, str]:
    """Versions that a result depends on, and when it was made."""
    import sklearn
    import torch

    return {
        "gensig": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "torch": str(torch.__version__),
        "scikit_learn": str(sklearn.__version__),
        "finished": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }
