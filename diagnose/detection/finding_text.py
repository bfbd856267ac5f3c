"""A finding in words, and as the content of a JSON file."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from diagnose.detection.finding import Finding, GroupChange

SHOWN_GROUPS = 3
LOCAL_DB = (
    6.0  # assumed: a tooth is named where it stands this much over the median tooth
)
STATES = {
    "healthy": "healthy",
    "one_tooth": "one tooth",
    "many_teeth": "many teeth or surface",
}


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
