"""Scores of novelty for readers: a table a protocol with notes on its numbers."""

from __future__ import annotations

from diagnose.report.text import shown
from diagnose.scoring.alarms import FALSE_ALARMS
from diagnose.scoring.intervals import drawn_text, interval_text
from diagnose.studies.novelty import SCORE_LABELS
from diagnose.studies.novelty_metrics import TRUE_POSITIVES
from diagnose.studies.result_files import Content
from gensig.text.markdown import table_lines
from gensig.text.page import Section, Table

QUESTIONS = {
    "healthy_only": "Is a fault noticed by who knows health alone",
    "open_set": "Is a fault noticed that was never trained on",
}
HEADS = {"auroc": "AUROC", "fpr95": "FPR95", "false_alarms": "false alarms"}
MEANINGS = {
    "AUROC": "how often a new record has a larger score than a known one; chance is 0.50.",
    "Found": "share of records above a threshold set on validation machines for "
    f"{FALSE_ALARMS:.0%} false alarms.",
    "False alarms": "share of the known records of the test machines above it; where it is larger "
    "than meant, what is found flatters.",
    "Band levels": "the flag of diagnose predict. It and the networks see windows as the "
    "classifier does.",
}


def novelty_tables(novelty: Content) -> list[str]:
    """Markdown: for each protocol one line on its parts, and the table of its scores."""
    lines: list[str] = []
    for name, result in novelty.items():
        table = _table(result)
        lines += ["", f"**{name}**: {_parts_sentence(result)}", ""]
        lines += table_lines(table.head, table.rows)
    return lines


def novelty_sections(novelty: Content) -> list[Section]:
    """A section of the report for each protocol."""
    return [
        Section(
            title=f"{QUESTIONS[name]} ({name})",
            text=[_parts_sentence(result), *_accuracy(result)],
            table=_table(result),
            notes=_notes(result),
        )
        for name, result in novelty.items()
    ]


def _parts_sentence(result: Content) -> str:
    """Records and units of each part, known and new classes."""
    counts, units = result["n_records"], result["n_units"]
    return (
        f"Trained on {counts['train']} records ({', '.join(result['known_classes'])}) "
        f"of {units['train']} machines, "
        f"threshold from {counts['validation']} of {units['validation']}, "
        f"tested on {counts['test']} of {units['test']}; "
        f"new there: {', '.join(result['novel_classes'])}. "
        f"In brackets 95 % over {drawn_text(result['resampled'])} and seeds."
    )


def _accuracy(result: Content) -> list[str]:
    if "known" not in result:
        return []
    score = interval_text(result["known"]["balanced_accuracy"])
    return [
        f"Balanced accuracy of the network on the known classes: {score}, "
        f"chance {result['known']['chance']:.2f}."
    ]


def _notes(result: Content) -> list[tuple[str, str]]:
    notes = [*MEANINGS.items()]
    if "known" not in result:
        return notes
    for name, method in result["methods"].items():
        areas = method["auroc_by_known_class"].items()
        texts = [f"against {known} {interval_text(area)}" for known, area in areas]
        notes.append((f"AUROC of {SCORE_LABELS[name]}", f"{', '.join(texts)}."))
    rate = (
        "share of new records taken for known by the threshold that takes "
        f"{TRUE_POSITIVES:.0%} of the known ones for known; chance is {TRUE_POSITIVES:.2f}, "
        "smaller is better."
    )
    return [*notes, ("FPR95", rate)]


def _table(result: Content) -> Table:
    novel = result["novel_classes"]
    keys = [key for key in HEADS if key != "fpr95" or "known" in result]
    rows = []
    for name, method in result["methods"].items():
        scores = [method.get(key) for key in keys]
        scores += [method["found"][label] for label in novel]
        rows.append([SCORE_LABELS[name], *map(shown, scores)])
    head = [*(HEADS[key] for key in keys), *(f"{name} found" for name in novel)]
    return Table(head=["score", *head], rows=rows)
