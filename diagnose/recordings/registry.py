"""Learning targets: each has its study and report, and stored networks that answer in its way.

One network comes with gensig: that for any pair of gears.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from diagnose.data.lives import lives_of
from diagnose.data.windows import Task
from diagnose.recordings.accused import found_fault_pictures
from diagnose.recordings.stored_classifier import StoredClassifier
from diagnose.recordings.stored_life import StoredLife
from diagnose.recordings.stored_network import StoredNetwork
from diagnose.report.base import Report
from diagnose.report.life_report import LifeReport
from diagnose.report.page import ClassReport
from diagnose.scoring.predictions import Prediction
from diagnose.studies.class_study import ClassStudy
from diagnose.studies.jobs import LearningStudy
from diagnose.studies.life_study import LifeStudy
from diagnose.studies.result_files import Content
from diagnose.training.store import read_description


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Learning target of ``diagnose train``.

    Attributes
    ----------
    study : plans and runs its jobs
    report : report on a task's ``metrics.json`` and outcomes, in a folder with its models
    stored : kind of its networks, as they are stored
    """

    study: type[LearningStudy]
    report: Callable[[Path, Task, Content, Sequence[Prediction]], Report]
    stored: type[StoredNetwork]


# Task of the training, see `diagnose.settings.TASKS` -> what is learnt.
TARGETS = {
    "classes": Target(
        study=ClassStudy,
        report=lambda folder, task, metrics, _: ClassReport(
            metrics=metrics, pictures=found_fault_pictures(folder, task, metrics)
        ),
        stored=StoredClassifier,
    ),
    "remaining_life": Target(
        study=LifeStudy,
        report=lambda _, task, metrics, runs: LifeReport(
            metrics=metrics, lives=lives_of(task), predictions=runs
        ),
        stored=StoredLife,
    ),
}


def shipped_network() -> Path:
    """Folder of the network for any pair of gears, which comes with gensig."""
    return Path(str(files("diagnose"))) / "shipped" / "any_pair"


def open_network(folder: str | Path) -> StoredNetwork:
    """Network of a folder that ``diagnose train`` wrote.

    Raises
    ------
    DatasetError    for a folder without description and weights that belong together
    """
    return TARGETS[read_description(folder).task].stored.load(folder)
