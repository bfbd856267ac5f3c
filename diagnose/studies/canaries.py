"""Canaries: random labels of test records, which methods are handed in place of the true ones.

No answer may follow them. A method that is given the labels that it is scored on, or that trained
on test records, does.
"""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import TypeVar

import numpy as np

from diagnose.baselines.base import Parts
from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import IntArray, Task, WindowSet, subset_segments
from diagnose.scoring.predictions import Prediction

SEED = 20261127
Labelled = TypeVar("Labelled", FeatureTable, WindowSet)


def canary_labels(task: Task, protocol: str) -> IntArray | None:
    """(record,) labels of a task, those of the test records of a protocol drawn at random.

    None where test records are training records too, as in a leaky protocol: their labels are
    known there.
    """
    tested, *others = (
        subset_segments(task, protocol, subset).record
        for subset in ("test", "train", "validation")
    )
    if np.isin(tested, np.concatenate(others)).any():
        return None
    labels = task.labels().copy()
    records = np.unique(tested)
    rng = np.random.default_rng([SEED, zlib.crc32(protocol.encode())])
    labels[records] = rng.integers(len(task.class_names), size=records.size)
    return labels


def with_canaries(rows: Labelled, labels: IntArray | None) -> Labelled:
    """Rows with the labels of `canary_labels`."""
    if labels is None:
        return rows
    return replace(rows, label=labels[rows.record])


def parts_with_canaries(parts: Parts, labels: IntArray | None) -> Parts:
    """The tables of the three subsets with the labels of `canary_labels`."""
    return replace(
        parts,
        train=with_canaries(parts.train, labels),
        validation=with_canaries(parts.validation, labels),
        test=with_canaries(parts.test, labels),
    )


def counted(prediction: Prediction, labels: IntArray | None) -> Prediction:
    """The prediction with the number of its answers that are those of the canaries."""
    if labels is None:
        return prediction
    followed = prediction.predicted == labels[prediction.record]
    return replace(prediction, n_followed=int(followed.sum()))
