"""Probes: prediction of the class from the row of a record and its position, without its signal.

Where only what was set is read, they must be at chance.
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
from gensig.dataset.schema import known_column
from gensig.errors import ConfigError

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
# Results that are measured on a machine, which `RotationProbe` reads alone. All results, of which
# the others are known to the simulation only, are read by `ResultProbe`.
ROTATION = ("speed_rpm", "mesh_frequency_hz")
SET_SPEED = "speed_set_rpm"


def probed_columns(dataset: Dataset, *, results: bool) -> list[str]:
    """Names of the columns that describe a record without its signal.

    They are those that were set; `results` adds those that came out.
    """
    return [name for name in dataset.column_names if _is_probed(name, results)]


def _is_probed(name: str, results: bool) -> bool:
    known = known_column(name)
    role = known.role if known else "condition"
    if name in EXCLUDED or role in LABELS or name.startswith(FAULT_PARAMETERS):
        return False
    return results or role != "result"


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


def rotation_values(dataset: Dataset) -> tuple[FloatArray, tuple[str, ...]]:
    """Values (record, feature) of the actual rotation, and their names.

    They are the columns `ROTATION` and the actual speed over the set one.

    Raises
    ------
    ConfigError    for a data set without these columns
    """
    parts = {
        name: np.asarray(dataset.column(name), dtype=float)
        for name in ROTATION
        if name in dataset.column_names
    }
    if not parts:
        raise ConfigError(
            f"the data set has no column {ROTATION[0]}, which the rotation probe reads; "
            "give metadata_probe=false"
        )
    if {ROTATION[0], SET_SPEED} <= set(dataset.column_names):
        set_speed = np.asarray(dataset.column(SET_SPEED), dtype=float)
        parts[f"{ROTATION[0]}/set"] = parts[ROTATION[0]] / set_speed
    return np.stack([*parts.values()], axis=1), tuple(parts)


def _count_before(names: NDArray[Any]) -> NDArray[np.integer]:
    """Number of earlier entries that are the same, for each entry."""
    order = np.argsort(names, kind="stable")
    first = np.searchsorted(names[order], names[order], side="left")
    count = np.empty(names.size, dtype=np.int64)
    count[order] = np.arange(names.size) - first
    return count


def _row_tables(source: Source, *, results: bool) -> Parts:
    """Rows and places of the records of every subset."""
    n_classes = len(source.task.class_names)
    return _tables(
        source, *probe_values(source.task.dataset, n_classes, results=results)
    )


def _rotation_tables(source: Source) -> Parts:
    """Actual rotation of the records of every subset."""
    return _tables(source, *rotation_values(source.task.dataset))


def _tables(source: Source, values: FloatArray, names: tuple[str, ...]) -> Parts:
    """Values (record, feature) of all records, as tables of every subset."""
    labels = source.task.labels()

    def table(subset: str) -> FeatureTable:
        record = np.unique(source.segments(subset).record)
        return FeatureTable(
            values=values[record], names=names, label=labels[record], record=record
        )

    return Parts.of(table)


METADATA_INPUT = Input(name="metadata", make=partial(_row_tables, results=False))
ROTATION_INPUT = Input(name="rotation", make=_rotation_tables)
RESULT_INPUT = Input(name="results", make=partial(_row_tables, results=True))


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
        "speed and torque, noise, machine, start, order in the file. Above chance something leaks.",
    )
    role = Role.AT_CHANCE
    reads = METADATA_INPUT


@final
class RotationProbe(_Probe):
    """The same on the actual rotation alone, which a fault may change."""

    text = MethodText(
        name="rotation_probe",
        label="rotation probe",
        card_label=None,
        meaning="gradient boosting on the actual mean speed and mesh frequency of a record alone. "
        "A fault changes the mean speed a little; a classifier that is given the speed may read "
        "this.",
    )
    role = Role.FOLLOWER
    reads = ROTATION_INPUT


@final
class ResultProbe(_Probe):
    """The metadata probe with all results, such as the actual speed and the integration error.

    A fault changes the motion and may change these: such a column is no input of a classifier.
    """

    text = MethodText(
        name="result_probe",
        label="result probe",
        card_label=None,
        meaning="the metadata probe with all that came out of the simulation of a record, such as "
        "its integration error. A fault changes the motion and may so change these: they are no "
        "input of a classifier.",
    )
    role = Role.FOLLOWER
    reads = RESULT_INPUT
