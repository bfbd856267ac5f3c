"""Probes: prediction of the class from the row of a record and its position, without its signal.

They must be at chance.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Baseline, Input, MethodText, Parts, Role, Source
from diagnose.baselines.estimators import FittedModel, boosted_trees
from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import FloatArray
from gensig.dataset.columns import COLUMNS
from gensig.dataset.schema import SIGNALS

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

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
# Results that are measured on a machine. All others are known to the simulation only: they are read
# by `ResultProbe` alone.
READ_OFF = ("speed_rpm", "mesh_frequency_hz")


def probed_columns(dataset: Dataset, *, results: bool) -> list[str]:
    """Names of the columns that describe a record without its signal.

    `results` adds those that only the simulation knows.
    """
    return [name for name in dataset.column_names if _is_probed(name, results)]


def _is_probed(name: str, results: bool) -> bool:
    known = COLUMNS.get(name) or SIGNALS.get(name)
    role = known.role if known else "condition"
    if name in EXCLUDED or role in LABELS or name.startswith(FAULT_PARAMETERS):
        return False
    return results or role != "result" or name in READ_OFF


def probe_values(
    dataset: Dataset, n_classes: int, *, results: bool
) -> tuple[FloatArray, tuple[str, ...]]:
    """Values (record, feature) of all records and their names.

    They are the columns, with text as numbers, and the position in the file. All records are of
    one length, which therefore says nothing.
    """
    position = np.arange(dataset.n_records)
    parts: dict[str, NDArray[Any]] = {
        "place": position,
        "place_modulo_classes": position % n_classes,
    }
    if "condition_id" in dataset.column_names:
        condition = np.asarray(dataset.column("condition_id"))
        parts["place_in_condition"] = _count_before(condition)
    for name in probed_columns(dataset, results=results):
        values = np.asarray(dataset.column(name))
        if values.dtype.kind in "US":
            values = np.unique(values, return_inverse=True)[1]
        columns = values.reshape(dataset.n_records, -1).T
        if len(columns) == 1:
            parts[name] = columns[0]
        else:
            parts |= {f"{name}/{k}": column for k, column in enumerate(columns)}
    values = np.stack([part.astype(float) for part in parts.values()], axis=1)
    return values, tuple(parts)


def _count_before(names: NDArray[Any]) -> NDArray[np.integer]:
    """Number of earlier entries that are the same, for each entry."""
    order = np.argsort(names, kind="stable")
    first = np.searchsorted(names[order], names[order], side="left")
    count = np.empty(names.size, dtype=np.int64)
    count[order] = np.arange(names.size) - first
    return count


def _probe_tables(source: Source, *, results: bool) -> Parts:
    """Rows of the records of every subset."""
    task = source.task
    n_classes = len(task.class_names)
    values, names = probe_values(task.dataset, n_classes, results=results)
    labels = task.labels()

    def table(subset: str) -> FeatureTable:
        record = np.unique(source.segments(subset).record)
        return FeatureTable(
            values=values[record], names=names, label=labels[record], record=record
        )

    return Parts.of(table)


METADATA_INPUT = Input(name="metadata", make=partial(_probe_tables, results=False))
RESULT_INPUT = Input(name="results", make=partial(_probe_tables, results=True))


class _Probe(Baseline):
    """Gradient boosting on a table of rows."""

    _model: FittedModel

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Fit to the training rows; there is no choice."""
        self._model = boosted_trees(train, n_classes)
        return f"gradient boosting on {len(self._model.columns)} columns"

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class) of the boosted trees."""
        return self._model.probability(table)


@final
class MetadataProbe(_Probe):
    """Gradient boosting on the rows of the training records."""

    text = MethodText(
        name="metadata_probe",
        label="metadata probe",
        card_label="metadata",
        meaning="gradient boosting on what row and place of a record tell without its signal: set "
        "speed and torque, actual speed, noise, unit, start, order in the file. Above chance: "
        "something leaks.",
    )
    role = Role.AT_CHANCE
    reads = METADATA_INPUT


@final
class ResultProbe(_Probe):
    """The same with results that only the simulation knows, such as the integration error.

    A fault changes the motion and may change these: such a column is no input of a classifier.
    """

    text = MethodText(
        name="result_probe",
        label="result probe",
        card_label=None,
        meaning="the same with what only the simulation knows of a record, such as its integration "
        "error. A fault changes the motion and may so change these: they are no input of a "
        "classifier.",
    )
    role = Role.FOLLOWER
    reads = RESULT_INPUT
