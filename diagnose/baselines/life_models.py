"""Baselines of remaining lives: the age alone, and regression on condition indicators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.estimators import BOOSTING, known_columns, scaled
from diagnose.baselines.features import Cache, feature_table
from diagnose.data.lives import Lives, balanced_weights
from diagnose.data.windows import FloatArray, IntArray, Segments, Task

OPERATING = (
    "speed_rpm",
    "torque_nm",
)  # measured at the machine, if the data set has them
PENALTIES = (1.0, 10.0, 100.0, 1000.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Inputs (record, column) of records, one row each, with their record."""

    values: FloatArray
    record: IntArray


def operating_names(task: Task) -> tuple[str, ...]:
    """Those of `OPERATING` that the data set has."""
    return tuple(name for name in OPERATING if name in task.dataset.column_names)


def operating_values(task: Task, record: IntArray) -> FloatArray:
    """(record, column) of `OPERATING`."""
    columns = [
        np.asarray(task.dataset.column(name), dtype=float)[record]
        for name in operating_names(task)
    ]
    return np.reshape(columns, (len(columns), record.size)).T


def indicator_table(
    task: Task, lives: Lives, segments: Segments, *, features: str, cache: Cache
) -> Table:
    """Indicators, their change since the first snapshot of the life, and operating condition.

    A machine is monitored from its first day, and machines differ: the change says more than the
    level. The first snapshot is the earliest of the life in the subset, so that nothing of the
    future is used.
    """
    record = segments.record
    indicators = feature_table(task, segments, features=features, cache=cache).values
    first = np.empty(record.size, dtype=np.int64)
    name, age = lives.name[record], lives.age[record]
    for life in np.unique(name):
        of_life = np.flatnonzero(name == life)
        first[of_life] = of_life[np.argmin(age[of_life])]
    change = indicators - indicators[first]
    operating = operating_values(task, record)
    values = np.concatenate([indicators, change, operating], axis=1)
    return Table(values=values, record=record)


def age_table(lives: Lives, segments: Segments) -> Table:
    """The age alone."""
    return Table(values=lives.age[segments.record][:, None], record=segments.record)


def with_age(table: Table, lives: Lives) -> Table:
    """A table with the age as one more column."""
    age = lives.age[table.record][:, None]
    values = np.concatenate([table.values, age], axis=1)
    return Table(values=values, record=table.record)


def constant_regression(target: FloatArray, name: NDArray[Any]) -> float:
    """Mean of (record,) targets in which every life counts the same: the constant prediction."""
    return float(np.average(target, weights=balanced_weights(name)))


def fit_regression(
    train: Table, validation: Table, lives: Lives, target: FloatArray
) -> tuple[str, Callable[[Table], FloatArray]]:
    """Ridge regression or gradient boosting, by the squared error on the validation lives.

    Parameters
    ----------
    train, validation : tables of the same columns, of records whose target is known
    lives : of the data set; every life counts the same
    target : (record,) of all records of the data set

    Returns
    -------
    name of the chosen model, and a function that predicts (record,) targets of a table
    """
    known = known_columns(train.values)
    weight, held_out = (
        balanced_weights(lives.name[table.record]) for table in (train, validation)
    )
    scored = []
    for name, (model, weight_key) in _candidates().items():
        weights = {weight_key: weight}
        model.fit(train.values[:, known], target[train.record], **weights)
        error = model.predict(validation.values[:, known]) - target[validation.record]
        scored.append((float(np.average(error**2, weights=held_out)), name, model))
    _, name, best = min(scored, key=lambda row: row[0])

    def predict(table: Table) -> FloatArray:
        return np.asarray(best.predict(table.values[:, known]), dtype=float)

    return name, predict


def _candidates() -> dict[str, tuple[Any, str]]:
    """Name -> untrained model and its argument for weights; the first wins ties."""
    from sklearn.ensemble import HistGradientBoostingRegressor
    from sklearn.linear_model import Ridge

    candidates: dict[str, tuple[Any, str]] = {
        f"ridge, penalty {penalty:g}": (
            scaled(Ridge(alpha=penalty)),
            "ridge__sample_weight",
        )
        for penalty in PENALTIES
    }
    boosting = HistGradientBoostingRegressor(
        max_iter=100, max_leaf_nodes=8, learning_rate=0.1, random_state=0
    )
    return candidates | {BOOSTING: (boosting, "sample_weight")}
