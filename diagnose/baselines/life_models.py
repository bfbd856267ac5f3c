"""What a network must beat on remaining lives.

The clock alone, and regression on condition indicators.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import Cache, feature_table
from diagnose.data.lives import Lives, balanced_weights
from diagnose.data.windows import Segments, Task

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
OPERATING = (
    "speed_rpm",
    "torque_nm",
)  # read off the machine, as far as the data set has them
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
    return np.stack(columns, axis=1) if columns else np.zeros((record.size, 0))


def indicator_table(
    task: Task, lives: Lives, segments: Segments, *, features: str, cache: Cache
) -> Table:
    """Indicators of each snapshot, their change since the first snapshot of the life, and the
    operating condition.

    A machine is watched from its first day, and machines differ: the change tells more than the
    level. The first snapshot is the earliest of the life in the subset, so that nothing of the
    future is used.
    """
    table = feature_table(task, segments, features=features, cache=cache)
    first = np.empty(segments.record.size, dtype=np.int64)
    name, age = lives.name[segments.record], lives.age[segments.record]
    for life in np.unique(name):
        mine = np.flatnonzero(name == life)
        first[mine] = mine[np.argmin(age[mine])]
    change = table.values - table.values[first]
    operating = operating_values(task, segments.record)
    return Table(
        values=np.concatenate([table.values, change, operating], axis=1),
        record=segments.record,
    )


def age_table(lives: Lives, segments: Segments) -> Table:
    """The age alone."""
    return Table(values=lives.age[segments.record][:, None], record=segments.record)


def with_age(table: Table, lives: Lives) -> Table:
    """A table with the age as one more column."""
    return Table(
        values=np.concatenate([table.values, lives.age[table.record][:, None]], axis=1),
        record=table.record,
    )


def constant_regression(target: FloatArray, name: NDArray[Any]) -> float:
    """Mean of (record,) targets in which every life counts the same.

    What is said without looking.
    """
    return float(np.average(target, weights=balanced_weights(name)))


def fit_regression(
    train: Table, validation: Table, lives: Lives, target: FloatArray
) -> tuple[str, Callable[[Table], FloatArray]]:
    """Ridge regression or gradient boosting, the one of least squared error on the validation
    lives.

    Parameters
    ----------
    train, validation : tables of the same columns, of records whose target is known
    lives : of the data set; every life counts the same
    target : (record,) of all records of the data set

    Returns
    -------
    what was chosen, and a function that gives (record,) targets of a table
    """
    known = np.flatnonzero(
        np.isfinite(train.values).any(axis=0)
    )  # the boosting's bins need a value
    weight, held_out = (
        balanced_weights(lives.name[table.record]) for table in (train, validation)
    )
    scored = []
    for name, make in _candidates().items():
        model = make()
        step = {} if name == "gradient boosting" else {"model__sample_weight": weight}
        model.fit(
            train.values[:, known],
            target[train.record],
            **(step or {"sample_weight": weight}),
        )
        error = model.predict(validation.values[:, known]) - target[validation.record]
        scored.append((float(np.average(error**2, weights=held_out)), name, model))
    _, name, best = min(scored, key=lambda row: row[0])

    def predict(table: Table) -> FloatArray:
        return np.asarray(best.predict(table.values[:, known]), dtype=float)

    return name, predict


def _candidates() -> dict[str, Callable[[], Any]]:
    """Untrained models by name, the first winning ties."""
    from sklearn.ensemble import HistGradientBoostingRegressor
    from sklearn.impute import SimpleImputer
    from sklearn.linear_model import Ridge
    from sklearn.pipeline import Pipeline
    from sklearn.preprocessing import StandardScaler

    def ridge(penalty: float) -> Any:
        steps = [
            ("impute", SimpleImputer(keep_empty_features=True)),
            ("scale", StandardScaler()),
        ]
        return Pipeline([*steps, ("model", Ridge(alpha=penalty))])

    def boosting() -> Any:
        return HistGradientBoostingRegressor(
            max_iter=100, max_leaf_nodes=8, learning_rate=0.1, random_state=0
        )

    ridges: dict[str, Callable[[], Any]] = {
        f"ridge, penalty {penalty:g}": lambda penalty=penalty: ridge(penalty)  # type: ignore[misc]
        for penalty in PENALTIES
    }
    return {**ridges, "gradient boosting": boosting}
