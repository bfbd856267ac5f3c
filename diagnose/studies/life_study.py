"""A study of remaining lives: predictions of every method for each snapshot, and their scores."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar, final

import numpy as np

from diagnose.data.lives import (
    Lives,
    choose_life_protocols,
    life_segments,
    lives_of,
)
from diagnose.data.windows import (
    SUBSETS,
    FloatArray,
    IntArray,
    Task,
)
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
from diagnose.studies.jobs import Job, LearningStudy, Plan
from diagnose.studies.life_jobs import (
    AGE_ONLY,
    LifePrediction,
    life_baselines,
    life_networks,
    life_sets,
)
from diagnose.studies.protocol_results import BOOTSTRAP_SEED
from diagnose.studies.result_files import Entry, save_network, write_rows
from diagnose.studies.study import check_network
from diagnose.training.life_facts import LifeFacts
from gensig.errors import ConfigError

REFUSED = ("heads", "sham", "test_channels", "tensorboard")  # settings


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LifeStudy(LearningStudy[LifePrediction]):
    """Hours of remaining life of machines that run to failure."""

    kinds: ClassVar = (LifePrediction, LifeFacts, Domain)

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

    def run_job(self, job: Job) -> list[LifePrediction]:
        """Predictions of the baselines or, with a seed, of networks."""
        task, settings = self.task, self.settings
        sets = life_sets(task, settings, job.protocols[0])
        if job.seed is None:
            return life_baselines(task, settings, sets)
        return life_networks(task, settings, sets, job.seed)

    def progress(self, runs: Sequence[LifePrediction]) -> str:
        """Line on a finished job."""
        methods = ", ".join(run.method for run in runs)
        return f"{runs[-1].protocol}, {methods}, seed {runs[-1].seed}"

    def save(self, folder: Path, run: LifePrediction) -> None:
        """Write a network with the facts of its hours."""
        name, task = f"{run.protocol}-{run.method}", self.task
        save_network(folder, name, task, self.settings, run, remaining_life=run.facts)

    def results(
        self, folder: Path, plan: Plan, runs: Sequence[LifePrediction]
    ) -> Entry:
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


def measured(lives: Lives, runs: Sequence[LifePrediction]) -> dict[str, FloatArray]:
    """Measure -> (run, life) values of the runs of a method, see `life_scores`."""
    rows = [by_life(_scored_snapshots(lives, run)) for run in runs]
    return {measure: np.stack([row[measure] for row in rows]) for measure in rows[0]}


def _scored_snapshots(lives: Lives, prediction: LifePrediction) -> Snapshots:
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
    tables = {name: measured(lives, of_seeds) for name, of_seeds in runs.items()}
    machines = machines_of_lives(task, lives, runs[AGE_ONLY][0].record)
    methods = {}
    for name, of_seeds in runs.items():
        score, better = (
            partial(
                function,
                machines=machines,
                n_bootstrap=settings.n_bootstrap,
                rng=np.random.default_rng(BOOTSTRAP_SEED),
            )
            for function in (life_scores, gain)
        )
        below = [below_bound(lives, run) for run in of_seeds]
        methods[name] = {
            **score(tables[name]),
            "gain_over_age_only_h": better(
                tables[name]["rmse_h"], tables[AGE_ONLY]["rmse_h"]
            ),
            "half_width_h": [run.half_width for run in of_seeds],
            "censored_below_bound": float(np.mean(below)),
            **run_notes(of_seeds),
        }
    parts = {
        subset: life_segments(task, lives, protocol, subset).record
        for subset in SUBSETS
    }
    level = runs[AGE_ONLY][0].early_life
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
    write_rows(path, (row for run in predictions for row in _rows(task, lives, run)))


def _rows(task: Task, lives: Lives, run: LifePrediction) -> Iterator[Entry]:
    ids = np.asarray(task.dataset.column("record_id"))
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
