"""Records, units and runs of a protocol, as the results of a study count them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import (
    SUBSETS,
    IntArray,
    Task,
    subset_segments,
)
from diagnose.scoring.metrics import confusion_by_unit
from diagnose.scoring.predictions import Outcome

AnyRun = TypeVar("AnyRun", bound=Outcome)


def unit_ids(task: Task) -> NDArray[Any]:
    """(record,) name of the unit of every record."""
    return np.asarray(task.dataset.column("unit_id"))


def part_records(task: Task, protocol: str) -> dict[str, IntArray]:
    """Subset -> its records, sorted, each once."""
    return {
        subset: np.unique(subset_segments(task, protocol, subset).record)
        for subset in SUBSETS
    }


def part_sizes(task: Task, parts: Mapping[str, IntArray]) -> dict[str, dict[str, int]]:
    """Numbers of records and of units of every subset."""
    unit = unit_ids(task)
    return {
        "n_records": {name: int(record.size) for name, record in parts.items()},
        "n_units": {name: n_different(unit[record]) for name, record in parts.items()},
    }


def n_different(values: NDArray[Any]) -> int:
    """Number of different values."""
    return int(np.unique(values).size)


def by_method(runs: Sequence[AnyRun], protocol: str) -> dict[str, list[AnyRun]]:
    """Method -> its runs on a protocol."""
    result: dict[str, list[AnyRun]] = {}
    for run in runs:
        if run.protocol == protocol:
            result.setdefault(run.method, []).append(run)
    return result


def run_notes(runs: Sequence[Outcome]) -> dict[str, list[Any]]:
    """Seeds and details of the runs of a method."""
    return {
        "seeds": [run.seed for run in runs],
        "detail": [run.detail for run in runs],
    }


def confusion_counts(
    task: Task, runs: Sequence[tuple[IntArray, IntArray]]
) -> NDArray[np.int64]:
    """Counts (seed, unit, true class, predicted class).

    Parameters
    ----------
    runs : for each seed, records (record,) and their predicted labels (record,)
    """
    labels, unit = task.labels(), unit_ids(task)
    n_classes = len(task.class_names)
    counts = [
        confusion_by_unit(labels[record], predicted, unit[record], n_classes)
        for record, predicted in runs
    ]
    return np.stack(counts)
