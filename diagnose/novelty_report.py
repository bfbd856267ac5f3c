"""Scores of novelty for readers: a table a protocol, and what its numbers mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnose.novelty_metrics import FALSE_ALARMS, LEAST_VALIDATION, TRUE_POSITIVES

METHODS = {
    "nearest_indicators": "5th neighbour, indicators",
    "nearest_indicators_without_level": "5th neighbour, indicators without RMS",
    "forest_indicators": "isolation forest, indicators",
    "forest_indicators_without_level": "isolation forest, indicators without RMS",
    "nearest_band_levels": "5th neighbour, band levels",
    "autoencoder": "autoencoder",
    "largest_probability": "1 - largest probability",
    "energy": "energy",
    "nearest_features": "5th neighbour, network's features",
}


def novelty_tables(novelty: Mapping[str, Any]) -> list[str]:
    """Markdown: for each protocol one line of what it knows, and the table of its scores."""
    lines: list[str] = []
    for name, result in novelty.items():
        lines += ["", f"**{name}**: {_what_it_knows(result)}", "", *_table(result)]
    return lines


def novelty_section(novelty: Mapping[str, Any]) -> list[str]:
    """Section of the report, empty without such a protocol; ends with an empty line."""
    if not novelty:
        return []
    lines = ["## Is what was never trained on noticed", *novelty_tables(novelty), ""]
    for name, result in novelty.items():
        if "known" in result:
            score, chance = result["known"]["balanced_accuracy"], result["known"]["chance"]
            lines += [f"Balanced accuracy of {name} on the known classes: {_cell(score)}, chance {chance:.2f}.", ""]
    lines += [
        f"- **AUROC**: how often a new record has a larger score than a known one; chance is 0.5. **Found**: share of "
        f"the records above the threshold, which is set on validation units for {FALSE_ALARMS:.0%} of false alarms. "
        "**False alarms**: the share of known records of the test units that are above it; where it is larger than "
        "meant, the found share flatters.",
    ]
    if any("known" in result for result in novelty.values()):
        lines.append(
            f"- **FPR95**: share of new records taken for known by the threshold that takes {TRUE_POSITIVES:.0%} of "
            f"the known ones for known; chance is {TRUE_POSITIVES:.2f}, smaller is better."
        )
    lines.append(
        "- **band levels**: the flag of `diagnose predict`. It and the networks see windows as the classifier does. "
        "How each score is made: docs/howto/novelty.md."
    )
    return [*lines, ""]


def novelty_caveats(novelty: Mapping[str, Any], few_units: int) -> list[str]:
    """What weakens the numbers, one line each."""
    lines = []
    for name, result in novelty.items():
        if (n_units := result["n_units"]["test"]) < few_units:
            lines.append(f"- {name}: only {n_units} test unit(s); at least {few_units} are advisable.")
        if (n_records := result["n_records"]["validation"]) < LEAST_VALIDATION:
            lines.append(
                f"- {name}: {n_records} validation record(s); with fewer than {LEAST_VALIDATION} no threshold promises "
                f"{FALSE_ALARMS:.0%} of false alarms, the largest score is taken."
            )
    return lines


def _what_it_knows(result: Mapping[str, Any]) -> str:
    counts, units = result["n_records"], result["n_units"]
    return (
        f"trained on {counts['train']} records ({_names(result['known_classes'])}) of {units['train']} units, "
        f"threshold from {counts['validation']} of {units['validation']}, tested on {counts['test']} of {units['test']}"
        f"; new there: {_names(result['novel_classes'])}."
    )


def _table(result: Mapping[str, Any]) -> list[str]:
    novel = result["novel_classes"]
    with_rate = any("fpr95" in method for method in result["methods"].values())
    columns = ["score", "AUROC", *(["FPR95"] if with_rate else []), "false alarms"]
    columns += [f"{_names([name])} found" for name in novel]
    lines = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    for key, method in result["methods"].items():
        cells = [METHODS[key], _cell(method["auroc"])]
        cells += [_cell(method.get("fpr95"))] if with_rate else []
        cells += [_cell(method["false_alarms"]), *(_cell(method["found"][name]) for name in novel)]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _cell(score: Mapping[str, Any] | None) -> str:
    return "-" if score is None else f"{score['mean']:.2f} [{score['low']:.2f}, {score['high']:.2f}]"


def _names(names: Sequence[str]) -> str:
    """Names from a file without what Markdown or HTML would act on."""
    return ", ".join("".join(c if c.isalnum() or c in " _-." else "?" for c in name) for name in names)
