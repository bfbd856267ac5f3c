"""A study of remaining lives: predictions of every method for each snapshot, and their scores."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from diagnose.data.lives import (
    Lives,
    choose_life_protocols,
    life_segments,
    lives_of,
)
from diagnose.data.windows import SUBSETS, IntArray, Task
from diagnose.scoring.hours import interval, intervals_hold
from diagnose.scoring.judged import BOOTSTRAP_SEED, Judged
from diagnose.scoring.life_scores import UNITS, by_life, gain, life_scores
from diagnose.scoring.machines import LIVES, machines_of
from diagnose.scoring.predictions import Prediction, by_method, hours_of, run_notes
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.counts import n_different
from diagnose.studies.jobs import Job, LearningStudy, Plan
from diagnose.studies.life_jobs import (
    AGE_ONLY,
    life_baselines,
    life_networks,
    life_sets,
)
from diagnose.studies.result_files import Entry, save_network, write_rows
from diagnose.studies.study import check_network
from gensig.errors import ConfigError

REFUSED = ("heads", "sham", "test_channels", "tensorboard")  # settings


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LifeStudy(LearningStudy):
    """Hours of remaining life of machines that run to failure."""

    @staticmethod
    def check(settings: TrainSettings) -> None:
        """Refuse settings of classes."""
        for name in REFUSED:
            if getattr(settings, name):
                raise ConfigError(
                    f"{name} is not for task={settings.task}; leave it out"
                )
        if settings.normalise == BOTH:
            raise ConfigError(
                f"normalise={BOTH} is not for task={settings.task}; "
                "choose none (level kept) or rms",
            )

    def plan(self) -> Plan:
        """Plan of a study, after checking that every subset can be used."""
        task, settings = self.task, self.settings
        lives = lives_of(task)
        protocols, left_out = choose_life_protocols(task, lives, settings.protocols)
        parts = [
            life_segments(task, lives, name, subset)
            for name in protocols
            for subset in SUBSETS
        ]
        check_network(task, settings, parts)
        seeds = (None, *settings.seeds)
        jobs = [
            Job(protocols=(name,), seed=seed) for name in protocols for seed in seeds
        ]
        return Plan(protocols=protocols, jobs=jobs, left_out=left_out)

    def run_job(self, job: Job) -> list[Prediction]:
        """Predictions of the baselines or, with a seed, of networks."""
        task, settings = self.task, self.settings
        sets = life_sets(task, settings, job.protocols[0])
        if job.seed is None:
            return life_baselines(task, settings, sets)
        return life_networks(task, settings, sets, job.seed)

    def progress(self, runs: Sequence[Prediction]) -> str:
        """Line on a finished job."""
        methods = ", ".join(run.method for run in runs)
        return f"{runs[-1].protocol}, {methods}, seed {runs[-1].seed}"

    def save(self, folder: Path, run: Prediction) -> None:
        """Write a network with the facts of its hours."""
        name, task = f"{run.protocol}-{run.method}", self.task
        save_network(folder, name, task, self.settings, run)

    def results(self, folder: Path, plan: Plan, runs: Sequence[Prediction]) -> Entry:
        """Write the predictions, and return the results of all protocols."""
        task, settings = self.task, self.settings
        lives = lives_of(task)
        write_life_predictions(folder / "predictions.csv", task, lives, runs)
        return {
            "task": settings.task,
            "protocols": {
                name: _result(task, settings, lives, name, runs)
                for name in plan.protocols
            },
            "protocols_left_out": plan.left_out,
        }


def judged_lives(task: Task, lives: Lives, runs: Sequence[Prediction]) -> Judged:
    """Snapshots of lives that failed, each life a unit; of a censored one the rest is not known."""
    chosen = lives.failed[runs[0].record]
    record = runs[0].record[chosen]
    life = lives.name[record]
    level = hours_of(runs[0]).early_life_h
    return Judged(
        method=runs[0].method,
        truth=np.minimum(lives.remaining[record], level),
        unit=np.unique(life, return_inverse=True)[1],
        machines=machines_of(task.dataset, record, unit=life, kind=LIVES),
        answers=np.stack([run.answers[chosen] for run in runs]),
    )


def _result(
    task: Task,
    settings: TrainSettings,
    lives: Lives,
    protocol: str,
    predictions: Sequence[Prediction],
) -> Entry:
    """Entry of a protocol in ``metrics.json``."""
    runs = by_method(predictions, protocol)
    judged = {name: judged_lives(task, lives, mine) for name, mine in runs.items()}
    tables = {
        name: by_life(judged[name], [hours_of(run) for run in mine])
        for name, mine in runs.items()
    }
    machines = judged[AGE_ONLY].machines
    methods = {}

    def resampling() -> dict[str, Any]:
        rng = np.random.default_rng(BOOTSTRAP_SEED)
        return {"machines": machines, "n_bootstrap": settings.n_bootstrap, "rng": rng}

    for name, of_seeds in runs.items():
        errors = (tables[name]["rmse_h"], tables[AGE_ONLY]["rmse_h"])
        below = [below_bound(lives, run) for run in of_seeds]
        methods[name] = {
            **life_scores(tables[name], **resampling()),
            "gain_over_age_only_h": gain(*errors, **resampling()),
            "half_width_h": [hours_of(run).half_width_h for run in of_seeds],
            "censored_below_bound": float(np.mean(below)),
            **run_notes(of_seeds),
        }
    parts = {
        subset: life_segments(task, lives, protocol, subset).record
        for subset in SUBSETS
    }
    level = hours_of(runs[AGE_ONLY][0]).early_life_h
    n_lives, n_censored = (
        {
            subset: count_lives(lives, record, failed=failed)
            for subset, record in parts.items()
        }
        for failed in (True, False)
    )
    unknown = ~lives.known(level)
    coverage = settings.remaining_life.coverage
    return {
        "early_life_h": level,
        "phm_unit_h": level / UNITS,
        "coverage_wanted": coverage,
        "intervals_hold": intervals_hold(n_lives["validation"], coverage),
        "n_lives": n_lives,
        "n_lives_censored": n_censored,
        "n_records": {subset: int(record.size) for subset, record in parts.items()},
        "n_records_unknown": {
            subset: int(unknown[parts[subset]].sum()) for subset in SUBSETS[:2]
        },
        "resampled": machines.counts(),
        "methods": methods,
    }


def below_bound(lives: Lives, prediction: Prediction) -> float:
    """Share of the censored test snapshots predicted below their known remaining life.

    0 where there are none.
    """
    censored = ~lives.failed[prediction.record]
    known = lives.remaining[prediction.record[censored]]
    if not known.size:
        return 0.0
    bound = np.minimum(known, hours_of(prediction).early_life_h)
    return float(np.mean(prediction.answers[censored, 0] < bound))


def count_lives(lives: Lives, record: IntArray, *, failed: bool) -> int:
    """Number of lives of records, of those that failed or of the others."""
    return n_different(lives.name[record[lives.failed[record] == failed]])


def write_life_predictions(
    path: Path,
    task: Task,
    lives: Lives,
    predictions: Sequence[Prediction],
) -> None:
    """Write one row a prediction.

    ``scored`` is 0 for a censored life, whose remaining life is a lower bound.
    """
    write_rows(path, (row for run in predictions for row in _rows(task, lives, run)))


def _rows(task: Task, lives: Lives, run: Prediction) -> Iterator[Entry]:
    ids = np.asarray(task.dataset.column("record_id"))
    said, hours = run.answers[:, 0], hours_of(run)
    low, high = interval(said, hours.half_width_h, hours.early_life_h)
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
            "early_life_h": f"{hours.early_life_h:.6g}",
            "predicted_h": f"{said[row]:.6g}",
            "low_h": f"{low[row]:.6g}",
            "high_h": f"{high[row]:.6g}",
            "scored": failed,
        }
