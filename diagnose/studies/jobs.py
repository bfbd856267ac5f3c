"""Studies of learning targets, and their jobs: same results for any number and order of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from diagnose.data.windows import Task
from diagnose.scoring.predictions import Prediction
from diagnose.settings import TrainSettings
from diagnose.studies.kept_jobs import KeptJobs, keep_outcomes, kept_outcomes
from diagnose.studies.result_files import Entry
from diagnose.workers import call_all

Made = TypeVar("Made")


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One training, or the baselines of all the protocols where the seed is None.

    One of `OPEN_PROTOCOLS` is a job by itself: with seed None the scores that are fitted, else
    those of a network.

    Attributes
    ----------
    shuffled : training with shuffled labels, without early stopping, which would end it in its
        first epochs, before the network could show a leak
    sham : on the sham data set
    control : "" or one of the controls, which replaces the training or the baselines
    """

    protocols: tuple[str, ...]
    seed: int | None
    shuffled: bool = False
    sham: bool = False
    control: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Protocols of a study, its jobs, and the reasons why protocols and baselines are left out."""

    protocols: tuple[str, ...]
    jobs: list[Job]
    left_out: dict[str, str]
    baselines_left_out: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class LearningStudy(ABC):
    """Study of a learning target, for `diagnose.studies.study.run_study`."""

    task: Task
    settings: TrainSettings

    @staticmethod
    @abstractmethod
    def check(settings: TrainSettings) -> None:
        """Refuse settings that the study would ignore.

        Raises
        ------
        ConfigError    with the key
        """

    @abstractmethod
    def plan(self) -> Plan:
        """Plan of the study, after checking that every subset can be used.

        Raises
        ------
        ConfigError    for a protocol, a window or a device that cannot be used
        DatasetError    for a data set without what is to be learnt
        """

    @abstractmethod
    def run_job(self, job: Job) -> list[Prediction]:
        """Outcomes on the test part of each of a job's protocols."""

    @abstractmethod
    def progress(self, runs: Sequence[Prediction]) -> str:
        """Line on a finished job."""

    @abstractmethod
    def save(self, folder: Path, run: Prediction) -> None:
        """Write the model of an outcome below a folder."""

    @abstractmethod
    def results(self, folder: Path, plan: Plan, runs: Sequence[Prediction]) -> Entry:
        """Write what was predicted into a folder, and return the scores of ``metrics.json``."""


def run_jobs(
    study: LearningStudy,
    jobs: Sequence[Job],
    *,
    n_workers: int,
    on_done: Callable[[list[Prediction]], None],
    kept: KeptJobs | None = None,
) -> list[Prediction]:
    """Outcomes of all jobs in the order of the jobs.

    Parameters
    ----------
    kept : has the outcomes of jobs that are finished, and gets those of the others

    Raises
    ------
    GensigError    as raised by a job, or if a worker was killed
    """
    done = {}
    if kept is not None:
        found = {job: kept_outcomes(kept, job) for job in jobs}
        done = {job: each for job, each in found.items() if each is not None}
    for outcomes in done.values():
        on_done(outcomes)
    missing = [job for job in jobs if job not in done]
    try:
        results = call_all(
            _run_and_keep,
            (study, kept),
            missing,
            n_workers=n_workers,
            on_done=lambda _, outcomes: on_done(outcomes),
            remedy="set n_threads=1 or use fewer records",
        )
    finally:
        _held.clear()
    done |= dict(zip(missing, results, strict=True))
    return [outcome for job in jobs for outcome in done[job]]


def _run_and_keep(
    study: LearningStudy, kept: KeptJobs | None, job: Job
) -> list[Prediction]:
    outcomes = study.run_job(job)
    return outcomes if kept is None else keep_outcomes(kept, job, outcomes)


_held: dict[str, tuple[Any, Any]] = {}  # by a process, until its study is done


def once(kind: str, key: Any, make: Callable[[], Made]) -> Made:
    """Value that jobs of a process share; one of each kind is held, that of the last key.

    Jobs come protocol by protocol.
    """
    if kind not in _held or _held[kind][0] != key:
        _held.pop(kind, None)
        _held[kind] = key, make()
    made: Made = _held[kind][1]
    return made
