"""A stored network of remaining lives on a data set that runs to failure, its own or another one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.data.at_rate import at_rate
from diagnose.data.lives import Lives, lives_of
from diagnose.data.windows import Segments, Task, task_of
from diagnose.recordings.evaluate import chosen_segments, fitting_channels
from diagnose.scoring.life_scores import MEASURES, by_life, life_scores
from diagnose.studies.life_study import (
    LifePrediction,
    below_bound,
    scored_snapshots,
    write_life_predictions,
)
from diagnose.studies.study import BOOTSTRAP_SEED
from diagnose.training.life_store import LifeFacts
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from diagnose.training.remaining_life import LifeNetwork
    from diagnose.training.store import ModelDescription
    from gensig.dataset.reader import Dataset


def evaluate_life(
    model: LifeNetwork,
    description: ModelDescription,
    facts: LifeFacts,
    dataset: Dataset,
    *,
    protocol: str | None = None,
    subset: str | None = None,
    channels: Sequence[str] | None = None,
) -> tuple[dict[str, Any], LifePrediction, Task, Lives]:
    """Score a network of remaining lives by life, with the level and the intervals of its training.

    Records are chosen as in `diagnose.recordings.evaluate.evaluate_model`, of the classes of the
    training only.

    Parameters
    ----------
    model, description, facts : of `diagnose.training.life_store.load_life_model`
    dataset : open data set
    protocol, subset : part of a split of that data set
    channels : in place of those it was trained on, in their order

    Returns
    -------
    scores as plain dictionary, what was said of each record, and the task and lives that it is about

    Raises
    ------
    DatasetError    if schema version, sampling rate, channels, classes or columns do not fit the network, or no record
        is a snapshot of a life
    ConfigError    for a protocol or subset that does not exist, and a part in which no life failed
    """
    from diagnose.networks.registry import input_of
    from diagnose.training.remaining_life import shares_of_records

    task = _matching_task(description, dataset, channels)
    lives = lives_of(task)
    if missing := [name for name in facts.told if name not in dataset.column_names]:
        raise DatasetError(
            f"{dataset.folder} does not fit the model, which is told {missing[0]}: it has no such column"
        )
    segments, part, shown = chosen_segments(task, description, protocol, subset)
    kept = lives.name[segments.record] != ""
    segments = Segments(record=segments.record[kept], start=segments.start[kept], stop=segments.stop[kept])
    if not lives.failed[segments.record].any():
        raise ConfigError(f"{dataset.folder}, {part}: no life failed, so that there is nothing to score")
    told = np.stack([np.asarray(dataset.column(name), dtype=float) for name in facts.told], axis=1)
    windows = input_of(description.model).load(shown, segments)
    record, share = shares_of_records(model, windows, told)
    prediction = LifePrediction(
        protocol=description.protocol,
        method=facts.method,
        seed=description.seed,
        record=record,
        said=facts.early_life_h * share,
        half_width=facts.half_width_h,
        early_life=facts.early_life_h,
        detail=part,
    )
    values = {name: row[None] for name, row in by_life(scored_snapshots(lives, prediction)).items()}
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    result = {
        "data": str(dataset.folder),
        "part": part,
        "n_records": int(record.size),
        "n_lives": int(np.unique(lives.name[record[lives.failed[record]]]).size),
        "n_lives_censored": int(np.unique(lives.name[record[~lives.failed[record]]]).size),
        "class_names": list(task.class_names),
        "channel_names": list(shown.channel_names),
        "model": str(description.model.get("name", "network")),
        "method": facts.method,
        "trained_on_protocol": description.protocol,
        "seed": description.seed,
        "early_life_h": facts.early_life_h,
        "half_width_h": facts.half_width_h,
        "coverage_wanted": facts.coverage,
        "intervals_hold": facts.intervals_hold,
        "censored_below_bound": below_bound(lives, prediction),
        **life_scores(values, n_bootstrap=description.n_bootstrap, rng=rng),
    }
    return result, prediction, task, lives


def life_lines(result: dict[str, Any]) -> list[str]:
    """What an evaluation found, for people."""
    lines = [
        f"{result['n_records']} records of {result['n_lives']} lives that failed (and {result['n_lives_censored']} "
        f"censored): {result['part']}",
        f"channels {', '.join(result['channel_names'])}; remaining life cut at {result['early_life_h']:.4g} h",
    ]
    for name in MEASURES:
        score = result[name]
        lines.append(f"{name} {score['mean']:.4g}, 95 % interval over lives {score['low']:.4g} to {score['high']:.4g}")
    wanted = f"coverage wanted {result['coverage_wanted']:.0%}"
    return [*lines, wanted if result["intervals_hold"] else f"{wanted}: too few validation lives for such intervals"]


def write_life_evaluation(
    folder: Path, result: dict[str, Any], prediction: LifePrediction, task: Task, lives: Lives
) -> None:
    """Write ``metrics.json``, ``predictions.csv`` and ``remaining_life.png``."""
    from diagnose.report.life_report import life_figure

    (folder / "metrics.json").write_text(json.dumps(result, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    write_life_predictions(folder / "predictions.csv", task, lives, [prediction])
    life_figure(folder / "remaining_life.png", lives, [prediction])


def _matching_task(description: ModelDescription, dataset: Dataset, channels: Sequence[str] | None) -> Task:
    """Task of the classes that the network was trained on and the data set has."""
    wanted = fitting_channels(description, dataset, channels)
    classes = tuple(name for name in description.class_names if name in dataset.class_names)
    if not classes:
        raise DatasetError(
            f"{dataset.folder} does not fit the model: its classes are {', '.join(dataset.class_names)}, the model was "
            f"trained on {', '.join(description.class_names)}"
        )
    return task_of(
        at_rate(dataset, description.sampling_rate_hz),
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        classes=classes,
        channels=wanted,
        one_class=True,
    )
