"""The result of a study.

``metrics.json`` for programs, figures, and one HTML page that is understood in a minute.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from diagnose.data.protocols import MEANING
from diagnose.report.answer_sections import answer_sections
from diagnose.report.answer_tables import write_tables
from diagnose.report.control_sections import controls_section
from diagnose.report.figures import confusion_figure, reliability_figure, scores_figure
from diagnose.report.methods import explained_methods, score_columns
from diagnose.report.novelty_report import novelty_sections
from diagnose.report.text import (
    answer_card,
    caveats,
    confusions,
    few_machines,
    recall_table,
    score_cell,
    trust_table,
)
from diagnose.scoring.metrics import LEAST_UNITS
from diagnose.training.heads import heads_notes
from gensig.text.page import Section, Table, write_page

LEAKY_MEANING = (
    "windows of one record on both sides of the split, as in many papers. It shows how much a careless split flatters; "
    "it is no measure of diagnosis"
)


def write_report(folder: Path, metrics: Mapping[str, Any]) -> Path:
    """Write ``metrics.json``, the figures and ``report.html`` and return the page."""
    (folder / "metrics.json").write_text(
        json.dumps(metrics, indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    write_tables(folder, metrics)
    page = folder / "report.html"
    write_page(
        page,
        title="Which faults can be told apart",
        lead=_lead(metrics),
        sections=_sections(folder, metrics),
    )
    return page


def result_table(metrics: Mapping[str, Any]) -> list[str]:
    """Markdown table of protocol x method.

    Balanced accuracy with its 95 % interval, leaky protocols last.
    """
    if not metrics["protocols"]:
        return []
    table = _score_table(metrics)
    lines = ["| " + " | ".join(table.head) + " |", "|---" * len(table.head) + "|"]
    for number, (name, *cells) in enumerate(table.rows):
        label = (
            f"*{name}* (LEAKY: not a result)"
            if number in table.quiet
            else f"**{name}**"
        )
        lines.append("| " + " | ".join([label, *cells]) + " |")
    return lines


def without_interval(metrics: Mapping[str, Any]) -> list[str]:
    """Why scores stand there without an interval, once, and of which protocols."""
    units = {
        name: one["n_units"]["test"]
        for name, one in {**metrics["protocols"], **metrics["novelty"]}.items()
    }
    few = {name: n_units for name, n_units in units.items() if n_units < LEAST_UNITS}
    return [f"{', '.join(few)}: {few_machines(min(few.values()))}"] if few else []


def _score_table(metrics: Mapping[str, Any]) -> Table:
    results = sorted(metrics["protocols"].items(), key=lambda item: item[1]["leaky"])
    columns = score_columns(metrics["model"])
    shown = [
        key for key in columns if any(key in result["methods"] for _, result in results)
    ]
    return Table(
        head=["protocol", *(columns[key] for key in shown)],
        rows=[
            [name, *(score_cell(result["methods"].get(key)) for key in shown)]
            for name, result in results
        ],
        quiet=[number for number, (_, result) in enumerate(results) if result["leaky"]],
    )


def _lead(metrics: Mapping[str, Any]) -> list[str]:
    settings = metrics["settings"]
    window_ms = 1e3 * settings["window_samples"] / metrics["sampling_rate_hz"]
    level = (
        "level kept"
        if settings["normalise"] == "none"
        else "level removed (RMS-normalised)"
    )
    return [
        f"Data: {metrics['data']}, {metrics['n_records']} records, classes {', '.join(metrics['class_names'])}; "
        f"channels {', '.join(metrics['channel_names'])} at {metrics['sampling_rate_hz']:g} Hz.",
        f"Network: {metrics['model']} on windows of {window_ms:.0f} ms, {level}, {len(settings['seeds'])} seed(s). "
        f"gensig {metrics['environment']['gensig']}, {metrics['environment']['finished']}.",
    ]


def _sections(folder: Path, metrics: Mapping[str, Any]) -> list[Section]:
    ordered = sorted(metrics["protocols"].items(), key=lambda item: item[1]["leaky"])
    clean = {name: result for name, result in ordered if not result["leaky"]}
    sections = []
    if ordered:
        sections += _score_sections(folder, metrics, ordered)
    if clean:
        sections.append(_fault_section(folder, clean, metrics))
        sections += answer_sections(folder, clean)
    sections += novelty_sections(metrics["novelty"])
    if ordered:
        sections.append(controls_section(metrics))
    sections.append(
        Section(title="Caveats", notes=[("", line) for line in caveats(metrics)])
    )
    if ordered:
        sections.append(_meaning_section(metrics, clean))
    if clean:
        sections.append(_trust_section(folder, clean))
    sections.append(_confusion_section(folder, metrics, ordered))
    sections.append(
        Section(
            title="Files beside this page",
            notes=[
                (
                    "metrics.json",
                    "everything in numbers, with macro-F1, recall, calibration, settings and versions.",
                ),
                ("predictions.csv", "what each method said of each test record."),
                (
                    "scores.csv and more",
                    "the same numbers as tables, explained in docs/howto/report.md.",
                ),
                *(
                    [("novelty.csv", "each score of novelty of each test record.")]
                    if metrics["novelty"]
                    else []
                ),
                (
                    "models/",
                    "the networks, one folder each, for diagnose evaluate and diagnose predict.",
                ),
            ],
            folded=True,
        )
    )
    return [
        section
        for section in sections
        if section.text or section.table or section.notes or section.figures
    ]


def _score_sections(
    folder: Path, metrics: Mapping[str, Any], ordered: Sequence[tuple[str, Any]]
) -> list[Section]:
    model = metrics["model"]
    return [
        Section(
            title="In short",
            text=[
                "Balanced accuracy of the network over test records: the mean share recognised of each class."
            ],
            cards=[
                answer_card(
                    name,
                    result,
                    model,
                    LEAKY_MEANING if result["leaky"] else MEANING[name],
                )
                for name, result in ordered
            ],
        ),
        Section(
            title="Network, baselines and controls",
            text=[
                "Mean over the seeds [95 % interval over test units, so over machines, not windows]."
            ],
            table=_score_table(metrics),
            figures=_figures(
                folder,
                "scores.png",
                "scores and intervals; dotted: chance",
                scores_figure,
                metrics,
            ),
        ),
    ]


def _meaning_section(metrics: Mapping[str, Any], clean: Mapping[str, Any]) -> Section:
    return Section(
        title="What the numbers mean",
        notes=[
            (
                "A record's label",
                "the class with the largest mean log-probability over its windows.",
            ),
            *[
                (name, f"{MEANING[name]}{_sensors(result)}.")
                for name, result in clean.items()
            ],
            ("LEAKY", f"{LEAKY_MEANING}."),
            *_explanations(metrics),
        ],
        folded=True,
    )


def _explanations(metrics: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and meaning of every method beside the network that ran."""
    shown = [text for text in explained_methods() if _has(metrics, text.name)]
    return [(text.label, text.meaning) for text in shown]


