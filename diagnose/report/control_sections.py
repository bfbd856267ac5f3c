"""The controls in the report: what must be at chance, what may not be, and how near the network is to the oracle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnose.report.text import METHODS, score_cell
from diagnose.scoring.judged import interval_text
from diagnose.scoring.metrics import is_above
from gensig.text.page import Section, Table

# In the order of the rows; of these chance must lie in the interval.
AT_CHANCE = {
    "label_shuffle": "label shuffle",
    "metadata_probe": "metadata probe",
    "sham": "sham, network",
    "sham_indicators": "sham, indicators",
    "sham_indicators_without_level": "sham, indicators without RMS",
    "sham_rms_threshold": "sham, RMS threshold",
    "sham_nearest_spectrum": "sham, 1-NN on spectra",
    "sham_minirocket": "sham, MiniRocket",
}
MEANING = {
    "metadata probe": "gradient boosting on what row and place of a record tell without its signal: set speed and "
    "torque, actual speed, noise, unit, start, order in the file. Above chance: something leaks.",
    "result probe": "the same with what only the simulation knows of a record, such as its integration error. A fault "
    "changes the motion and may so change these: they are no input of a classifier.",
    "sham": "the same trainings on a data set of severity zero whose labels were kept. Above chance: something other "
    "than the fault tells the class.",
    "oracle": "the better, on validation units, of the same network and of a model on indicators, both given the "
    "record's healthy twin in as much noise. What it finds is in the signal; it is a bound for those who do not know "
    "how this machine sounds when healthy, as far as these two can learn, not of what any detector could find.",
}


def verdict(method: Mapping[str, Any], chance: float) -> str:
    """What a control that must be at chance says."""
    score = method["balanced_accuracy"]
    if score["low"] is None:
        return "no verdict: too few machines"
    if score["low"] > chance:
        return "ABOVE chance: look for a leak"
    return "at chance" if score["high"] >= chance else "below chance: one interval in forty is, by luck"


def controls_section(metrics: Mapping[str, Any]) -> Section:
    """Every control of every clean protocol with its verdict; empty where none ran."""
    rows: list[list[str]] = []
    for protocol, result in metrics["protocols"].items():
        if not result["leaky"]:
            rows += [[protocol, *row] for row in _rows(result, metrics["model"])]
    if not rows:
        return Section(title="Controls")
    notes = [(name, text) for name, text in MEANING.items() if any(row[1].startswith(name) for row in rows)]
    if not any(row[1].startswith("oracle") for row in rows) and metrics["settings"]["oracle"] == "auto":
        notes.append(("oracle", "none: the data set holds no healthy twins (dataset.store_healthy_twin=true)."))
    return Section(
        title="Controls",
        text=["What would show that a score has another cause than the fault, and what the signal holds at best."],
        table=Table(head=["protocol", "control", "balanced accuracy", "verdict"], rows=rows),
        notes=notes,
        folded=True,
    )


def _rows(result: Mapping[str, Any], model: str) -> list[list[str]]:
    methods = result["methods"]
    chance = methods["chance"]["balanced_accuracy"]
    rows = [
        [name, score_cell(methods[key]), verdict(methods[key], chance)]
        for key, name in AT_CHANCE.items()
        if key in methods
    ]
    if "result_probe" in methods:
        probe = methods["result_probe"]
        found = "follows the fault" if is_above(probe["balanced_accuracy"], chance) else "at chance"
        rows.append(["result probe", score_cell(probe), found])
    if "oracle" in methods:
        chosen = {"oracle_network": model, "oracle_indicators": METHODS["indicators"]}
        rows.append(["oracle", score_cell(methods["oracle"]), f"of {chosen[methods['oracle']['chosen']]}"])
        rows += [[f"oracle, {name}", score_cell(methods[key]), ""] for key, name in chosen.items() if key in methods]
        rows.append([f"{model} over oracle", oracle_share(result), oracle_verdict(result)])
    return rows


def oracle_share(result: Mapping[str, Any]) -> str:
    """The network's score over the oracle's, with its interval."""
    return interval_text(result["over_oracle"]["balanced_accuracy"])


def oracle_verdict(result: Mapping[str, Any]) -> str:
    """Whether the oracle was a bound here."""
    share = result["over_oracle"]["balanced_accuracy"]
    return "the oracle was not learnt: no bound here" if is_above(share, 1) else "share of what the oracle finds"
