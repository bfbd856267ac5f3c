"""Controls in the report: those that must be at chance, followers of the fault, the oracle."""

from __future__ import annotations

from diagnose.baselines.base import Role
from diagnose.report.methods import (
    baseline_texts,
    control_notes,
    controls_at_chance,
    oracle_labels,
)
from diagnose.report.text import score_cell
from diagnose.scoring.intervals import interval_text, is_above, side_of, too_few_text
from diagnose.studies.result_files import Content
from gensig.text.page import Section, Table

NO_TWINS = (
    "none: the data set holds no healthy twins (dataset.store_healthy_twin=true)."
)


def verdict(method: Content, chance: float) -> str:
    """Verdict on a control that must be at chance."""
    score = method["balanced_accuracy"]
    return {
        None: f"no verdict: {too_few_text(score)}",
        "above": "ABOVE chance: look for a leak",
        "below": "below chance: one interval in forty is, by luck",
        "neither": "at chance",
    }[side_of(score, chance)]


def controls_section(metrics: Content) -> Section:
    """Every control of every clean protocol with its verdict; empty where none ran."""
    rows: list[list[str]] = []
    for protocol, result in metrics["protocols"].items():
        if not result["leaky"]:
            rows += [[protocol, *row] for row in _rows(result, metrics["model"])]
    if not rows:
        return Section(title="Controls")
    labels = [row[1] for row in rows]
    notes = [
        (name, text)
        for name, text in control_notes().items()
        if any(label.startswith(name) for label in labels)
    ]
    if "oracle" not in labels and metrics["settings"]["oracle"] == "auto":
        notes.append(("oracle", NO_TWINS))
    return Section(
        title="Controls",
        text=[
            "What would show that a score has another cause than the fault, and what the signal "
            "holds at best."
        ],
        table=Table(
            head=["protocol", "control", "balanced accuracy", "verdict"], rows=rows
        ),
        notes=notes,
        folded=True,
    )


def _rows(result: Content, model: str) -> list[list[str]]:
    methods = result["methods"]
    chance = methods["chance"]["balanced_accuracy"]
    rows = [
        [label, score_cell(methods[name]), verdict(methods[name], chance)]
        for name, label in controls_at_chance().items()
        if name in methods
    ]
    for text in baseline_texts(Role.FOLLOWER):
        if text.name in methods:
            probe = methods[text.name]
            found = "at chance"
            if is_above(probe["balanced_accuracy"], chance):
                found = "follows the fault"
            rows.append([text.label, score_cell(probe), found])
    if "oracle" not in methods:
        return rows
    oracle, labels = methods["oracle"], oracle_labels(model)
    rows.append(["oracle", score_cell(oracle), f"of {labels[oracle['chosen']]}"])
    for name, label in labels.items():
        if name in methods:
            rows.append([f"oracle, {label}", score_cell(methods[name]), ""])
    share = interval_text(result["over_oracle"]["balanced_accuracy"])
    return [*rows, [f"{model} over oracle", share, oracle_verdict(result)]]


def oracle_verdict(result: Content) -> str:
    """Verdict on the oracle as a bound."""
    if is_above(result["over_oracle"]["balanced_accuracy"], 1):
        return "the oracle was not learnt: no bound here"
    return "share of what the oracle finds"
