"""Sentences, cells and tables of the report out of ``metrics.json``'s parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagnose.report.methods import controls_on_cards, rivals_on_cards
from diagnose.report.novelty_report import novelty_caveats
from diagnose.scoring.judged import interval_text
from diagnose.scoring.metrics import LEAST_UNITS, is_above
from gensig.text.page import Card, Table

FEW_UNITS = 10
CONFUSED = 0.1


def score_cell(method: Mapping[str, Any] | None) -> str:
    """Balanced accuracy with its interval, "-" for a method that was not run."""
    if method is None:
        return "-"
    value = method["balanced_accuracy"]
    if isinstance(value, float):
        return f"{value:.2f}"
    return interval_text(value)


def answer_card(name: str, result: Mapping[str, Any], model: str, meaning: str) -> Card:
    """One protocol's score against chance, the best baseline and the shuffled labels."""
    methods = result["methods"]
    score, chance = (
        methods[model]["balanced_accuracy"],
        methods["chance"]["balanced_accuracy"],
    )
    value, spread = f"{score['mean']:.2f}", _spread(score)
    if result["leaky"]:
        title, meaning = f"{name} (LEAKY)", _sentence(meaning)
        return Card(
            title=title,
            value=value,
            spread=spread,
            verdict="not a result",
            meaning=meaning,
            mark="quiet",
        )
    above = is_above(score, chance)
    verdict = [
        f"{'above chance' if above else 'not distinguishable from chance'} ({chance:.2f})"
    ]
    if score["low"] is None:
        verdict = [f"no verdict against chance ({chance:.2f}): too few machines"]
    elif comparison := _best_rival(methods, score):
        verdict.append(comparison)
    leak = False
    if "oracle" in methods:
        share, best = (
            result["over_oracle"]["balanced_accuracy"],
            methods["oracle"]["balanced_accuracy"],
        )
        verdict.append(
            f"{share['mean']:.2f} ({_spread(share)}) of the oracle ({best['mean']:.2f})"
        )
    for key, control in controls_on_cards().items():
        if key in methods:
            found = methods[key]["balanced_accuracy"]
            above_chance = is_above(found, chance)
            leak |= above_chance
            if found["low"] is None:
                continue
            verdict.append(
                f"{control} ABOVE chance ({found['mean']:.2f}): look for a leak"
                if above_chance
                else f"{control} at chance"
            )
    mark = "good" if above and not leak else "bad"
    text = _sentence(meaning if meaning.startswith("tested") else f"tested {meaning}")
    return Card(
        title=name,
        value=value,
        spread=spread,
        verdict="; ".join(verdict),
        meaning=text,
        mark=mark,
    )


def _best_rival(methods: Mapping[str, Any], score: Mapping[str, Any]) -> str | None:
    """Comparison of the network's score with the best baseline; None where none ran."""
    labels = {
        name: label for name, label in rivals_on_cards().items() if name in methods
    }
    if not labels:
        return None
    means = {name: methods[name]["balanced_accuracy"]["mean"] for name in labels}
    best = max(means, key=lambda name: means[name])
    # an interval that holds the other's mean tells the two apart neither way
    comparison = "not told from"
    if score["low"] > means[best]:
        comparison = "better than"
    elif score["high"] < means[best]:
        comparison = "worse than"
    return f"{comparison} {labels[best]} ({means[best]:.2f})"


def _spread(score: Mapping[str, Any]) -> str:
    return (
        "too few machines"
        if score["low"] is None
        else f"{score['low']:.2f} to {score['high']:.2f}"
    )


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def recall_table(
    clean: Mapping[str, Any], model: str, class_names: Sequence[str]
) -> Table:
    """Recall by class, a row a protocol."""
    shares = {
        name: result["methods"][model]["recall"] for name, result in clean.items()
    }
    rows = [
        [
            name,
            *(
                f"{share[label]:.2f}" if label in share else "-"
                for label in class_names
            ),
        ]
        for name, share in shares.items()
    ]
    return Table(head=["protocol", *class_names], rows=rows)


def confusions(confusion: Sequence[Sequence[int]], class_names: Sequence[str]) -> str:
    """The largest off-diagonal shares, at most three."""
    found = []
    for true, row in enumerate(confusion):
        total = max(int(np.sum(row)), 1)
        for predicted, count in enumerate(row):
            if true != predicted and count / total >= CONFUSED:
                found.append((count / total, class_names[true], class_names[predicted]))
    if not found:
        return (
            f"no class is taken for another in {CONFUSED:.0%} of its records or more."
        )
    return (
        "; ".join(
            f"{a} taken for {b} ({share:.0%})"
            for share, a, b in sorted(found, reverse=True)[:3]
        )
        + "."
    )


def trust_table(clean: Mapping[str, Any]) -> Table:
    """Calibration and the choice of the epoch, a row a protocol."""
    rows = []
    for name, result in clean.items():
        calibration, last = result["calibration"], result["last_epoch"]
        before, after = (
            {
                key: np.mean(calibration[when][key])
                for key in ("expected_calibration_error", "cross_entropy")
            }
            for when in ("before", "after")
        )
        rows.append(
            [
                name,
                f"{before['expected_calibration_error']:.3f}, {after['expected_calibration_error']:.3f} "
                f"({np.mean(calibration['after']['error_by_chance']):.3f})",
                f"{before['cross_entropy']:.3f}, {after['cross_entropy']:.3f}",
                _several(calibration["temperature"], ".2f"),
                _several(result["best_epoch"], "d"),
                _several(last["epoch"], "d"),
                score_cell(last),
            ]
        )
    head = (
        "protocol",
        "calibration error before, after (chance)",
        "cross-entropy before, after",
        "temperature",
        "best epoch",
        "last epoch",
        "score of the last",
    )
    return Table(head=head, rows=rows)


def few_machines(n_units: int) -> str:
    """Why there is no interval."""
    return (
        f"{n_units} test unit(s) are too few machines for an interval, {LEAST_UNITS} are the least and {FEW_UNITS} "
        "advisable: a score of so few says little of others."
    )


def caveats(metrics: Mapping[str, Any]) -> list[str]:
    """What a reader must know before using the scores."""
    lines = [
        "Simulated vibration. A score here says nothing yet about measured machines."
    ]
    for name, result in metrics["protocols"].items():
        n_units = result["n_units"]["test"]
        if n_units < LEAST_UNITS:
            lines.append(f"{name}: {few_machines(n_units)}")
        elif n_units < FEW_UNITS and not result["leaky"]:
            lines.append(
                f"{name}: only {n_units} test unit(s). The interval shows the spread of these units and is too "
                f"narrow for new ones; at least {FEW_UNITS} are advisable."
            )
    lines += novelty_caveats(metrics["novelty"], FEW_UNITS)
    if metrics["settings"]["normalise"] == "rms":
        lines.append(
            "The network sees windows without their level, the indicators with it unless stated; "
            "normalise=none gives the level to the network too."
        )
    lines += [
        f"{name} is left out: {reason}."
        for name, reason in metrics["protocols_left_out"].items()
    ]
    if metrics["n_records_unusable"]:
        lines.append(
            f"{metrics['n_records_unusable']} record(s) failed in simulation and are left out."
        )
    return lines


def _several(values: Sequence[float], form: str) -> str:
    """One value a seed."""
    return ", ".join(format(value, form) for value in values)
