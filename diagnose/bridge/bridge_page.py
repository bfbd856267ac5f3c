"""The page of a bridge: as HTML, as Markdown and as JSON, with the answers as a table."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from diagnose.bridge.bridge_run import METHODS, BridgeResult
from diagnose.bridge.bridge_scores import class_recalls, confusion, specimen_counts
from diagnose.bridge.bridge_words import (
    comparisons,
    headline,
    interval_text,
    ranked_rows,
)
from diagnose.studies.result_files import environment, write_rows
from gensig.measured.measured_set import MeasuredSet
from gensig.text.markdown import page_text
from gensig.text.page import Section, Table, write_page

PAGE, MARKDOWN, NUMBERS, ANSWERS = (
    "bridge.html",
    "bridge.md",
    "bridge.json",
    "answers.csv",
)
SCORE_HEAD = (
    "method",
    "balanced accuracy",
    "95 % by recording",
    "95 % by specimen",
    "healthy against faulty",
)
MEANINGS = {
    "Balanced accuracy": "mean share found of each class present, of whole recordings, mean over "
    "seeds.",
    "By recording": "recordings drawn anew within each class. It holds for these specimens alone.",
    "By specimen": "specimens drawn anew within each class; 'too few' with fewer than four.",
    "Intervals": "hold the spread of recordings or specimens, not that of seeds, and are not "
    "corrected for the number of comparisons.",
    "Healthy against faulty": "chance that a faulty recording has a larger value than a healthy "
    "one; 0.50 is chance.",
    "Healthy recordings": "are judged on the blocks that were held out; judging a block that "
    "carried is refused.",
    "Novelty": "learns from the carrying blocks of the healthy recordings alone.",
    "Handbook rule": "has limits of handbooks, which were not chosen by these data; on a set that "
    "its author knew they would be.",
    "Gain 0 and shuffled labels": "have nothing to learn; what they find is luck or a leak.",
}


def write_bridge(
    folder: Path, found: MeasuredSet, data: Path, result: BridgeResult
) -> Path:
    """Write page, Markdown, numbers and answers into a folder; returns the page."""
    folder.mkdir(parents=True, exist_ok=True)
    sections = bridge_sections(found, data, result)
    lead = headline(result)
    title = f"Bridge to {found.name}"
    write_page(
        folder / PAGE,
        title=title,
        lead=lead,
        sections=sections,
        program="diagnose bridge",
    )
    text = page_text(title, lead, sections)
    (folder / MARKDOWN).write_text(text, encoding="utf-8")
    numbers = json.dumps(content(found, data, result), indent=2, allow_nan=False)
    (folder / NUMBERS).write_text(f"{numbers}\n", encoding="utf-8")
    write_rows(folder / ANSWERS, _answer_rows(result))
    return folder / PAGE


def bridge_sections(
    found: MeasuredSet, data: Path, result: BridgeResult
) -> list[Section]:
    """Sections of the page."""
    compared = comparisons(result)
    table = Table(
        head=(
            "against",
            "difference",
            "95 % by recording",
            "95 % by specimen",
            "verdict",
        ),
        rows=[
            (
                one.method,
                f"{one.difference.mean:+.2f}",
                interval_text(one.difference.by_recording, sign="+"),
                interval_text(one.difference.by_specimen, sign="+"),
                one.verdict,
            )
            for one in compared
        ],
    )
    confusions = [
        Section(title=f"Confusion: {method}", table=_confusion(result, method))
        for method, answers in result.answers.items()
        if answers.predicted is not None
    ]
    return [
        Section(title="Scores", table=Table(head=SCORE_HEAD, rows=ranked_rows(result))),
        Section(
            title="Does physics beat it?",
            table=table,
            notes=[("", one.sentence) for one in compared],
        ),
        *confusions,
        _recordings(found, result),
        Section(
            title="Protocol",
            text=[f"Residuals of {data}, read as it lies."],
            table=Table(head=("choice", "value"), rows=result.protocol.rows()),
        ),
        Section(title="The methods", notes=[*METHODS.items()]),
        Section(title="What the numbers mean", notes=[*MEANINGS.items()]),
    ]


def _recordings(found: MeasuredSet, result: BridgeResult) -> Section:
    """Recordings behind the scores, with the hashes of their files."""
    machine = result.machine
    used = [one.source for one in (*machine.healthy, *machine.faulty)]
    carrying, held_out = result.n_blocks
    left_out = ", ".join(f"{n}: {reason}" for reason, n in machine.left_out.items())
    stages = " and ".join(f"{a}/{b}" for a, b in machine.train.stages)
    return Section(
        title="Recordings",
        text=[
            f"{found.title or found.name}, machine {machine.name}, teeth {stages}; licence: "
            f"{found.licence or 'not stated by any source that was read'}.",
            f"{len(machine.healthy)} healthy recording(s) cut into {carrying} blocks that carry "
            f"and {held_out} held out; windows of {result.window_seconds:.3g} s. Left out: "
            f"{left_out or 'none'}.",
        ],
        table=Table(
            head=(
                "recording",
                "class",
                "label",
                "specimen",
                "speed, r/min",
                "load",
                "sha256",
            ),
            rows=[
                (
                    one.name,
                    one.own_class,
                    one.label or "",
                    one.specimen,
                    f"{60.0 * (one.shaft_frequency or 0.0):g}",
                    one.load,
                    one.sha256,
                )
                for one in used
            ],
            folded="the recordings, with the hashes of their files",
        ),
    )


def _confusion(result: BridgeResult, method: str) -> Table:
    """Counts of true classes against answers, over all seeds, with recalls."""
    predicted = result.answers[method].predicted
    assert predicted is not None
    counts = confusion(result.judged, predicted)
    rows = [
        (label, *map(str, row), "" if found is None else f"{found:.2f}")
        for label, row, found in zip(
            result.judged.labels, counts.tolist(), class_recalls(counts), strict=True
        )
        if found is not None
    ]
    return Table(head=("true", *result.judged.labels, "found"), rows=rows)


def content(found: MeasuredSet, data: Path, result: BridgeResult) -> dict[str, Any]:
    """The run as plain values."""
    methods = {}
    for method, answers in result.answers.items():
        entry: dict[str, Any] = {"healthy_against_faulty": result.separation(method)}
        score = result.accuracy(method)
        if score is not None and answers.predicted is not None:
            entry["balanced_accuracy"] = asdict(score)
            entry["confusion"] = confusion(result.judged, answers.predicted).tolist()
        methods[method] = entry
    return {
        "set": found.name,
        "machine": result.machine.name,
        "licence": found.licence,
        "data": str(data),
        "protocol": asdict(result.protocol),
        "labels": list(result.judged.labels),
        "specimens": specimen_counts(result.judged),
        "n_recordings": len(result.judged.names),
        "left_out": dict(result.machine.left_out),
        "blocks_carrying": result.n_blocks[0],
        "blocks_held_out": result.n_blocks[1],
        "window_s": result.window_seconds,
        "methods": methods,
        "comparisons": [asdict(one) for one in comparisons(result)],
        "why_not": dict(result.why_not),
        "headline": headline(result),
        "files": _hashes(result),
        "environment": environment(),
    }


def _hashes(result: BridgeResult) -> dict[str, str]:
    """File -> sha256 of everything that was used."""
    used = (*result.machine.healthy, *result.machine.faulty)
    return {one.source.file.name: one.source.sha256 for one in used}


def _answer_rows(result: BridgeResult) -> list[dict[str, Any]]:
    """A row a method, seed and recording."""
    judged, rows = result.judged, []
    for method, answers in result.answers.items():
        for seed, values in enumerate(answers.faulty):
            for number, name in enumerate(judged.names):
                answered = ""
                if answers.predicted is not None:
                    answered = judged.labels[int(answers.predicted[seed, number])]
                rows.append(
                    {
                        "method": method,
                        "seed": seed,
                        "recording": name,
                        "specimen": judged.specimen[number],
                        "label": judged.labels[int(judged.label[number])],
                        "answer": answered,
                        "faulty": _number_text(float(values[number])),
                    }
                )
    return rows


def _number_text(value: float) -> str:
    """A number; empty where there is none."""
    return "" if math.isnan(value) else f"{value:.6g}"
