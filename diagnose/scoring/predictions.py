"""The table of predictions: answers of each method for records, and ``predictions.csv``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import REFERENCES
from gensig.text.csv_tables import write_rows

if TYPE_CHECKING:
    from diagnose.data.windows import FloatArray, IntArray, Task
    from diagnose.networks.domain import Domain
    from diagnose.scoring.hours import LifeFacts

# Parts of a prediction beside its test records, and further answers.
VALIDATION, WINDOWS = "validation", "windows"
LAST_EPOCH, KNOWN_CLASSES = "last_epoch", "known_classes"

# Columns of the data set that are written with each prediction, if it has them.
CONDITION_COLUMNS = (
    "unit_id",
    "specimen_id",
    "gearbox_id",
    "severity",
    "speed_set_rpm",
    "torque_nm",
    "snr_db",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """Answers for records, or for windows in time order.

    Attributes
    ----------
    record : (row,) index in the data set
    answers : (row, output) as `Prediction.answers`
    """

    record: IntArray
    answers: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Answers of one method, trained with one seed, for the test records of a protocol.

    Attributes
    ----------
    record : (record,) index in the data set, sorted, each once
    answers : (record, output) mean over the windows: log-probabilities of the classes, for ridge
        regression scores that rank in the same order; (record, 1) h of remaining life, cut at the
        early level; (record, 1) a score of novelty
    detail : description of the fit or training
    parts : `VALIDATION` records, unless they are test records too; `REFERENCES` of the validation
        machines, unless a method compares with them; of networks `WINDOWS` of the test records
    further : name -> (record, ...) other answers for the same records: `LAST_EPOCH` of the weights
        of the last epoch, `KNOWN_CLASSES` of a network whose training lacks classes, those of
        `diagnose.training.heads.predict_heads` and `diagnose.training.entries.predict_entries`
    n_followed : answers that are the random label of their record, see
        `diagnose.studies.canaries`; None where no labels were random
    hours : of remaining lives only
    weights, domain, best_epoch : of stored models only
    validation_loss : of networks only
    temperature : of probabilities, as in `diagnose.networks.calibration`
    """

    protocol: str
    method: str
    seed: int
    record: IntArray
    answers: FloatArray
    detail: str
    parts: Mapping[str, Rows] = field(default_factory=dict)
    further: Mapping[str, FloatArray] = field(default_factory=dict)
    n_followed: int | None = None
    hours: LifeFacts | None = None
    weights: dict[str, NDArray[Any]] | None = None
    domain: Domain | None = None
    best_epoch: int = 0
    validation_loss: tuple[float, ...] = ()
    temperature: float = 1.0

    @property
    def held_back(self) -> Rows | None:
        """The validation and the reference records, whose machines are not scored; None of none."""
        names = [name for name in (VALIDATION, REFERENCES) if name in self.parts]
        if not names:
            return None
        parts = [self.parts[name] for name in names]
        return Rows(
            record=np.concatenate([part.record for part in parts]),
            answers=np.concatenate([part.answers for part in parts]),
        )

    @property
    def predicted(self) -> IntArray:
        """(record,) the most probable class."""
        return self.answers.argmax(axis=1)


def hours_of(run: Prediction) -> LifeFacts:
    """Hours of a prediction of remaining lives."""
    assert run.hours is not None
    return run.hours


def by_method(runs: Sequence[Prediction], protocol: str) -> dict[str, list[Prediction]]:
    """Method -> its runs on a protocol."""
    result: dict[str, list[Prediction]] = {}
    for run in runs:
        if run.protocol == protocol:
            result.setdefault(run.method, []).append(run)
    return result


def run_notes(runs: Sequence[Prediction]) -> dict[str, list[Any]]:
    """Seeds and details of the runs of a method."""
    return {
        "seeds": [run.seed for run in runs],
        "detail": [run.detail for run in runs],
    }


def write_predictions(
    path: Path, task: Task, predictions: Sequence[Prediction]
) -> None:
    """Write one row for each prediction of a record.

    It holds protocol, method, seed, record and its condition, true and predicted class, and the
    log-probabilities.
    """
    dataset, labels = task.dataset, task.labels()
    known = [name for name in CONDITION_COLUMNS if name in dataset.column_names]
    columns = {name: np.asarray(dataset.column(name)) for name in ("record_id", *known)}
    with path.open("w", newline="", encoding="utf-8") as file:
        scores = [f"log_probability_{name}" for name in task.class_names]
        head = ["protocol", "method", "seed", *columns, "label", "predicted", *scores]
        write_rows(file, [head])
        for prediction in predictions:
            trained = [prediction.protocol, prediction.method, prediction.seed]
            rows = (prediction.record, prediction.predicted, prediction.answers)
            for record, label, scores in zip(*rows, strict=True):
                row = [
                    *trained,
                    *[column[record] for column in columns.values()],
                    *[task.class_names[labels[record]], task.class_names[label]],
                    *[f"{score:.5g}" for score in scores],
                ]
                write_rows(file, [row])
