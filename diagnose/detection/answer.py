"""Kind and place of a change, from the ratios of all groups."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.block_features import (
    BROADBAND,
    IMPULSES,
    MESH,
    SIDEBANDS,
    TEETH,
)
from diagnose.detection.finding import (
    FeatureChange,
    Finding,
    GroupChange,
    Kind,
    ToothPlace,
)
from diagnose.detection.followed_shafts import FollowedRecording
from diagnose.detection.gear_stages import GearStages
from diagnose.detection.held_back import Group, Judge, References, score_of
from diagnose.detection.time_blocks import BlockedRecording
from diagnose.detection.tooth_changes import aligned, fewest_teeth, turn_change
from gensig.signals.handbook_rule import handbook_answer
from gensig.signals.indicators import rms

FloatArray = NDArray[np.floating]

SHOWN = 3  # features of a group that are named
KINDS: dict[str, Kind] = {
    BROADBAND: "broadband",
    MESH: "mesh",
    SIDEBANDS: "shaft",
    TEETH: "shaft",
    IMPULSES: "impulses",
}
LEVEL_ALONE = (
    "levels changed and no shape did: like a sensor mounted anew, another load, or wear of whole "
    "gears; check the mounting, or give --mounting"
)


def answer_of(
    followed: FollowedRecording,
    recording: BlockedRecording,
    references: References,
    judge: Judge,
) -> Finding:
    """Finding on a recording.

    Parameters
    ----------
    followed : over the angle
    recording : by its blocks
    """
    measured = references.measured(recording)
    ratios = judge.ratios(measured)
    score = score_of(ratios)
    by_group = dict(zip(judge.groups, np.median(ratios, axis=0), strict=True))
    kind: Kind = "healthy"
    if score > 1.0:
        kind = _kind(by_group)
    changes, spreads = judge.deviations(measured)
    groups = [
        _change(group, ratio, references, judge.columns[group], changes, spreads)
        for group, ratio in by_group.items()
    ]
    levels = np.mean([other.level for other in references.recordings], axis=0)
    place = None
    if kind == "shaft":
        place = _place(_changed_shaft(by_group), recording, references)
    is_level_alone = score > 1.0 and not _has_new_shape(by_group)
    notes = (LEVEL_ALONE,) if is_level_alone else ()
    own_score = score * judge.threshold.value
    n_higher = int(np.sum(judge.held_back >= own_score))
    return Finding(
        name=recording.name,
        is_changed=score > 1.0,
        score=score,
        kind=kind,
        is_level_alone=is_level_alone,
        changes=tuple(sorted(groups, key=lambda change: -change.ratio)),
        place=place,
        level_db=float(20.0 * np.log10((rms(followed.signal) / levels).max())),
        handbook=handbook_answer(followed.signal, levels),
        blocks_beyond=int(np.sum(ratios.max(axis=-1) > 1.0)),
        n_blocks=len(ratios),
        rank_probability=(1 + n_higher) / (1 + len(judge.held_back)),
        speed_rpm=followed.speed_rpm,
        speed_by=followed.by,
        notes=notes,
    )


def _has_new_shape(by_group: dict[Group, float]) -> bool:
    """True if a group changed that a mounting leaves alone."""
    return any(
        ratio > 1.0 and group[0] in (TEETH, IMPULSES)
        for group, ratio in by_group.items()
    )


def _kind(by_group: dict[Group, float]) -> Kind:
    """Kind of a change from the ratios of the groups; new shapes come before levels."""
    counted = by_group
    if _has_new_shape(by_group):
        counted = {g: r for g, r in by_group.items() if g[0] in (TEETH, IMPULSES)}
    first = max(counted, key=lambda group: counted[group])
    return KINDS[first[0]]


def _changed_shaft(by_group: dict[Group, float]) -> int:
    """Number of the shaft whose teeth, or else sidebands, changed most."""
    teeth = {g: ratio for g, ratio in by_group.items() if g[0] == TEETH}
    sidebands = {g: ratio for g, ratio in by_group.items() if g[0] == SIDEBANDS}
    if max(teeth.values()) > 1.0 or not sidebands:
        return max(teeth, key=lambda group: teeth[group])[1]
    return max(sidebands, key=lambda group: sidebands[group])[1]


def _place(
    shaft: int, recording: BlockedRecording, references: References
) -> ToothPlace:
    """Place on a shaft that the healthy turns explain least."""
    turn, layout = recording.turns[shaft], references.layout
    sound = [aligned(other.turns[shaft], turn) for other in references.recordings]
    change = turn_change(turn, sound, fewest_teeth(layout, shaft))
    stages = layout.stages
    return ToothPlace(
        shaft=stages.shafts[shaft],
        share_of_turn=change.place,
        teeth=tuple(
            (gear.name, int(change.place * gear.n_teeth) % gear.n_teeth)
            for gear in stages.gears(shaft)
        ),
        over_median_db=change.peak_db,
    )


def _change(
    group: Group,
    ratio: float,
    references: References,
    columns: NDArray[np.intp],
    changes: FloatArray,
    spreads: FloatArray,
) -> GroupChange:
    """Change of a group with its most changed features."""
    order = columns[np.argsort(-np.abs(spreads[columns]))][:SHOWN]
    return GroupChange(
        group=group[0],
        where=_where(group, references.layout.stages),
        part=group[1],
        ratio=float(ratio),
        features=tuple(
            FeatureChange(
                name=references.features[index].name,
                change_db=float(changes[index]),
                spreads=float(spreads[index]),
            )
            for index in order
        ),
    )


def _where(group: Group, stages: GearStages) -> str:
    """Place of a group in words."""
    kind, part = group
    if kind == MESH:
        return f"mesh of stage {part + 1}" if stages.n_stages > 1 else "mesh"
    if kind in (SIDEBANDS, TEETH):
        return stages.shafts[part]
    return "whole machine"
