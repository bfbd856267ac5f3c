"""Records and units of a protocol, as the results of a study count them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import (
    SUBSETS,
    IntArray,
    Task,
    subset_segments,
)


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
