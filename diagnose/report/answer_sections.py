"""Sections of the report page on the answers, each with its figure."""

from __future__ import annotations

from pathlib import Path

from diagnose.report.answer_figures import (
    conditions_figure,
    detection_figure,
    graded_classes,
    window_length_figure,
)
from diagnose.scoring.intervals import interval_text
from diagnose.studies.result_files import Content
from gensig.text.page import Section, Table


def answer_sections(folder: Path, clean: Content) -> list[Section]:
    """Sections on detection, conditions, length and comparisons, with figures in the folder.

    Parameters
    ----------
    folder : of the page
    clean : protocol -> its part of ``metrics.json``, without the leaky ones
    """
    answers = {name: result["answers"] for name, result in clean.items()}
    sections = [
        _detection_section(folder, _with_part(answers, "detection")),
        _conditions_section(folder, answers),
        _length_section(folder, _with_part(answers, "window_length")),
        _comparisons_section(answers),
    ]
    return [section for section in sections if section.table or section.notes]


def _with_part(answers: Content, part: str) -> Content:
    return {name: answer for name, answer in answers.items() if part in answer}


def _detection_section(folder: Path, answers: Content) -> Section:
    rows, notes, figures = [], [], []
    for protocol, part in answers.items():
        for method, detection in part["detection"].items():
            alarms = interval_text(detection["false_alarms"])
            for name, result in detection["classes"].items():
                cells = [interval_text(result[key]) for key in ("auroc", "share_found")]
                source = f"{alarms} ({detection['threshold_from']})"
                rows.append([protocol, method, name, *cells, source])
        mine = part["detection"][part["network"]]
        notes += [(protocol, result["summary"]) for result in mine["classes"].values()]
        if mine["missing"]:
            notes.append((protocol, f"No share found: {mine['missing']}."))
        if mine["too_many_false_alarms"]:
            warning = (
                "false alarms are above 5 % here, so that the shares found and the limits are "
                f"too good: {interval_text(mine['false_alarms'])}."
            )
            notes.append((protocol, warning))
        if graded_classes(part):
            picture = f"detection_{protocol}.png"
            detection_figure(folder / picture, part)
            figures.append((picture, f"share found against severity, {protocol}"))
    title = "From what severity a fault is found"
    if not rows:
        return Section(title=title)
    return Section(
        title=title,
        text=[
            "A record counts as found if the odds of any fault against healthy are above a "
            "threshold that is set for 5 % false alarms on validation machines, whatever class "
            "it is then given. AUROC: "
            "chance that a faulty record of the class looks more faulty than a healthy one; 0.5 "
            "is guessing."
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


def _conditions_section(folder: Path, answers: Content) -> Section:
    figures = []
    for protocol, part in answers.items():
        if part["conditions"]["rows"]:
            picture = f"conditions_{protocol}.png"
            conditions_figure(folder / picture, part)
            caption = f"score over each condition, {protocol}; ring: weaker"
            figures.append((picture, caption))
    return Section(
        title="Which condition fails",
        notes=_summaries(answers, "conditions"),
        figures=figures,
    )


def _summaries(answers: Content, key: str) -> list[tuple[str, str]]:
    return [(protocol, part[key]["summary"]) for protocol, part in answers.items()]


def _length_section(folder: Path, answers: Content) -> Section:
    title, picture = "How much signal it needs", "window_length.png"
    if not answers:
        return Section(title=title)
    window_length_figure(folder / picture, answers)
    caption = "score by the length of signal judged, networks as trained"
    return Section(
        title=title,
        notes=_summaries(answers, "window_length"),
        figures=[(picture, caption)],
        folded=True,
    )


def _comparisons_section(answers: Content) -> Section:
    return Section(
        title="Is the network better than the baselines",
        text=[
            "Difference of balanced accuracy on the same test records [95 % interval]; p-value of "
            "swapping both methods machine by machine, or for all machines that share gears or a "
            "gearbox together, corrected for the number of baselines (Holm)."
        ],
        notes=[
            (protocol, f"{row['summary']}.")
            for protocol, part in answers.items()
            for row in part["comparisons"]
        ],
        folded=True,
    )
