"""A study of remaining lives: predictions of every method for each snapshot, and their scores."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from diagnose.data.lives import (
    Lives,
    choose_life_protocols,
    life_segments,
    lives_of,
)
from diagnose.data.windows import SUBSETS, Task
from diagnose.networks.domain import Domain
from diagnose.scoring.life_scores import (
    UNITS,
    Snapshots,
    by_life,
    gain,
    interval,
    intervals_hold,
    life_scores,
)
from diagnose.scoring.machines import LIVES, Machines, machines_of
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.counts import by_method, n_different, run_notes
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.kept_jobs import kept_jobs
from diagnose.studies.life_jobs import AGE_ONLY, LifePrediction, run_life_job
from diagnose.studies.protocol_results import BOOTSTRAP_SEED
from diagnose.studies.result_files import Entry, save_network, study_facts, write_rows
from diagnose.studies.study import check_network
from diagnose.training.life_store import LifeFacts
from gensig.errors import ConfigError
from gensig.execution.base import read_n_workers

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
OUTCOME_KINDS = (LifePrediction, LifeFacts, Domain)


def check_life_settings(settings: TrainSettings) -> None:
    """Refuse settings that a study of remaining lives would ignore.

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
    parts = [
        life_segments(task, lives, name, subset)
        for name in protocols
        for subset in SUBSETS
    ]
    check_network(task, settings, parts)
    seeds = (None, *settings.seeds)
    jobs = [Job(protocols=(name,), seed=seed) for name in protocols for seed in seeds]
    return LifePlan(protocols=protocols, left_out=left_out, jobs=jobs)


def run_life_study(
    task: Task,
    settings: TrainSettings,
    folder: Path,
    plan: LifePlan,
    *,
    kept_in: Path | None = None,
    on_done: Callable[[str], None] = lambda line: None,
) -> tuple[Entry, list[LifePrediction]]:
    """Content of ``metrics.json``, and the predictions.

    Parameters
    ----------
    folder : exists; receives ``predictions.csv`` and ``models/<protocol>-<method>-seed<k>``
    kept_in : folder of finished jobs, from which a study that was stopped goes on; None keeps none
    on_done : is given one line for each finished job
    """
    started = time.perf_counter()
    predictions: list[LifePrediction] = run_jobs(
        task,
        settings,
        plan.jobs,
        n_workers=read_n_workers(settings.n_threads),
        on_done=lambda runs: on_done(_progress_line(runs)),
        run=run_life_job,
        kept=kept_jobs(task, settings, plan.protocols, kept_in, OUTCOME_KINDS),
    )
    lives = lives_of(task)
    for run in predictions:
        if run.weights is not None and run.facts is not None:
            tensors = dict(run.weights)
            if run.domain is not None:
                tensors |= run.domain.tensors()
            name, facts = f"{run.protocol}-{run.method}", asdict(run.facts)
            save_network(
                folder, name, task, settings, run, tensors, remaining_life=facts
            )
    write_life_predictions(folder / "predictions.csv", task, lives, predictions)
    results = {
        name: _result(task, settings, lives, name, predictions)
        for name in plan.protocols
    }
    metrics = {
        **study_facts(task, settings),
        "task": settings.task,
        "protocols": results,
        "protocols_left_out": plan.left_out,
        "duration_s": round(time.perf_counter() - started, 1),
    }
    return metrics, predictions


def _progress_line(runs: Sequence[LifePrediction]) -> str:
    """Line on a finished job."""
    methods = ", ".join(run.method for run in runs)
    return f"{runs[-1].protocol}, {methods}, seed {runs[-1].seed}"


def scored_snapshots(lives: Lives, prediction: LifePrediction) -> Snapshots:
    """Snapshots of lives that failed; the remaining life of a censored one is not known."""
    chosen = lives.failed[prediction.record]
    record = prediction.record[chosen]
    return Snapshots(
        life=np.unique(lives.name[record], return_inverse=True)[1],
        true=np.minimum(lives.remaining[record], prediction.early_life),
        said=prediction.predicted[chosen],
        half_width=prediction.half_width,
        early_life=prediction.early_life,
    )


