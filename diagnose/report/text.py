"""Sentences, cells and tables of the report out of ``metrics.json``'s parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagnose.report.novelty_report import novelty_caveats
from diagnose.scoring.judged import interval_text
from diagnose.scoring.metrics import LEAST_UNITS, is_above
from gensig.text.page import Card, Table

FEW_UNITS = 10
CONFUSED = 0.1
# Methods beside the network, in the order of the columns, as readers see them.
METHODS = {
    "indicators": "indicators",
    "indicators_without_level": "indicators without RMS",
    "rms_threshold": "RMS threshold",
    "nearest_spectrum": "1-NN on spectra",
    "minirocket": "MiniRocket",
    "reference": "against a sound record",
    "level_kept": "network with RMS",
    "oracle": "oracle",
    "label_shuffle": "label shuffle",
    "sham": "sham",
    "chance": "chance",
}
RIVALS = ("indicators", "rms_threshold", "nearest_spectrum", "minirocket")
MUST_BE_AT_CHANCE = {"label_shuffle": "label shuffle", "metadata_probe": "metadata", "sham": "sham"}
METHOD_MEANING = {
    "indicators": "logistic regression or gradient boosting (chosen on validation units) on RMS, kurtosis, crest "
    "factor, FM4 and sideband ratio of every channel over the whole stretch of signal; it knows the speed and the "
    "tooth counts.",
    "rms_threshold": "thresholds on the level alone.",
    "nearest_spectrum": "the class of the training signal with the nearest log-magnitude spectrum, mean over the "
    "windows.",
    "minirocket": "ridge regression on the shares of positive values of fixed convolutions (Dempster et al. 2021), "
    "mean over the windows; the penalty is chosen on validation units.",
    "reference": "logistic regression or gradient boosting (chosen on validation units) on which tooth is louder or "
    "quieter than in a sound record of the same machine; it is given that record, which the others are not.",
    "level_kept": "the same network on windows in m/s^2, their level not removed.",
    "oracle": "the better of two models that are given each record's healthy twin; see Controls.",
    "sham": "the same training on a data set of severity zero whose labels were kept; see Controls.",
    "label_shuffle": "the same training on shuffled labels. Chance must lie in its interval, which covers the units "
    "and the luck of the shuffle; if it lies below, something leaks.",
}


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
    score, chance = methods[model]["balanced_accuracy"], methods["chance"]["balanced_accuracy"]
    value, spread = f"{score['mean']:.2f}", _spread(score)
    if result["leaky"]:
        title, meaning = f"{name} (LEAKY)", _sentence(meaning)
        return Card(title=title, value=value, spread=spread, verdict="not a result", meaning=meaning, mark="quiet")
    above = is_above(score, chance)
    verdict = [f"{'above chance' if above else 'not distinguishable from chance'} ({chance:.2f})"]
    if score["low"] is None:
        verdict = [f"no verdict against chance ({chance:.2f}): too few machines"]
    elif others := {key: methods[key]["balanced_accuracy"]["mean"] for key in RIVALS if key in methods}:
        best = max(others, key=lambda key: others[key])
        # an interval that holds the other's mean tells the two apart neither way
        better, worse = score["low"] > others[best], score["high"] < others[best]
        comparison = "better than" if better else "worse than" if worse else "not told from"
        verdict.append(f"{comparison} {METHODS[best]} ({others[best]:.2f})")
    leak = False
    if "oracle" in methods:
        share, best = result["over_oracle"]["balanced_accuracy"], methods["oracle"]["balanced_accuracy"]
        verdict.append(f"{share['mean']:.2f} ({_spread(share)}) of the oracle ({best['mean']:.2f})")
    for key, control in MUST_BE_AT_CHANCE.items():
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
    return Card(title=name, value=value, spread=spread, verdict="; ".join(verdict), meaning=text, mark=mark)


def _spread(score: Mapping[str, Any]) -> str:
    return "too few machines" if score["low"] is None else f"{score['low']:.2f} to {score['high']:.2f}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def recall_table(clean: Mapping[str, Any], model: str, class_names: Sequence[str]) -> Table:
    """Recall by class, a row a protocol."""
    shares = {name: result["methods"][model]["recall"] for name, result in clean.items()}
    rows = [
        [name, *(f"{share[label]:.2f}" if label in share else "-" for label in class_names)]
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
        return f"no class is taken for another in {CONFUSED:.0%} of its records or more."
    return "; ".join(f"{a} taken for {b} ({share:.0%})" for share, a, b in sorted(found, reverse=True)[:3]) + "."


def trust_table(clean: Mapping[str, Any]) -> Table:
    """Calibration and the choice of the epoch, a row a protocol."""
    rows = []
    for name, result in clean.items():
        calibration, last = result["calibration"], result["last_epoch"]
        before, after = (
            {key: np.mean(calibration[when][key]) for key in ("expected_calibration_error", "cross_entropy")}
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
    lines = ["Simulated vibration. A score here says nothing yet about measured machines."]
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
    lines += [f"{name} is left out: {reason}." for name, reason in metrics["protocols_left_out"].items()]
    if metrics["n_records_unusable"]:
        lines.append(f"{metrics['n_records_unusable']} record(s) failed in simulation and are left out.")
    return lines


def _several(values: Sequence[float], form: str) -> str:
    """One value a seed."""
    return ", ".join(format(value, form) for value in values)
