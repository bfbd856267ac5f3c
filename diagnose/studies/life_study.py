"""A study of remaining lives.

What each method says of each snapshot, and the numbers that come of it.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.lives import (
    Lives,
    choose_life_protocols,
    life_segments,
    lives_of,
)
from diagnose.data.windows import SUBSETS, Task
from diagnose.scoring.life_scores import (
    UNITS,
    Snapshots,
    by_life,
    gain,
    interval,
    intervals_hold,
    life_scores,
)
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.life_jobs import AGE_ONLY, LifePrediction, run_life_job
from diagnose.studies.study import (
    BOOTSTRAP_SEED,
    METRICS_SCHEMA_VERSION,
    check_network,
    environment,
    n_cores,
)
from diagnose.training.store import data_fingerprint, model_description, save_model
from gensig.errors import ConfigError

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]


def check_life_settings(settings: TrainSettings) -> None:
    """Refuse what a study of remaining lives does not know, rather than ignore it.

    Raises
    ------
    ConfigError    with the key
    """
    unknown = {
        "heads": bool(settings.heads),
        "sham": settings.sham is not None,
        "test_channels": settings.test_channels is not None,
        "tensorboard": settings.tensorboard,
    }
    for name, given in unknown.items():
        if given:
            raise ConfigError(f"{name} is not for task=remaining_life; leave it out")
    if settings.normalise == BOTH:
        raise ConfigError(
            "normalise=both is not for task=remaining_life; choose none (level kept) or rms",
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LifePlan:
    """Protocols of a study, why others are left out, and the jobs."""

    protocols: tuple[str, ...]
    left_out: dict[str, str]
    jobs: list[Job]


def plan_life_study(task: Task, settings: TrainSettings) -> LifePlan:
    """Plan of a study, after checking that every subset can be used.

    Raises
    ------
    ConfigError    as `diagnose.data.lives.choose_life_protocols`, and for a window or a device
        that cannot be used
    DatasetError    for a data set without lives
    """
    lives = lives_of(task)
    protocols, left_out = choose_life_protocols(task, lives, settings.protocols)
    check_network(
        task,
        settings,
        [
            life_segments(task, lives, name, subset)
            for name in protocols
            for subset in SUBSETS
        ],
    )
    seeds = (None, *settings.seeds)
    jobs = [Job(protocols=(name,), seed=seed) for name in protocols for seed in seeds]
    return LifePlan(protocols=protocols, left_out=left_out, jobs=jobs)


def run_life_study(
    task: Task,
    settings: TrainSettings,
    folder: Path,
    plan: LifePlan,
    *,
    on_done: Callable[[str], None] = lambda line: None,
) -> tuple[dict[str, Any], list[LifePrediction]]:
    """Content of ``metrics.json``, and the predictions.

    Parameters
    ----------
    folder : exists; receives ``predictions.csv`` and ``models/<protocol>-<method>-seed<k>``
    on_done : is given one line for each finished piece
    """
    started = time.perf_counter()

    def report(found: list[LifePrediction]) -> None:
        on_done(
            f"{found[-1].protocol}, {', '.join(one.method for one in found)}, seed {found[-1].seed}"
        )

    n_workers = settings.n_threads or n_cores()
    predictions: list[LifePrediction] = run_jobs(
        task,
        settings,
        plan.jobs,
        n_workers=n_workers,
        on_done=report,
        run=run_life_job,
    )
    lives = lives_of(task)
    for one in predictions:
        if one.weights is not None and one.facts is not None:
            target = folder / "models" / f"{one.protocol}-{one.method}-seed{one.seed}"
            known = {} if one.domain is None else one.domain.tensors()
            described = model_description(task, settings, one)
            described = replace(described, remaining_life=asdict(one.facts))
            save_model(target, one.weights | known, described)
    write_life_predictions(folder / "predictions.csv", task, lives, predictions)
    metrics = {
        "metrics_schema_version": METRICS_SCHEMA_VERSION,
        "task": settings.task,
        "data": str(task.dataset.folder),
        "data_fingerprint": data_fingerprint(task.dataset),
        "n_records": int(task.dataset.n_records),
        "sampling_rate_hz": float(task.dataset.sampling_rate),
        "channel_names": list(task.channel_names),
        "model": str(settings.model.get("name", "network")),
        "settings": {**asdict(settings), "model": dict(settings.model)},
        "protocols": {
            name: _result(task, settings, lives, name, predictions)
            for name in plan.protocols
        },
        "protocols_left_out": plan.left_out,
        "duration_s": round(time.perf_counter() - started, 1),
        "environment": environment(),
    }
    return metrics, predictions


def scored_snapshots(lives: Lives, prediction: LifePrediction) -> Snapshots:
    """The snapshots of lives that failed.

    How long a censored one would have run on is not known.
    """
    chosen = lives.failed[prediction.record]
    record = prediction.record[chosen]
    return Snapshots(
        life=np.unique(lives.name[record], return_inverse=True)[1],
        true=np.minimum(lives.remaining[record], prediction.early_life),
        said=prediction.said[chosen],
        half_width=prediction.half_width,
        early_life=prediction.early_life,
    )


def _result(
    task: Task,
    settings: TrainSettings,
    lives: Lives,
    protocol: str,
    predictions: Sequence[LifePrediction],
) -> dict[str, Any]:
    mine = [one for one in predictions if one.protocol == protocol]
    runs = {
        name: [one for one in mine if one.method == name]
        for name in dict.fromkeys(one.method for one in mine)
    }
    tables: dict[str, dict[str, FloatArray]] = {}
    for name, of_seeds in runs.items():
        rows = [by_life(scored_snapshots(lives, one)) for one in of_seeds]
        tables[name] = {
            measure: np.stack([row[measure] for row in rows]) for measure in rows[0]
        }
    methods = {}
    for name, of_seeds in runs.items():
        rng = np.random.default_rng(BOOTSTRAP_SEED)
        methods[name] = {
            **life_scores(tables[name], n_bootstrap=settings.n_bootstrap, rng=rng),
            "gain_over_age_only_h": gain(
                tables[name]["rmse_h"],
                tables[AGE_ONLY]["rmse_h"],
                n_bootstrap=settings.n_bootstrap,
                rng=np.random.default_rng(BOOTSTRAP_SEED),
            ),
            "half_width_h": [one.half_width for one in of_seeds],
            "censored_below_bound": float(
                np.mean([below_bound(lives, one) for one in of_seeds])
            ),
            "seeds": [one.seed for one in of_seeds],
            "detail": [one.detail for one in of_seeds],
        }
    parts = {
        subset: life_segments(task, lives, protocol, subset).record
        for subset in SUBSETS
    }
    level = mine[0].early_life
    n_calibration = np.unique(
        lives.name[parts["validation"][lives.failed[parts["validation"]]]],
    ).size
    return {
        "early_life_h": level,
        "phm_unit_h": level / UNITS,
        "coverage_wanted": settings.remaining_life.coverage,
        "intervals_hold": intervals_hold(
            n_calibration, settings.remaining_life.coverage
        ),
        "n_lives": {
            subset: count_lives(lives, record, failed=True)
            for subset, record in parts.items()
        },
        "n_lives_censored": {
            subset: count_lives(lives, record, failed=False)
            for subset, record in parts.items()
        },
        "n_records": {subset: int(record.size) for subset, record in parts.items()},
        "n_records_unknown": {
            subset: int((~lives.known(level)[record]).sum())
            for subset, record in parts.items()
            if subset != "test"
        },
        "methods": methods,
    }


def below_bound(lives: Lives, prediction: LifePrediction) -> float:
    """Share of the censored test snapshots of which less is said than they have run on.

    0 where there are none.
    """
    censored = ~lives.failed[prediction.record]
    bound = np.minimum(lives.remaining[prediction.record], prediction.early_life)[
        censored
    ]
    return float(np.mean(prediction.said[censored] < bound)) if bound.size else 0.0


def count_lives(lives: Lives, record: IntArray, *, failed: bool) -> int:
    """Number of lives of records, of those that failed or of the others."""
    return int(np.unique(lives.name[record[lives.failed[record] == failed]]).size)


def write_life_predictions(
    path: Path,
    task: Task,
    lives: Lives,
    predictions: Sequence[LifePrediction],
) -> None:
    """Write one row a prediction.

    ``scored`` is 0 for a censored life, whose remaining life is a lower bound.
    """
    ids = np.asarray(task.dataset.column("record_id"))
    head = [
        "protocol",
        "method",
        "seed",
        "record_id",
        "life_id",
        "life_time_h",
        "remaining_life_h",
        "life_failed",
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            [*head, "early_life_h", "predicted_h", "low_h", "high_h", "scored"]
        )
        for one in predictions:
            low, high = interval(one.said, one.half_width, one.early_life)
            for row, record in enumerate(one.record.tolist()):
                failed = int(lives.failed[record])
                writer.writerow(
                    [
                        one.protocol,
                        one.method,
                        one.seed,
                        ids[record],
                        lives.name[record],
                    ]
                    + [
                        f"{lives.age[record]:.6g}",
                        f"{lives.remaining[record]:.6g}",
                        failed,
                    ]
                    + [
                        f"{value:.6g}"
                        for value in (
                            one.early_life,
                            one.said[row],
                            low[row],
                            high[row],
                        )
                    ]
                    + [failed]
                )
