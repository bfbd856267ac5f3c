"""Scores of recordings against healthy ones, each healthy one held back in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.block_features import Feature, Layout
from diagnose.detection.healthy_spread import (
    HealthySpread,
    group_distance,
    healthy_spread,
)
from diagnose.detection.score_threshold import Threshold, threshold_of
from diagnose.detection.time_blocks import BlockedRecording
from diagnose.detection.tooth_changes import aligned, tooth_features, tooth_values

FloatArray = NDArray[np.floating]
Group = tuple[str, int]

# Assumed, of the distance of a group: what it is in the root mean square, where few blocks show it,
# and the blocks that it weighs as.
PRIOR_DISTANCE, DISTANCE_WEIGHT = 1.5, 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class References:
    """Healthy recordings that others are held against.

    Attributes
    ----------
    recordings : of the machine as it is mounted, then of other mountings
    n_mountings : how many of them are of other mountings
    layout : of their features
    is_remounted : True if a recording to judge may have another mounting
    """

    recordings: tuple[BlockedRecording, ...]
    n_mountings: int
    layout: Layout
    is_remounted: bool

    @property
    def features(self) -> tuple[Feature, ...]:
        """Names of the features of `measured`."""
        return (*self.recordings[0].features, *tooth_features(self.layout))

    def is_mounting(self, index: int) -> bool:
        """True for a recording of another mounting."""
        return index >= len(self.recordings) - self.n_mountings

    @property
    def alike_one_to_judge(self) -> tuple[int, ...]:
        """References that a healthy recording to judge is exchangeable with.

        The other mountings, where it may have another mounting; else all.
        """
        everything = range(len(self.recordings))
        if not self.is_remounted:
            return tuple(everything)
        return tuple(index for index in everything if self.is_mounting(index))

    def measured(self, recording: BlockedRecording) -> Measured:
        """Features of a recording against each of the references."""
        changes = []
        for other in self.recordings:
            turns = zip(other.turns, recording.turns, strict=True)
            sound = [[aligned(turn, own)] for turn, own in turns]
            rows = [
                tooth_values(block.turns, sound, self.layout)
                for block in recording.blocks
            ]
            changes.append(np.stack(rows))
        return Measured(own=recording.values, changes=tuple(changes))


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Features of the blocks of a recording.

    Attributes
    ----------
    own : (block, feature) that need no reference
    changes : for each reference (block, feature) of the turns against it
    """

    own: FloatArray
    changes: tuple[FloatArray, ...]

    def values(self, against: Sequence[int]) -> FloatArray:
        """(block, feature), the changes as means over some references."""
        changed = np.mean([self.changes[index] for index in against], axis=0)
        return np.hstack([self.own, changed])


@dataclass(frozen=True, slots=True, kw_only=True)
class Fold:
    """References without the one that is held back.

    Attributes
    ----------
    kept : numbers of the others
    spread : of them
    """

    kept: tuple[int, ...]
    spread: HealthySpread


@dataclass(frozen=True, slots=True, kw_only=True)
class Judge:
    """Score of recordings by some of the features, calibrated with the references.

    Attributes
    ----------
    columns : group -> numbers of its features that count
    folds : one for each reference held back
    scale : (group,) usual distance of the group's features
    threshold : of the score
    held_back : (reference,) score of each when held back, of those alike the one to judge
    """

    columns: dict[Group, NDArray[np.intp]]
    folds: tuple[Fold, ...]
    scale: FloatArray
    threshold: Threshold
    held_back: FloatArray

    @property
    def groups(self) -> tuple[Group, ...]:
        """Groups in the order of `ratios`."""
        return tuple(self.columns)

    def looser(self, factor: float) -> Judge:
        """The same with a limit that is so many times as wide."""
        value = self.threshold.value * factor
        return replace(self, threshold=replace(self.threshold, value=value))

    def ratios(self, measured: Measured) -> FloatArray:
        """(block, group) distance over its limit, mean over the folds."""
        over_folds = [
            _distances(measured.values(fold.kept), fold.spread, self.columns)
            for fold in self.folds
        ]
        return np.mean(over_folds, axis=0) / self.scale / self.threshold.value

    def deviations(self, measured: Measured) -> tuple[FloatArray, FloatArray]:
        """(feature,) change in dB and in spreads, medians over the blocks, means over the folds."""
        changes, spreads = [], []
        for fold in self.folds:
            values = np.median(measured.values(fold.kept), axis=0)
            changes.append(values - fold.spread.center)
            spreads.append(changes[-1] / fold.spread.spread)
        return np.mean(changes, axis=0), np.mean(spreads, axis=0)


