"""Scores of novelty for readers: a table a protocol, and what its numbers mean."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnose.scoring.judged import interval_text
from diagnose.studies.novelty import SCORE_LABELS
from diagnose.studies.novelty_metrics import (
    FALSE_ALARMS,
    LEAST_VALIDATION,
    TRUE_POSITIVES,
)
from gensig.text.page import Section, Table

QUESTIONS = {
    "healthy_only": "Is a fault noticed by who knows health alone",
    "open_set": "Is a fault noticed that was never trained on",
}


def novelty_tables(novelty: Mapping[str, Any]) -> list[str]:
    """Markdown: for each protocol one line of what it knows, and the table of its scores."""
    lines: list[str] = []
    for name, result in novelty.items():
        table = _table(result)
        lines += [
            "",
            f"**{name}**: {_what_it_knows(result)}",
            "",
            "| " + " | ".join(table.head) + " |",
        ]
        lines += [
            "|---" * len(table.head) + "|",
            *("| " + " | ".join(row) + " |" for row in table.rows),
        ]
    return lines


def novelty_sections(novelty: Mapping[str, Any]) -> list[Section]:
    """A section of the report for each protocol."""
    return [
        Section(
            title=f"{QUESTIONS[name]} ({name})",
            text=[_what_it_knows(result), *_accuracy(result)],
            table=_table(result),
            notes=_notes(result),
        )
        for name, result in novelty.items()
    ]


def novelty_caveats(novelty: Mapping[str, Any], few_units: int) -> list[str]:
    """What weakens the numbers, one line each."""
    lines = []
    for name, result in novelty.items():
        if (n_units := result["n_units"]["test"]) < few_units:
            lines.append(
                f"{name}: only {n_units} test unit(s); at least {few_units} are advisable."
            )
        if (n_records := result["n_records"]["validation"]) < LEAST_VALIDATION:
            lines.append(
                f"{name}: {n_records} validation record(s); with fewer than {LEAST_VALIDATION} no threshold promises "
                f"{FALSE_ALARMS:.0%} of false alarms, the largest score is taken."
            )
    return lines


def _what_it_knows(result: Mapping[str, Any]) -> str:
    counts, units = result["n_records"], result["n_units"]
    return (
        f"Trained on {counts['train']} records ({', '.join(result['known_classes'])}) of {units['train']} units, "
        f"threshold from {counts['validation']} of {units['validation']}, "
        f"tested on {counts['test']} of {units['test']}; new there: {', '.join(result['novel_classes'])}."
    )


def _accuracy(result: Mapping[str, Any]) -> list[str]:
    if "known" not in result:
        return []
    score, chance = result["known"]["balanced_accuracy"], result["known"]["chance"]
    return [
        f"Balanced accuracy of the network on the known classes: {_cell(score)}, chance {chance:.2f}."
    ]


def _notes(result: Mapping[str, Any]) -> list[tuple[str, str]]:
    notes = [
        (
            "AUROC",
            "how often a new record has a larger score than a known one; chance is 0.50.",
        ),
        (
            "Found",
            f"share of records above a threshold set on validation units for {FALSE_ALARMS:.0%} false alarms.",
        ),
        (
            "False alarms",
            "share of the known records of the test units above it; where it is larger than meant, what is found "
            "flatters.",
        ),
        (
            "Band levels",
            "the flag of diagnose predict. It and the networks see windows as the classifier does.",
        ),
    ]
    if "known" in result:
        for name, method in result["methods"].items():
            areas = [
                f"against {known} {_cell(area)}"
                for known, area in method["auroc_by_known_class"].items()
            ]
            notes.append((f"AUROC of {SCORE_LABELS[name]}", ", ".join(areas) + "."))
        notes.append(
            (
                "FPR95",
                f"share of new records taken for known by the threshold that takes {TRUE_POSITIVES:.0%} of the known "
                f"ones for known; chance is {TRUE_POSITIVES:.2f}, smaller is better.",
            )
        )
    return notes


def _table(result: Mapping[str, Any]) -> Table:
    novel = result["novel_classes"]
    rate = ["fpr95"] if "known" in result else []
    keys = ["auroc", *rate, "false_alarms"]
    heads = {"auroc": "AUROC", "fpr95": "FPR95", "false_alarms": "false alarms"}
    rows = []
    for name, method in result["methods"].items():
        scores = [_cell(method.get(key)) for key in keys]
        found = [_cell(method["found"][label]) for label in novel]
        rows.append([SCORE_LABELS[name], *scores, *found])
    head = [
        "score",
        *(heads[key] for key in keys),
        *(f"{name} found" for name in novel),
    ]
    return Table(head=head, rows=rows)


def _cell(score: Mapping[str, Any] | None) -> str:
    return "-" if score is None else interval_text(score)
