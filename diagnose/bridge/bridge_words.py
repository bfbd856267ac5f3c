"""Sentences of a bridge: what beats what, and what cannot be told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnose.bridge.bridge_run import NOVELTY, OURS, BridgeResult
from diagnose.bridge.bridge_scores import (
    ONE_SPECIMEN,
    Interval,
    advantage,
    specimen_counts,
)

BEATS, ON_THESE, NOT_TOLD, WORSE = (
    "beats",
    "on these recordings",
    "not told apart",
    "worse",
)
OF_OTHERS = "of other specimens nothing is known"


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The implants against another method.

    Attributes
    ----------
    method : the other
    difference : balanced accuracy of the implants less that of the other
    verdict : `BEATS`, `ON_THESE`, `NOT_TOLD` or `WORSE`
    sentence : in words
    """

    method: str
    difference: Interval
    verdict: str
    sentence: str


def comparisons(result: BridgeResult) -> list[Comparison]:
    """The implants against every method that names classes."""
    ours = result.answers[OURS].predicted
    assert ours is not None
    compared = []
    for method, answers in result.answers.items():
        if method == OURS or answers.predicted is None:
            continue
        difference = advantage(
            result.judged,
            ours,
            answers.predicted,
            n_bootstrap=result.protocol.n_bootstrap,
        )
        compared.append(_comparison(method, difference))
    return compared


def _comparison(method: str, difference: Interval) -> Comparison:
    """The verdict on a difference: of specimens where they are enough, else of recordings."""
    verdict = NOT_TOLD
    if difference.by_specimen is not None:
        verdict = _of_interval(difference.by_specimen, BEATS)
    elif difference.by_recording is not None:
        verdict = _of_interval(difference.by_recording, ON_THESE)
    sentence = {
        BEATS: f"Physics beats '{method}' by {difference.mean:+.2f}, over specimens.",
        ON_THESE: (
            f"Physics is ahead of '{method}' by {difference.mean:+.2f} on these recordings; "
            f"{OF_OTHERS}."
        ),
        NOT_TOLD: f"Physics does not beat '{method}' ({difference.mean:+.2f}).",
        WORSE: f"Physics is behind '{method}' ({difference.mean:+.2f}).",
    }[verdict]
    return Comparison(
        method=method, difference=difference, verdict=verdict, sentence=sentence
    )


def _of_interval(interval: tuple[float, float], above: str) -> str:
    low, high = interval
    if low > 0.0:
        return above
    if high < 0.0:
        return WORSE
    return NOT_TOLD


def headline(result: BridgeResult) -> list[str]:
    """Result of the run in a few sentences, the weaknesses first."""
    lines = [specimen_sentence(result)]
    verdicts = comparisons(result)
    lines.append(_summary(verdicts))
    score = result.accuracy(OURS)
    assert score is not None  # a network names classes
    n_classes = len(specimen_counts(result.judged))
    lines.append(
        f"Implants: balanced accuracy {score.mean:.2f} over {n_classes} classes of recordings; "
        f"{len(result.judged.labels)} can be answered, a constant answer has {1 / n_classes:.2f}."
    )
    lines += _detection_lines(result)
    return lines


def specimen_sentence(result: BridgeResult) -> str:
    """Number of specimens behind each class, and what follows."""
    counts = specimen_counts(result.judged)
    text = ", ".join(f"{label} {n}" for label, n in counts.items())
    if min(counts.values()) == 1:
        return f"Specimens: {text}. At least {ONE_SPECIMEN}."
    return f"Specimens: {text}."


def _summary(verdicts: list[Comparison]) -> str:
    """All comparators that physics does not beat, in one sentence."""
    weak = [one.method for one in verdicts if one.verdict in (NOT_TOLD, WORSE)]
    here = [one.method for one in verdicts if one.verdict == ON_THESE]
    if weak:
        return f"Physics does not beat: {', '.join(weak)}."
    if here:
        return f"Physics is ahead of every comparator on these recordings; {OF_OTHERS}."
    return "Physics beats every comparator, over specimens."


def _detection_lines(result: BridgeResult) -> list[str]:
    """Share of pairs that detection without any simulation separates."""
    if NOVELTY not in result.answers:
        reason = result.why_not.get(NOVELTY, "it was not run")
        return [f"Novelty gives no answer: {reason}."]
    ours, novelty = result.separation(OURS), result.separation(NOVELTY)
    line = (
        "Healthy against faulty: the distance from healthy recordings separates "
        f"{area_text(novelty)} of pairs without any simulation, implants {area_text(ours)}."
    )
    if novelty is not None and ours is not None and novelty >= ours:
        line += " Detection needs no simulation here."
    lines = [line, *_alarm_lines(result)]
    if NOVELTY in result.why_not:
        lines.append(f"Novelty: {result.why_not[NOVELTY]}.")
    return lines


def area_text(area: float | None) -> str:
    """A share of pairs; a question mark where there is none."""
    return "?" if area is None else f"{area:.2f}"


def _alarm_lines(result: BridgeResult) -> list[str]:
    """Recordings that novelty calls changed, of the healthy and of the faulty ones."""
    alarm = result.answers[NOVELTY].alarm
    if alarm is None:
        return []
    known = np.isfinite(result.answers[NOVELTY].faulty[0])
    sound, faulty = (
        known & (result.judged.label == 0),
        known & (result.judged.label > 0),
    )
    return [
        f"Novelty calls changed: {alarm[sound].sum()} of {sound.sum()} healthy and "
        f"{alarm[faulty].sum()} of {faulty.sum()} faulty recordings."
    ]


def interval_text(interval: tuple[float, float] | None, *, sign: str = "") -> str:
    """Ends of an interval; a dash where there are too few groups."""
    if interval is None:
        return "too few"
    low, high = interval
    return f"{low:{sign}.2f} to {high:{sign}.2f}"


def ranked_rows(result: BridgeResult) -> list[tuple[str, ...]]:
    """A row a method: name, balanced accuracy, both intervals, healthy against faulty."""
    rows: list[tuple[str, ...]] = []
    for method in result.answers:
        score = result.accuracy(method)
        cells: tuple[str, ...] = ("names no class", "", "")
        if score is not None:
            ends = (score.by_recording, score.by_specimen)
            cells = (f"{score.mean:.2f}", *map(interval_text, ends))
        rows.append((method, *cells, area_text(result.separation(method))))
    return rows