def _fault_section(
    folder: Path, clean: Mapping[str, Any], metrics: Mapping[str, Any]
) -> Section:
    model, names = metrics["model"], metrics["class_names"]
    return Section(
        title="Which faults are found",
        text=[f"Share of the test records of each class that {model} recognises."],
        table=recall_table(clean, model, names),
        notes=[
            *(
                (name, confusions(result["methods"][model]["confusion"], names))
                for name, result in clean.items()
            ),
            *heads_notes(clean),
        ],
    )


def _trust_section(folder: Path, clean: Mapping[str, Any]) -> Section:
    calibration = {name: result["calibration"] for name, result in clean.items()}
    return Section(
        title="What its probabilities are worth",
        text=[
            "One temperature a network, fitted on the records of its validation units, brings the probabilities of "
            "records nearer to the share that is right; it changes no label. Calibration error: mean distance between "
            "the two over test records, and what such probabilities would have by chance if they were all true. "
            "Cross-entropy: smaller is better. The network is the one of its best epoch on validation units; the score "
            "of its last epoch stands beside."
        ],
        table=trust_table(clean),
        figures=_figures(
            folder,
            "reliability.png",
            "share right against probability",
            reliability_figure,
            calibration,
        ),
        folded=True,
    )


def _confusion_section(
    folder: Path, metrics: Mapping[str, Any], ordered: Sequence[tuple[str, Any]]
) -> Section:
    figures = []
    for name, result in ordered:
        title = f"{metrics['model']}, {name}" + (" (LEAKY)" if result["leaky"] else "")
        confusion = result["methods"][metrics["model"]]["confusion"]
        confusion_figure(
            folder / f"confusion_{name}.png", confusion, metrics["class_names"], title
        )
        figures.append((f"confusion_{name}.png", title))
    return Section(
        title="Confusion matrices", figures=figures, side_by_side=True, folded=True
    )


def _figures(
    folder: Path, name: str, caption: str, draw: Any, content: Any
) -> list[tuple[str, str]]:
    """Draw one figure into the folder, for the page to show."""
    draw(folder / name, content)
    return [(name, caption)]


def _sensors(result: Mapping[str, Any]) -> str:
    """Which channels, where the test has others than the training."""
    trained, tested = (
        ", ".join(result["channels"][subset]) for subset in ("train", "test")
    )
    return "" if trained == tested else f": trained on {trained}, tested on {tested}"


def _has(metrics: Mapping[str, Any], method: str) -> bool:
    return any(method in result["methods"] for result in metrics["protocols"].values())
