"""What a record's row and place in the file tell of its class, without its signal: it must be nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.classic import gradient_boosting, judged
from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import Task, subset_segments
from diagnose.scoring.predictions import Prediction
from gensig.dataset.schema import COLUMNS, SIGNALS

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

FloatArray = NDArray[np.floating]
METADATA, RESULTS = "metadata_probe", "result_probe"
# Never probed, and why. By the role that the schema gives a column ...
LABELS = {
    "label": "it is the class",
    "fault": "it describes the fault",
    "age": "it says how far the damage of a life may have come",
}
FAULT_PARAMETERS = "params/fault."
# ... and by name.
EXCLUDED = {
    "record_id": "its number is the place in the file, which is probed as such",
    "status": "records that failed take no part",
    "status_reason": "records that failed take no part",
    "signal_power": "the level of the signal itself, which a fault may change",
    "acceleration_scale": "the peak of the signal itself",
    "acceleration_clean_scale": "the peak of the signal itself",
    "healthy_twin_scale": "the peak of a signal",
}
# Results that a user reads off the machine; all others only the simulation knows, and only `RESULTS` sees them.
READ_OFF = ("speed_rpm", "mesh_frequency_hz")


def probed_columns(dataset: Dataset, *, results: bool) -> list[str]:
    """Names of the columns that tell of a record without its signal; with ``results`` what the simulation adds."""
    return [name for name in dataset.column_names if _is_probed(name, results)]


def _is_probed(name: str, results: bool) -> bool:
    known = COLUMNS.get(name) or SIGNALS.get(name)
    role = "condition" if known is None else known.role
    if name in EXCLUDED or role in LABELS or name.startswith(FAULT_PARAMETERS):
        return False
    return results or role != "result" or name in READ_OFF


def probe_values(dataset: Dataset, n_classes: int, *, results: bool) -> tuple[FloatArray, tuple[str, ...]]:
    """Values (record, feature) of all records and their names: columns, text as numbers, and the place in the file.

    All records are of one length, so that length tells nothing.
    """
    place = np.arange(dataset.n_records)
    parts: dict[str, NDArray] = {"place": place, "place_modulo_classes": place % n_classes}
    if "condition_id" in dataset.column_names:
        parts["place_in_condition"] = _count_before(np.asarray(dataset.column("condition_id")))
    for name in probed_columns(dataset, results=results):
        values = np.asarray(dataset.column(name))
        numbers = np.unique(values, return_inverse=True)[1] if values.dtype.kind in "US" else values
        rows = numbers.reshape(dataset.n_records, -1)
        parts |= {name if rows.shape[1] == 1 else f"{name}/{k}": rows[:, k] for k in range(rows.shape[1])}
    return np.stack([part.astype(float) for part in parts.values()], axis=1), tuple(parts)


def _count_before(names: NDArray) -> NDArray[np.integer]:
    """How many earlier entries are the same, for each entry."""
    order = np.argsort(names, kind="stable")
    first = np.searchsorted(names[order], names[order], side="left")
    count = np.empty(names.size, dtype=np.int64)
    count[order] = np.arange(names.size) - first
    return count


def fit_probe(task: Task, protocol: str, *, results: bool) -> Prediction:
    """Gradient boosting on the rows of the training records, judged on those of the test.

    With ``results`` it also sees what only the simulation knows of a record, such as its integration error. A fault
    changes the motion, and may so change these: such a column is no input of a classifier.
    """
    n_classes = len(task.class_names)
    values, names = probe_values(task.dataset, n_classes, results=results)
    records = [np.unique(subset_segments(task, protocol, subset).record) for subset in ("train", "test")]
    known = np.asarray(np.isfinite(values[records[0]]).any(axis=0))  # the boosting's bins need a value
    train, test = (
        FeatureTable(
            values=values[record][:, known],
            names=tuple(name for name, is_known in zip(names, known, strict=True) if is_known),
            label=task.labels()[record],
            record=record,
        )
        for record in records
    )
    record, log_probability = judged(gradient_boosting(train), test, n_classes)
    return Prediction(
        protocol=protocol,
        method=RESULTS if results else METADATA,
        seed=0,
        record=record,
        log_probability=log_probability,
        detail=f"gradient boosting on {len(train.names)} columns",
    )
