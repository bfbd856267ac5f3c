"""Answers of each method for each test record, and ``predictions.csv``."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gensig.text.csv_tables import write_rows

if TYPE_CHECKING:
    from diagnose.data.windows import FloatArray, IntArray, Task
    from diagnose.networks.domain import Domain

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
    """Record (row,) and log-probabilities (row, class) of records, or of windows in time order."""

    record: IntArray
    log_probability: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome(ABC):
    """Answers of one method, trained with one seed, for the test records of a protocol.

    Attributes
    ----------
    record : (record,) index in the data set, sorted, each once
    detail : description of the fit or training
    weights, domain, best_epoch : of stored models only
    temperature : of probabilities, as in `diagnose.networks.calibration`
    """

    protocol: str
    method: str
    seed: int
    record: IntArray
    detail: str
    weights: dict[str, NDArray[Any]] | None = None
    domain: Domain | None = None
    best_epoch: int = 0
    temperature: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction(Outcome):
    """Classes of records.

    Attributes
    ----------
    log_probability : (record, class) mean over the windows; for ridge regression a score that
        ranks in the same order
    validation : the same for the validation records; None if they are test records too
    references : the same for the reference records of the validation machines; None without any,
        and of methods that compare with them
    windows : of networks only, for each window of the test records
    validation_loss, last_predicted : of networks only; `last_predicted` (record,) the labels by
        the weights of the last epoch
    heads : of a network that has them, `diagnose.training.heads.predict_heads`
    entries : of a network on teeth, `diagnose.training.entries.predict_entries`
    n_followed : answers that are the random label of their record, see
        `diagnose.studies.canaries`; None where no labels were random
    """

    log_probability: FloatArray
    validation: Rows | None = None
    references: Rows | None = None
    windows: Rows | None = None
    validation_loss: tuple[float, ...] = ()
    last_predicted: IntArray | None = None
    heads: Mapping[str, FloatArray] = field(default_factory=dict)
    entries: Mapping[str, FloatArray] = field(default_factory=dict)
    n_followed: int | None = None

    @property
    def held_back(self) -> Rows | None:
        """The validation and the reference records, whose machines are not scored; None of none."""
        parts = [
            part for part in (self.validation, self.references) if part is not None
        ]
        if not parts:
            return None
        return Rows(
            record=np.concatenate([part.record for part in parts]),
            log_probability=np.concatenate([part.log_probability for part in parts]),
        )

    @property
    def predicted(self) -> IntArray:
        """(record,) the most probable class."""
        return self.log_probability.argmax(axis=1)


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
            rows = (prediction.record, prediction.predicted, prediction.log_probability)
            for record, label, scores in zip(*rows, strict=True):
                row = [
                    *trained,
                    *[column[record] for column in columns.values()],
                    *[task.class_names[labels[record]], task.class_names[label]],
                    *[f"{score:.5g}" for score in scores],
                ]
                write_rows(file, [row])