def _result(
    task: Task,
    settings: TrainSettings,
    lives: Lives,
    protocol: str,
    predictions: Sequence[LifePrediction],
) -> Entry:
    """Entry of a protocol in ``metrics.json``."""
    runs = by_method(predictions, protocol)
    tables: dict[str, dict[str, FloatArray]] = {}
    for name, of_seeds in runs.items():
        rows = [by_life(scored_snapshots(lives, run)) for run in of_seeds]
        tables[name] = {
            measure: np.stack([row[measure] for row in rows]) for measure in rows[0]
        }
    machines = machines_of_lives(task, lives, runs[AGE_ONLY][0].record)
    n_bootstrap = settings.n_bootstrap
    methods = {}
    for name, of_seeds in runs.items():
        rng = np.random.default_rng(BOOTSTRAP_SEED)
        scores = life_scores(
            tables[name], machines=machines, n_bootstrap=n_bootstrap, rng=rng
        )
        scores["gain_over_age_only_h"] = gain(
            tables[name]["rmse_h"],
            tables[AGE_ONLY]["rmse_h"],
            machines=machines,
            n_bootstrap=n_bootstrap,
            rng=np.random.default_rng(BOOTSTRAP_SEED),
        )
        below = [below_bound(lives, run) for run in of_seeds]
        methods[name] = {
            **scores,
            "half_width_h": [run.half_width for run in of_seeds],
            "censored_below_bound": float(np.mean(below)),
            **run_notes(of_seeds),
        }
    parts = {
        subset: life_segments(task, lives, protocol, subset).record
        for subset in SUBSETS
    }
    level = runs[AGE_ONLY][0].early_life
    counts: dict[str, dict[str, int]] = {
        "n_lives": {},
        "n_lives_censored": {},
        "n_records": {},
        "n_records_unknown": {},
    }
    for subset, record in parts.items():
        counts["n_lives"][subset] = count_lives(lives, record, failed=True)
        counts["n_lives_censored"][subset] = count_lives(lives, record, failed=False)
        counts["n_records"][subset] = int(record.size)
        if subset != "test":
            unknown = ~lives.known(level)[record]
            counts["n_records_unknown"][subset] = int(unknown.sum())
    coverage = settings.remaining_life.coverage
    return {
        "early_life_h": level,
        "phm_unit_h": level / UNITS,
        "coverage_wanted": coverage,
        "intervals_hold": intervals_hold(counts["n_lives"]["validation"], coverage),
        **counts,
        "resampled": machines.counts(),
        "methods": methods,
    }


def machines_of_lives(task: Task, lives: Lives, record: IntArray) -> Machines:
    """Machines of the lives of some records that failed; each life is a unit."""
    scored = record[lives.failed[record]]
    return machines_of(task.dataset, scored, unit=lives.name[scored], kind=LIVES)


def below_bound(lives: Lives, prediction: LifePrediction) -> float:
    """Share of the censored test snapshots predicted below their known remaining life.

    0 where there are none.
    """
    censored = ~lives.failed[prediction.record]
    known = lives.remaining[prediction.record[censored]]
    if not known.size:
        return 0.0
    bound = np.minimum(known, prediction.early_life)
    return float(np.mean(prediction.predicted[censored] < bound))


def count_lives(lives: Lives, record: IntArray, *, failed: bool) -> int:
    """Number of lives of records, of those that failed or of the others."""
    return n_different(lives.name[record[lives.failed[record] == failed]])


def write_life_predictions(
    path: Path,
    task: Task,
    lives: Lives,
    predictions: Sequence[LifePrediction],
) -> None:
    """Write one row a prediction.

    ``scored`` is 0 for a censored life, whose remaining life is a lower bound.
    """
    write_rows(path, _rows(task, lives, predictions))


def _rows(
    task: Task, lives: Lives, predictions: Sequence[LifePrediction]
) -> Iterator[Entry]:
    ids = np.asarray(task.dataset.column("record_id"))
    for run in predictions:
        low, high = interval(run.predicted, run.half_width, run.early_life)
        for row, record in enumerate(run.record.tolist()):
            failed = int(lives.failed[record])
            yield {
                "protocol": run.protocol,
                "method": run.method,
                "seed": run.seed,
                "record_id": ids[record],
                "life_id": lives.name[record],
                "life_time_h": f"{lives.age[record]:.6g}",
                "remaining_life_h": f"{lives.remaining[record]:.6g}",
                "life_failed": failed,
                "early_life_h": f"{run.early_life:.6g}",
                "predicted_h": f"{run.predicted[row]:.6g}",
                "low_h": f"{low[row]:.6g}",
                "high_h": f"{high[row]:.6g}",
                "scored": failed,
            }