def make_judge(
    references: References, usable: NDArray[np.bool_], false_alarms: float
) -> Judge:
    """Judge by the usable features (feature,), calibrated by holding back each reference.

    Notes
    -----
    A recording is judged with each fold in turn, as the reference that the fold holds back, so that
    both have as many references: cross-conformal prediction, Vovk (2015), Annals of Mathematics and
    Artificial Intelligence 74, 9-28.
    """
    columns = _columns(references.features, usable)
    n_all = len(references.recordings)
    measured = [references.measured(recording) for recording in references.recordings]
    others = [tuple(i for i in range(n_all) if i != held) for held in range(n_all)]
    values = [one.values(kept) for one, kept in zip(measured, others, strict=True)]
    folds = []
    for kept in others:
        healthy = [values[i] for i in kept if not references.is_mounting(i)]
        remounted = [values[i] for i in kept if references.is_mounting(i)]
        spread = healthy_spread(
            healthy or remounted,
            references.features,
            remounted,
            is_remounted=references.is_remounted,
        )
        folds.append(Fold(kept=kept, spread=spread))
    distances = [
        _distances(own, fold.spread, columns)
        for own, fold in zip(values, folds, strict=True)
    ]
    alike = [distances[index] for index in references.alike_one_to_judge]
    blocks = np.concatenate(alike)
    sums = np.square(blocks).sum(axis=0) + DISTANCE_WEIGHT * PRIOR_DISTANCE**2
    scale = np.sqrt(sums / (len(blocks) + DISTANCE_WEIGHT))
    scores = np.array([score_of(blocks / scale) for blocks in alike])
    return Judge(
        columns=columns,
        folds=tuple(folds),
        scale=scale,
        threshold=threshold_of(scores.tolist(), false_alarms),
        held_back=scores,
    )


def assumed_judge(
    references: References, usable: NDArray[np.bool_], false_alarms: float
) -> Judge:
    """Judge by one session alone: the spread between sessions and the threshold are assumed.

    Parameters
    ----------
    references : one recording, cut into parts
    """
    columns = _columns(references.features, usable)
    everything = tuple(range(len(references.recordings)))
    measured = [references.measured(recording) for recording in references.recordings]
    whole = np.concatenate(
        [
            one.values([i for i in everything if i != index])
            for index, one in enumerate(measured)
        ]
    )
    spread = healthy_spread(
        [whole], references.features, is_remounted=references.is_remounted
    )
    scale = np.full(len(columns), PRIOR_DISTANCE)
    return Judge(
        columns=columns,
        folds=(Fold(kept=everything, spread=spread),),
        scale=scale,
        threshold=threshold_of((), false_alarms),
        held_back=np.empty(0),
    )


def score_of(ratios: FloatArray) -> float:
    """Score of a recording from ratios (block, group): the most changed group, in the median of
    the blocks.
    """
    return float(np.median(ratios.max(axis=-1)))


def _columns(
    features: Sequence[Feature], usable: NDArray[np.bool_]
) -> dict[Group, NDArray[np.intp]]:
    groups = [(feature.group, feature.part) for feature in features]
    return {
        group: np.array(
            [i for i, other in enumerate(groups) if other == group and usable[i]]
        )
        for group in dict.fromkeys(groups)
        if any(usable[i] for i, other in enumerate(groups) if other == group)
    }


def _distances(
    values: FloatArray, spread: HealthySpread, columns: dict[Group, NDArray[np.intp]]
) -> FloatArray:
    """(block, group) distances of values (block, feature)."""
    deviations = spread.deviations(values)
    return np.stack(
        [group_distance(deviations[:, chosen]) for chosen in columns.values()], axis=1
    )
