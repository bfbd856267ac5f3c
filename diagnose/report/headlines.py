"""First figures of a study: an unknown machine, without and with a healthy record of its own."""

from __future__ import annotations

from diagnose.data.protocols import NEW_MACHINE
from diagnose.report.methods import CHANCE, REFERENCE_TEXT
from diagnose.scoring.intervals import interval_text
from diagnose.studies.protocol_results import main_protocol
from diagnose.studies.result_files import Content
from diagnose.studies.verdicts import failed_controls

UNKNOWN_MACHINE = "unknown machine"
CONDITIONS = {
    "other_condition": "from another condition",
    "same_condition": "at the same condition",
}


def headline_protocol(metrics: Content) -> str | None:
    """Protocol of the headlines; without one of new machines the first that is not leaky."""
    return main_protocol(metrics["protocols"])


def headlines(metrics: Content) -> list[str]:
    """Lines with both scores and their intervals; empty where no new machines were tested."""
    result = metrics["protocols"].get(NEW_MACHINE)
    if result is None:
        return []
    methods = result["methods"]
    failed = failed_controls(result, metrics["model"])
    if failed:
        return [f"{UNKNOWN_MACHINE}: no score, a control failed: {failed}"]
    chance = f"chance {methods[CHANCE]['balanced_accuracy']:.2f}"
    network = interval_text(methods[metrics["model"]]["balanced_accuracy"])
    lines = [f"{UNKNOWN_MACHINE}: balanced accuracy {network}, {chance}"]
    if failed := failed_controls(result, REFERENCE_TEXT.name):
        lines.append(
            f"{UNKNOWN_MACHINE} with a healthy record: no score, a control failed: {failed}"
        )
    elif REFERENCE_TEXT.name in methods:
        score = interval_text(methods[REFERENCE_TEXT.name]["balanced_accuracy"])
        condition = CONDITIONS[metrics["settings"]["reference"]]
        lines.append(
            f"{UNKNOWN_MACHINE} with one healthy record of its own {condition}: "
            f"balanced accuracy {score}, {chance}"
        )
    return lines
