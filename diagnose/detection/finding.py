"""Answer of the detection for a recording, as values."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal

from gensig.errors import DatasetError
from gensig.signals.handbook_rule import HandbookAnswer

Kind = Literal["healthy", "shaft", "mesh", "broadband", "impulses"]
SHOWN_GROUPS = 3
LOCAL_DB = (
    6.0  # assumed: a tooth is named where it stands this much over the median tooth
)
STATES = {
    "healthy": "healthy",
    "one_tooth": "one tooth",
    "many_teeth": "many teeth or surface",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureChange:
    """Change of a feature against the healthy recordings.

    Attributes
    ----------
    name : in words
    change_db : dB
    spreads : the same in healthy spreads
    """

    name: str
    change_db: float
    spreads: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupChange:
    """Distance of the features that show one kind of change.

    Attributes
    ----------
    group : "broadband", "mesh", "sidebands", "teeth" or "impulses"
    where : in words: a stage, a shaft, or all
    part : number of the stage or shaft, from 0
    ratio : of the distance to its limit; above 1 it is changed
    features : those that changed most, in spreads
    """

    group: str
    where: str
    part: int
    ratio: float
    features: tuple[FeatureChange, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothPlace:
    """Place on a shaft that changed most.

    Attributes
    ----------
    shaft : name of it
    share_of_turn : of the shaft, after the recording began
    teeth : for each gear on the shaft its name and the tooth, counted from the one in mesh when
        the recording began, which is 0
    over_median_db : dB, its change over that of the median tooth
    """

    shaft: str
    share_of_turn: float
    teeth: tuple[tuple[str, int], ...]
    over_median_db: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Answer for a recording.

    Attributes
    ----------
    name : of the recording
    is_changed : True if the score is above 1
    score : distance from the healthy recordings over its limit; larger is less healthy
    kind : of the change: of a shaft's turn or sidebands, of a mesh's level, of bands, or impulses
        of no shaft
    is_level_alone : True for a change of levels and no shape, as a sensor mounted anew makes it
    changes : of all groups, the most changed first
    place : on the shaft that changed most; None where no shaft did
    level_db : dB, RMS over healthy, of the channel in which it rose most
    handbook : answer of the rule of thumb
    blocks_beyond, n_blocks : time blocks whose score is above 1, and all
    rank_probability : share of held-back healthy recordings, this one counted, that score as high
    speed_rpm : r/min of the input shaft
    speed_by : tacho, or the mesh that was followed
    notes : limits of the answer, a sentence each
    """

    name: str
    is_changed: bool
    score: float
    kind: Kind
    is_level_alone: bool
    changes: tuple[GroupChange, ...]
    place: ToothPlace | None
    level_db: float
    handbook: HandbookAnswer
    blocks_beyond: int
    n_blocks: int
    rank_probability: float
    speed_rpm: float
    speed_by: str
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        ratios = [change.ratio for change in self.changes]
        numbers = (self.score, self.level_db, self.rank_probability, self.speed_rpm)
        if not all(map(math.isfinite, (*numbers, *ratios))):
            raise DatasetError(
                f"{self.name} gets no finite score; a channel is constant or its values are out "
                "of range: check it and the healthy recordings"
            )


def finding_lines(finding: Finding) -> list[str]:
    """Lines for people: the answer, the rule of thumb beside it, the limits."""
    state = "CHANGED" if finding.is_changed else "healthy"
    head = (
        f"{finding.name}: {state}, score {finding.score:.2f} (limit 1), "
        f"{finding.blocks_beyond} of {finding.n_blocks} time blocks beyond; "
        f"{finding.speed_rpm:.5g} r/min by {finding.speed_by}"
    )
    lines = [head]
    if finding.is_changed:
        lines.append(f"where: {where_text(finding)}")
    shown = finding.changes[:SHOWN_GROUPS]
    lines.append("most changed: " + "; ".join(_group_text(group) for group in shown))
    rule = finding.handbook
    lines.append(
        f"handbook rule: {STATES[rule.state]} (kurtosis {rule.kurtosis:.1f}, level "
        f"{rule.level_db:+.1f} dB)"
    )
    return [lines[0], *(f"  {line}" for line in (*lines[1:], *finding.notes))]


def where_text(finding: Finding) -> str:
    """Place of a change in words."""
    place = finding.place
    if finding.kind == "shaft" and place is not None:
        text = place.shaft
        if place.over_median_db < LOCAL_DB:
            return f"{text}, at no single tooth"
        teeth = " or ".join(
            f"tooth {tooth} of the {gear}" for gear, tooth in place.teeth
        )
        return (
            f"{text}, {teeth} ({place.over_median_db:.0f} dB over the median tooth; tooth 0 is in "
            "mesh when the recording begins)"
        )
    if finding.kind == "impulses":
        return "impulses that repeat with no shaft: a bearing, or knocks from elsewhere"
    if finding.kind == "mesh":
        meshes = [one for one in finding.changes if one.group == "mesh"]
        beyond = [one.where for one in meshes if one.ratio > 1.0]
        return ", ".join(beyond or [meshes[0].where])
    return "broadband"


def finding_content(finding: Finding) -> dict[str, Any]:
    """Content of a JSON file."""
    return {
        **asdict(finding),
        "where": where_text(finding) if finding.is_changed else None,
    }


def _group_text(group: GroupChange) -> str:
    """A group with its ratio and its most changed feature."""
    feature = group.features[0]
    return (
        f"{group.group} of {group.where} {group.ratio:.2f} ({feature.name} "
        f"{feature.change_db:+.1f} dB)"
    )
