"""The controls in the report.

What must be at chance, what may not be, and how near the network is to the oracle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnose.baselines.base import Role
from diagnose.report.methods import (
    baseline_texts,
    control_notes,
    controls_at_chance,
    oracle_labels,
)
from diagnose.report.text import score_cell
from diagnose.scoring.judged import interval_text
from diagnose.scoring.metrics import is_above
from gensig.text.page import Section, Table


def verdict(method: Mapping[str, Any], chance: float) -> str:
    """What a control that must be at chance says."""
    score = method["balanced_accuracy"]
    if score["low"] is None:
        return "no verdict: too few machines"
    if score["low"] > chance:
        return "ABOVE chance: look for a leak"
    return (
        "at chance"
        if score["high"] >= chance
        else "below chance: one interval in forty is, by luck"
    )


def controls_section(metrics: Mapping[str, Any]) -> Section:
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
        if _explains(name, labels)
    ]
    if not _explains("oracle", labels) and metrics["settings"]["oracle"] == "auto":
        notes.append(
            (
                "oracle",
                "none: the data set holds no healthy twins (dataset.store_healthy_twin=true).",
            )
        )
    return Section(
        title="Controls",
        text=[
            "What would show that a score has another cause than the fault, and what the signal holds at best."
        ],
        table=Table(
            head=["protocol", "control", "balanced accuracy", "verdict"], rows=rows
        ),
        notes=notes,
        folded=True,
    )


def _explains(name: str, labels: Sequence[str]) -> bool:
    """Whether a note is of one of the rows with these labels."""
    return any(label.startswith(name) for label in labels)


def _rows(result: Mapping[str, Any], model: str) -> list[list[str]]:
    methods = result["methods"]
    chance = methods["chance"]["balanced_accuracy"]
    rows = [
        [name, score_cell(methods[key]), verdict(methods[key], chance)]
        for key, name in controls_at_chance().items()
        if key in methods
    ]
    for text in baseline_texts(Role.FOLLOWER):
        if text.name in methods:
            probe = methods[text.name]
            above = is_above(probe["balanced_accuracy"], chance)
            found = "follows the fault" if above else "at chance"
            rows.append([text.label, score_cell(probe), found])
    if "oracle" in methods:
        chosen = oracle_labels(model)
        rows.append(
            [
                "oracle",
                score_cell(methods["oracle"]),
                f"of {chosen[methods['oracle']['chosen']]}",
            ]
        )
        rows += [
            [f"oracle, {name}", score_cell(methods[key]), ""]
            for key, name in chosen.items()
            if key in methods
        ]
        rows.append(
            [f"{model} over oracle", oracle_share(result), oracle_verdict(result)]
        )
    return rows


def oracle_share(result: Mapping[str, Any]) -> str:
    """The network's score over the oracle's, with its interval."""
    return interval_text(result["over_oracle"]["balanced_accuracy"])


def oracle_verdict(result: Mapping[str, Any]) -> str:
    """Whether the oracle was a bound here."""
    share = result["over_oracle"]["balanced_accuracy"]
    return (
        "the oracle was not learnt: no bound here"
        if is_above(share, 1)
        else "share of what the oracle finds"
    )
