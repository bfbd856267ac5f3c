"""Sections of the report page that say what the answers mean, each with its figure."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from diagnose.report.answer_figures import (
    conditions_figure,
    detection_figure,
    graded_classes,
    window_length_figure,
)
from diagnose.scoring.judged import interval_text
from gensig.text.page import Section, Table


def answer_sections(folder: Path, clean: Mapping[str, Any]) -> list[Section]:
    """Sections on detection, conditions, length and comparisons; draws their figures into the
    folder.

    Parameters
    ----------
    folder : of the page
    clean : protocol -> its part of ``metrics.json``, without the leaky ones
    """
    answers = {name: result["answers"] for name, result in clean.items()}
    sections = [
        _detection_section(
            folder,
            {name: part for name, part in answers.items() if "detection" in part},
        ),
        _conditions_section(folder, answers),
        _length_section(
            folder,
            {name: part for name, part in answers.items() if "window_length" in part},
        ),
        _comparisons_section(answers),
    ]
    return [section for section in sections if section.table or section.notes]


def _detection_section(folder: Path, answers: Mapping[str, Any]) -> Section:
    rows, notes, figures = [], [], []
    for protocol, part in answers.items():
        for method, detection in part["detection"].items():
            alarms = (
                interval_text(detection["false_alarms"])
                + f" ({detection['threshold_from']})"
            )
            for name, found in detection["classes"].items():
                auroc, share = (
                    interval_text(found["auroc"]),
                    interval_text(found["share_found"]),
                )
                rows.append([protocol, method, name, auroc, share, alarms])
        mine = part["detection"][part["network"]]
        notes += [(protocol, found["summary"]) for found in mine["classes"].values()]
        if mine["too_many_false_alarms"]:
            warning = "false alarms are above 5 % here, so that the shares found and the limits are too good"
            notes.append(
                (protocol, f"{warning}: {interval_text(mine['false_alarms'])}.")
            )
        if graded_classes(part):
            detection_figure(folder / f"detection_{protocol}.png", part)
            figures.append(
                (
                    f"detection_{protocol}.png",
                    f"share found against severity, {protocol}",
                )
            )
    if not rows:
        return Section(title="From what severity a fault is found")
    return Section(
        title="From what severity a fault is found",
        text=[
            "A record counts as found if the odds of any fault against healthy are above a threshold that is set for "
            "5 % false alarms, whatever class it is then given. AUROC: chance that a faulty record of the class looks "
            "more faulty than a healthy one; 0.5 is guessing."
        ],
        table=Table(
            head=[
                "protocol",
                "method",
                "class",
                "AUROC",
                "share found",
                "false alarms",
            ],
            rows=rows,
        ),
        notes=notes,
        figures=figures,
    )


def _conditions_section(folder: Path, answers: Mapping[str, Any]) -> Section:
    figures = []
    for protocol, part in answers.items():
        if part["conditions"]["rows"]:
            conditions_figure(folder / f"conditions_{protocol}.png", part)
            figures.append(
                (
                    f"conditions_{protocol}.png",
                    f"score over each condition, {protocol}; ring: weaker",
                )
            )
    return Section(
        title="Which condition fails",
        notes=[
            (protocol, part["conditions"]["summary"])
            for protocol, part in answers.items()
        ],
        figures=figures,
    )


def _length_section(folder: Path, answers: Mapping[str, Any]) -> Section:
    if not answers:
        return Section(title="How much signal it needs")
    window_length_figure(folder / "window_length.png", answers)
    return Section(
        title="How much signal it needs",
        notes=[
            (protocol, part["window_length"]["summary"])
            for protocol, part in answers.items()
        ],
        figures=[
            (
                "window_length.png",
                "score by the length of signal judged, networks as trained",
            )
        ],
        folded=True,
    )


def _comparisons_section(answers: Mapping[str, Any]) -> Section:
    return Section(
        title="Is the network better than the baselines",
        text=[
            "Difference of balanced accuracy on the same test units [95 % interval]; p-value of swapping both methods "
            "unit by unit, corrected for the number of baselines (Holm)."
        ],
        notes=[
            (protocol, f"{row['summary']}.")
            for protocol, part in answers.items()
            for row in part["comparisons"]
        ],
        folded=True,
    )
