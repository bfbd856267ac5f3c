"""What each method said of each test record, of which every score is made.

``predictions.csv`` for other programs.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from diagnose.data.windows import Task
    from diagnose.networks.adaptation import Statistics
    from diagnose.networks.domain import Domain

# Columns of the data set beside each prediction, as far as it has them.
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
    """What a method says of records, or of windows in time order.

    Record (row,) and log-probabilities (row, class).
    """

    record: NDArray[np.integer]
    log_probability: NDArray[np.floating]


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Test records of a protocol with what one method, trained with one seed, says of them.

    Attributes
    ----------
    record : (record,) place in the data set, sorted, each once
    log_probability : (record, class) mean over the windows; of ridge regression a score that ranks alike
    detail : what was fitted or trained, in words
    validation : the same for the validation records; None where they are test records too
    windows : of networks only, for each window of the test records
    weights, domain, healthy, best_epoch, validation_loss, temperature, last_predicted : of networks only;
        `temperature` as in `diagnose.networks.calibration`, `last_predicted` (record,) the labels
        that the weights of the last epoch give
    heads : of a network that has them, `diagnose.training.heads.predict_heads`
    """

    protocol: str
    method: str
    seed: int
    record: NDArray[np.integer]
    log_probability: NDArray[np.floating]
    detail: str
    validation: Rows | None = None
    windows: Rows | None = None
    weights: dict[str, NDArray[Any]] | None = None
    domain: Domain | None = None
    healthy: Statistics | None = None
    best_epoch: int = 0
    validation_loss: tuple[float, ...] = ()
    temperature: float = 1.0
    last_predicted: NDArray[np.integer] | None = None
    heads: Mapping[str, NDArray[np.floating]] = field(default_factory=dict)

    @property
    def predicted(self) -> NDArray[np.integer]:
        """(record,) the most probable class."""
        return self.log_probability.argmax(axis=1)


def write_predictions(
    path: Path, task: Task, predictions: Sequence[Prediction]
) -> None:
    """Write one row a prediction.

    Protocol, method, seed, record, its true class and condition, log-probabilities.
    """
    dataset, labels = task.dataset, task.labels()
    known = [name for name in CONDITION_COLUMNS if name in dataset.column_names]
    columns = {name: np.asarray(dataset.column(name)) for name in ("record_id", *known)}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ["protocol", "method", "seed", *columns, "label", "predicted"]
            + [f"log_probability_{name}" for name in task.class_names]
        )
        for prediction in predictions:
            for record, guess, scores in zip(
                prediction.record,
                prediction.predicted,
                prediction.log_probability,
                strict=True,
            ):
                writer.writerow(
                    [prediction.protocol, prediction.method, prediction.seed]
                    + [column[record] for column in columns.values()]
                    + [task.class_names[labels[record]], task.class_names[guess]]
                    + [f"{score:.5g}" for score in scores]
                )
