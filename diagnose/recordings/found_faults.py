"""Pictures of test records of a study: a found fault of each class, and a wrong answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from diagnose.data.turns import Turns
from diagnose.data.windows import HEALTHY, subset_segments
from diagnose.networks.network import SiteNetwork
from diagnose.recordings.accused import accused_of_turns
from diagnose.recordings.stored_classifier import StoredClassifier
from diagnose.report.headlines import headline_protocol
from diagnose.report.tooth_figure import tooth_figure
from diagnose.studies.result_files import Content
from gensig.text.csv_tables import read_records

if TYPE_CHECKING:
    from diagnose.data.windows import Task

MOST_PICTURES = 5
PREDICTIONS = "predictions.csv"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answered:
    """Answer of a network for a test record: identity, true class and predicted class."""

    record_id: str
    truth: str
    answer: str

    @property
    def caption(self) -> str:
        """Record, truth and answer in words."""
        return f"record {self.record_id}, truth {self.truth}, answer {self.answer}"


def found_fault_pictures(
    folder: Path, task: Task, metrics: Content
) -> list[tuple[str, str]]:
    """Write the accused tooth of chosen test records as PNG files.

    Parameters
    ----------
    folder : of a finished study, with its models and predictions
    task : of the study
    metrics : content of its ``metrics.json``; the protocol of the headlines is shown

    Returns
    -------
    (file, caption) of each picture; none for a network that scores no teeth
    """
    protocol, network = headline_protocol(metrics), metrics["model"]
    models = sorted(folder.glob(f"models/{protocol}-seed*"))
    if protocol is None or not models:
        return []
    model_folder = models[0]
    stored = StoredClassifier.load(model_folder)
    inputs = stored.inputs()
    if not (isinstance(stored.model, SiteNetwork) and isinstance(inputs, Turns)):
        return []
    seed = model_folder.name.rpartition("-seed")[2]
    answered = _answers(folder / PREDICTIONS, (protocol, network, seed))
    part = task.part(protocol, "test")
    segments = subset_segments(task, protocol, "test")
    ids = np.asarray(task.dataset.column("record_id"))[segments.record].astype(str)
    pictures = []
    for number, answer in enumerate(shown(answered), start=1):
        stretch = np.flatnonzero(ids == answer.record_id)[:1]
        windows = inputs.load(part, segments.of(stretch))
        accused = accused_of_turns(stored, windows, part.channel_names)
        picture = f"tooth_{number}_{answer.truth}.png"
        caption = f"{answer.caption}; {accused.gear}, tooth {accused.tooth}"
        tooth_figure(folder / picture, accused, caption)
        pictures.append((picture, caption))
    return pictures


def shown(answered: Sequence[Answered]) -> list[Answered]:
    """The first found fault of each class, and the first wrong answer; `MOST_PICTURES` at most."""
    right = [one for one in answered if one.truth == one.answer]
    wrong = [one for one in answered if one.truth != one.answer][:1]
    found: dict[str, Answered] = {}
    for answer in right:
        if answer.truth != HEALTHY:
            found.setdefault(answer.truth, answer)
    return [*list(found.values())[: MOST_PICTURES - len(wrong)], *wrong]


def _answers(path: Path, trained: tuple[str, str, str]) -> list[Answered]:
    """Answers of one training, in the order of the records."""
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Answered(
                record_id=row["record_id"],
                truth=row["label"],
                answer=row["predicted"],
            )
            for row in read_records(file)
            if (row["protocol"], row["method"], row["seed"]) == trained
        ]
