"""Lives of machines that run to failure, whose snapshots the records of a data set are."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.protocols import OPEN_PROTOCOLS, choose_protocols
from diagnose.data.windows import (
    CROSS_SENSOR,
    SUBSETS,
    FloatArray,
    IntArray,
    Segments,
    Task,
    subset_segments,
)
from gensig.errors import ConfigError, DatasetError

COLUMNS = ("life_id", "life_time_h", "remaining_life_h", "life_failed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lives:
    """Age and remaining life of the records of a data set.

    Attributes
    ----------
    name : (record,) name of the life; "" for a record that is no snapshot of one, or that
        failed in simulation
    age : (record,) h of operation when it was taken
    remaining : (record,) h from then to the failure, or to the end of the history of a life that
        did not fail
    failed : (record,) bool, True if the life ended in failure. Else the life is censored, and
        `remaining` is a lower bound
    """

    name: NDArray[Any]
    age: FloatArray
    remaining: FloatArray
    failed: NDArray[np.bool_]

    def known(self, early_life: float) -> NDArray[np.bool_]:
        """(record,) True if the remaining life, cut at ``early_life`` h, is known.

        A lower bound above the cut is enough.
        """
        return (self.name != "") & (self.failed | (self.remaining >= early_life))


def lives_of(task: Task) -> Lives:
    """The lives of a task's data set.

    Raises
    ------
    DatasetError    for a data set whose records are no snapshots of lives, or whose columns
        contradict each other
    """
    dataset = task.dataset
    if missing := [name for name in COLUMNS if name not in dataset.column_names]:
        raise DatasetError(
            f"{dataset.folder} has no column {missing[0]}: its records are no snapshots of "
            "lives, which task=remaining_life needs; make one with "
            "gensig generate experiment=run_to_failure"
        )
    name, age, remaining, failed = (
        np.asarray(dataset.column(column)) for column in COLUMNS
    )
    age, remaining = age.astype(float), remaining.astype(float)
    used = (
        (task.labels() >= 0) & (name != "") & np.isfinite(age) & np.isfinite(remaining)
    )
    if not used.any():
        raise DatasetError(
            f"{dataset.folder}: no usable record is a snapshot of a life"
        )
    if (wrong := np.flatnonzero(used & ((age < 0) | (remaining < 0)))).size:
        raise DatasetError(
            f"{dataset.folder}, record {dataset.column('record_id')[wrong[0]]}: "
            f"life_time_h {age[wrong[0]]:g} and remaining_life_h {remaining[wrong[0]]:g} "
            "must not be below 0"
        )
    for life in np.unique(name[used]):
        if np.unique(failed[used & (name == life)]).size > 1:
            raise DatasetError(
                f"{dataset.folder}: life {life} has failed in some of its records "
                "and not in others"
            )
    return Lives(
        name=np.where(used, name, ""), age=age, remaining=remaining, failed=failed == 1
    )


def life_segments(task: Task, lives: Lives, protocol: str, subset: str) -> Segments:
    """Stretches of one subset of a split whose records are snapshots of lives.

    Raises
    ------
    ConfigError    for a subset without any
    """
    segments = kept_segments(subset_segments(task, protocol, subset), lives.name != "")
    if not segments.record.size:
        raise ConfigError(
            f"protocol {protocol}: its {subset} part has no snapshot of a life; "
            "leave the protocol out"
        )
    return segments


def kept_segments(segments: Segments, kept: NDArray[np.bool_]) -> Segments:
    """Stretches of the records that are kept, (record,) of the data set."""
    return segments.of(kept[segments.record])


def choose_life_protocols(
    task: Task,
    lives: Lives,
    wanted: Sequence[str] | None,
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Protocols that keep every life in one subset, and why the others are left out.

    Raises
    ------
    ConfigError    for a name that is no protocol, and where none is left
    """
    offered, left_out = choose_protocols(task, wanted)
    kept = []
    for protocol in offered:
        reason = _why_not(task, lives, protocol)
        if reason is None:
            kept.append(protocol)
        else:
            left_out[protocol] = reason
    if not kept:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
        raise ConfigError(
            f"{task.dataset.folder} has no protocol for task=remaining_life ({reasons})",
        )
    return tuple(kept), left_out


def _why_not(task: Task, lives: Lives, protocol: str) -> str | None:
    if protocol in OPEN_PROTOCOLS or protocol == CROSS_SENSOR:
        return "it is of no use for remaining lives"
    records = {
        subset: life_segments(task, lives, protocol, subset).record
        for subset in SUBSETS
    }
    for first, second in itertools.combinations(SUBSETS, 2):
        both = np.intersect1d(lives.name[records[first]], lives.name[records[second]])
        if both.size:
            return f"life {both[0]} is in its {first} and its {second} part"
    for subset, record in records.items():
        if not lives.failed[record].any():
            return (
                f"no life of its {subset} part failed; "
                "make more lives or a longer horizon"
            )
    return None


def early_level(
    lives: Lives, record: IntArray, *, level_h: float | None, share: float
) -> float:
    """Level in h at which the remaining life is cut.

    Long before its failure a machine shows no sign of it.

    Parameters
    ----------
    lives : of the data set
    record : of the training part
    level_h : the level; None for the share below
    share : of the median length of the training lives that failed

    Raises
    ------
    DatasetError    for lives of no length

    Source: the piecewise linear target of Heimes (2008), "Recurrent neural networks for remaining
    useful life estimation", International Conference on Prognostics and Health Management.
    """
    if level_h is not None:
        return float(level_h)
    chosen = record[lives.failed[record]]
    _, first = np.unique(lives.name[chosen], return_index=True)
    level = share * float(np.median((lives.age + lives.remaining)[chosen[first]]))
    if level <= 0:
        raise DatasetError(
            "the training lives have no length; give remaining_life.early_life_h"
        )
    return level


def balanced_weights(name: NDArray[Any]) -> FloatArray:
    """(record,) weights of mean 1 that sum to the same for every life.

    `name` (record,) is the life of each record.
    """
    _, position, counts = np.unique(name, return_inverse=True, return_counts=True)
    weight = 1.0 / counts[position]
    return np.asarray(weight / weight.mean())
