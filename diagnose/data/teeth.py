"""Tooth counts of the records of a data set, whether all have the same gears or not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gensig.errors import DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

GEARS = ("pinion", "wheel")  # the driving and the driven one
# Columns: share of a passage that has passed at the first sample, and the tooth of each gear then.
START = ("start_phase", "start_tooth_pinion", "start_tooth_wheel")


def missing_teeth(dataset: Dataset) -> str | None:
    """The first tooth count that a data set does not say; None if it says both."""
    for gear in GEARS:
        try:
            dataset.n_teeth(gear)
        except DatasetError:
            return f"n_teeth_{gear}"
    return None


def teeth_of_records(dataset: Dataset) -> NDArray[np.int64]:
    """(record, gear) teeth of the driving and the driven gear.

    Raises
    ------
    DatasetError    if the data set does not say them
    """
    return np.stack([dataset.n_teeth(gear) for gear in GEARS], axis=1)


def common_teeth(dataset: Dataset) -> tuple[int, int] | None:
    """Teeth of both gears where all records have the same; else None."""
    if missing_teeth(dataset):
        return None
    pairs = np.unique(teeth_of_records(dataset), axis=0)
    if len(pairs) != 1:
        return None
    driving, driven = pairs[0].tolist()
    return driving, driven


def teeth_range(
    dataset: Dataset,
) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Fewest and most teeth of the driving and of the driven gears, where they differ."""
    if missing_teeth(dataset) or common_teeth(dataset):
        return None
    teeth = teeth_of_records(dataset)
    fewest, most = teeth.min(axis=0).tolist(), teeth.max(axis=0).tolist()
    driving, driven = zip(fewest, most, strict=True)
    return driving, driven
