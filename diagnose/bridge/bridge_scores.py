"""Scores of a bridge, with intervals by recording and by specimen.

A machine's recordings of one specimen share its gears and its assembly: an interval over them says
how sure the score is for these gears, and nothing of others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnose.scoring.machines import LEAST_UNITS
from diagnose.scoring.metrics import recall

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]

RECORDINGS, SPECIMENS = "recordings", "specimens"
ONE_SPECIMEN = "one specimen a class: says nothing about others"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Recordings that were judged, with their labels and specimens.

    Attributes
    ----------
    names : of the recordings
    label : (recording,) index into `labels`
    specimen : (recording,) its gears and assembly
    labels : all labels that can be answered
    """

    names: tuple[str, ...]
    label: IntArray
    specimen: tuple[str, ...]
    labels: tuple[str, ...]

    def groups(self, kind: str) -> IntArray:
        """(recording,) number of the group that is drawn: its own, or that of its specimen."""
        if kind == RECORDINGS:
            return np.arange(len(self.names))
        known = {
            name: number for number, name in enumerate(dict.fromkeys(self.specimen))
        }
        return np.array([known[name] for name in self.specimen])

    def fewest(self, kind: str) -> int:
        """Groups of the class that has fewest."""
        group = self.groups(kind)
        return min(
            np.unique(group[self.label == one]).size for one in np.unique(self.label)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """Answers of a method for all recordings.

    Attributes
    ----------
    predicted : (seed, recording) index of the answered label; None for a method that names no class
    faulty : (seed, recording) larger where a fault is likelier
    alarm : (recording,) True where a method that names no class calls it changed; None for others
    """

    predicted: IntArray | None
    faulty: FloatArray
    alarm: NDArray[np.bool_] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A score with its 95 % intervals.

    Attributes
    ----------
    mean : over seeds
    by_recording, by_specimen : low and high; None for fewer than `LEAST_UNITS` groups of a class
    """

    mean: float
    by_recording: tuple[float, float] | None
    by_specimen: tuple[float, float] | None


def confusion(judged: Judged, predicted: IntArray) -> NDArray[np.int64]:
    """(true, answered) counts of (seed, recording) answers, over all seeds."""
    n_labels = len(judged.labels)
    counts = np.zeros((n_labels, n_labels), dtype=np.int64)
    for row in predicted:
        np.add.at(counts, (judged.label, row), 1)
    return counts


def accuracy(judged: Judged, predicted: IntArray, *, n_bootstrap: int) -> Interval:
    """Balanced accuracy over the classes present."""
    hits = (predicted == judged.label).mean(axis=0)
    return _interval(judged, hits, n_bootstrap)


def advantage(
    judged: Judged, predicted: IntArray, other: IntArray, *, n_bootstrap: int
) -> Interval:
    """Balanced accuracy less that of another method on the same recordings."""
    hits = (predicted == judged.label).mean(axis=0) - (other == judged.label).mean(
        axis=0
    )
    return _interval(judged, hits, n_bootstrap)


def _interval(judged: Judged, value: FloatArray, n_bootstrap: int) -> Interval:
    """Mean over classes of a (recording,) value, with both intervals."""
    return Interval(
        mean=_class_mean(value, judged.label),
        by_recording=_drawn(judged, value, RECORDINGS, n_bootstrap),
        by_specimen=_drawn(judged, value, SPECIMENS, n_bootstrap),
    )


def _class_mean(value: FloatArray, label: IntArray) -> float:
    return float(np.mean([value[label == one].mean() for one in np.unique(label)]))


def _drawn(
    judged: Judged, value: FloatArray, kind: str, n_bootstrap: int
) -> tuple[float, float] | None:
    """95 % of the score over groups drawn anew within each class.

    Source: percentile interval of Efron & Tibshirani (1993), "An introduction to the bootstrap",
    section 13.3; strata, section 8.3.
    """
    if judged.fewest(kind) < LEAST_UNITS:
        return None
    rng = np.random.default_rng(len(judged.names))
    group = judged.groups(kind)
    of_classes = []
    for one in np.unique(judged.label):
        inside = judged.label == one
        numbers, position = np.unique(group[inside], return_inverse=True)
        total = np.bincount(position, weights=value[inside])
        size = np.bincount(position)
        n_groups = numbers.size
        drawn = rng.multinomial(n_groups, np.full(n_groups, 1 / n_groups), n_bootstrap)
        of_classes.append((drawn @ total) / (drawn @ size))
    low, high = np.quantile(np.mean(of_classes, axis=0), [0.025, 0.975])
    return float(low), float(high)


def separation(judged: Judged, faulty: FloatArray) -> float | None:
    """Area under the curve of healthy against faulty recordings, mean over seeds.

    Chance that a faulty recording has a larger value than a healthy one; ties count half. NaN is
    left out; None where no pair is left.
    """
    sound = judged.label == 0
    areas = []
    for row in np.asarray(faulty, dtype=float):
        difference = row[~sound][:, None] - row[sound][None, :]
        known = difference[np.isfinite(difference)]
        if known.size:
            areas.append(np.mean((known > 0) + 0.5 * (known == 0)))
    if not areas:
        return None
    return float(np.mean(areas))


def class_recalls(counts: NDArray[np.int64]) -> list[float | None]:
    """Share of each true class found; None for a class without recordings."""
    return [None if np.isnan(value) else float(value) for value in recall(counts)]


def specimen_counts(judged: Judged) -> dict[str, int]:
    """Label -> number of its specimens, of the labels present."""
    group = judged.groups(SPECIMENS)
    return {
        judged.labels[one]: int(np.unique(group[judged.label == one]).size)
        for one in np.unique(judged.label)
    }
