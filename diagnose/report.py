"""The result of a study for readers: ``metrics.json``, figures and one Markdown page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.figures import confusion_figure, reliability_figure, severity_figure
from diagnose.protocols import MEANING

FEW_UNITS = 10
CONFUSED = 0.1


def write_report(folder: Path, metrics: Mapping[str, Any]) -> Path:
    """Write ``metrics.json``, the figures (confusion by protocol, severity, reliability), ``report.md``; return it."""
    (folder / "metrics.json").write_text(json.dumps(metrics, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    model = metrics["model"]
    for protocol, result in metrics["protocols"].items():
        title = f"{model}, {protocol}" + (" (LEAKY)" if result["leaky"] else "")
        path = folder / f"confusion_{protocol}.png"
        confusion_figure(path, result["methods"][model]["confusion"], metrics["class_names"], title)
    rows = {name: result["by_severity"] for name, result in metrics["protocols"].items() if not result["leaky"]}
    rows = {name: part for name, part in rows.items() if part}
    if rows:
        severity_figure(folder / "severity.png", rows)
    clean = {name: result for name, result in metrics["protocols"].items() if not result["leaky"]}
    if clean:
        reliability_figure(folder / "reliability.png", {name: result["calibration"] for name, result in clean.items()})
    page = folder / "report.md"
    page.write_text("\n".join(_page(metrics, list(rows))) + "\n", encoding="utf-8")
    return page


def result_table(metrics: Mapping[str, Any]) -> list[str]:
    """Markdown table of protocol x method: balanced accuracy with its 95 % interval, leaky protocols last."""
    columns = {
        metrics["model"]: metrics["model"].upper(),
        "indicators": "indicators",
        "indicators_without_level": "indicators without RMS",
        "rms_threshold": "RMS threshold",
        "nearest_spectrum": "1-NN on spectra",
        "minirocket": "MiniRocket",
        "label_shuffle": "label shuffle",
        "chance": "chance",
    }
    results = metrics["protocols"]
    shown = [key for key in columns if any(key in result["methods"] for result in results.values())]
    lines = [
        "| protocol | " + " | ".join(columns[key] for key in shown) + " |",
        "|---" * (len(shown) + 1) + "|",
    ]
    for name, result in sorted(results.items(), key=lambda item: item[1]["leaky"]):
        label = f"*{name}* (LEAKY: not a result)" if result["leaky"] else f"**{name}**"
        lines.append("| " + " | ".join([label, *(_cell(result["methods"].get(key)) for key in shown)]) + " |")
    return lines


def _cell(method: Mapping[str, Any] | None) -> str:
    if method is None:
        return "-"
    value = method["balanced_accuracy"]
    if isinstance(value, float):
        return f"{value:.2f}"
    return f"{value['mean']:.2f} [{value['low']:.2f}, {value['high']:.2f}]"


def _page(metrics: Mapping[str, Any], with_severity: Sequence[str]) -> list[str]:
    results = metrics["protocols"]
    settings = metrics["settings"]
    window_ms = 1e3 * settings["window_samples"] / metrics["sampling_rate_hz"]
    level = "level removed (RMS-normalised)" if settings["normalise"] == "rms" else "level kept"
    lines = [
        "# Which faults can be told apart",
        "",
        f"Data: `{_safe(metrics['data'])}`, {metrics['n_records']} records, classes {_list(metrics['class_names'])}; "
        f"channels {_list(metrics['channel_names'])} at {metrics['sampling_rate_hz']:g} Hz. "
        f"Network: {metrics['model']} on windows of {window_ms:.0f} ms, {level}, {len(settings['seeds'])} seed(s).",
        "",
        *[f"- {_headline(name, result, metrics['model'])}" for name, result in results.items() if not result["leaky"]],
        "",
        "Balanced accuracy over test records, mean over seeds [95 % interval over units]:",
        "",
        *result_table(metrics),
        "",
        "## Which faults are found",
        "",
        f"Share of the test records of each class that {metrics['model']} recognises:",
        "",
        *_recall_table(metrics),
        "",
        "## What the numbers mean",
        "",
        "- **Balanced accuracy**: mean over the classes of the share of records recognised. A record's label is the "
        "class with the largest mean log-probability over its windows.",
        *[f"- **{name}**: {MEANING[name]}." for name in results if name in MEANING],
        "- **LEAKY**: windows of one record on both sides of the split, as in many papers. It shows how much a "
        "careless split flatters; it is no measure of diagnosis.",
        "- **indicators**: logistic regression or gradient boosting (chosen on validation units) on RMS, kurtosis, "
        "crest factor, FM4 and sideband ratio of every channel over the whole stretch of signal; it knows the speed "
        "and the tooth counts. **RMS threshold**: thresholds on the level alone.",
        *_optional_baselines(metrics),
        "- **label shuffle**: the same training on shuffled labels. Chance must lie in its interval, which covers the "
        "units and the luck of the shuffle; if it lies below, something leaks.",
        "",
        "## Which classes are confused",
        "",
    ]
    for name, result in results.items():
        if not result["leaky"]:
            lines += _confusions(name, result["methods"][metrics["model"]]["confusion"], metrics["class_names"])
    lines += ["", *[f"![confusion, {name}](confusion_{name}.png)" for name in results]]
    if with_severity:
        lines += ["", "## How severe a fault must be", "", "![recognised by severity](severity.png)"]
    lines += ["", *_trust_section(metrics)]
    lines += ["", "## Caveats", "", *_caveats(metrics), ""]
    lines.append(
        "Everything in numbers, with macro-F1, recall and settings: `metrics.json`. What each method said of each test "
        "record: `predictions.csv`. Networks: `models/`."
    )
    return lines


def _optional_baselines(metrics: Mapping[str, Any]) -> list[str]:
    """One line for each baseline that does not run by default."""
    texts = {
        "nearest_spectrum": "- **1-NN on spectra**: the class of the training signal with the nearest log-magnitude "
        "spectrum, mean over the windows.",
        "minirocket": "- **MiniRocket**: ridge regression on the shares of positive values of fixed convolutions "
        "(Dempster et al. 2021), mean over the windows; the penalty is chosen on validation units.",
    }
    return [text for name, text in texts.items() if name in metrics["settings"]["baselines"]]


def _recall_table(metrics: Mapping[str, Any]) -> list[str]:
    """Recall by class and clean protocol, a Markdown table."""
    names = metrics["class_names"]
    lines = ["| protocol | " + " | ".join(_safe(name) for name in names) + " |", "|---" * (len(names) + 1) + "|"]
    for protocol, result in metrics["protocols"].items():
        if not result["leaky"]:
            shares = result["methods"][metrics["model"]]["recall"]
            lines.append(f"| **{protocol}** | " + " | ".join(f"{shares[name]:.2f}" for name in names) + " |")
    return lines


def _trust_section(metrics: Mapping[str, Any]) -> list[str]:
    """How far the network's probabilities can be believed, and what the choice of the epoch brought."""
    clean = {name: result for name, result in metrics["protocols"].items() if not result["leaky"]}
    lines = [
        "## What its probabilities are worth",
        "",
        "One temperature a network, fitted on the records of its validation units, brings the probabilities of records "
        "nearer to the share that is right; it changes no label. Calibration error: mean distance between the two over "
        "test records, and what such probabilities would have by chance if they were all true. Cross-entropy: smaller "
        "is better. The network is the one of its best epoch on validation units; the score of its last epoch stands "
        "beside.",
        "",
        "| protocol | calibration error before, after (chance) | cross-entropy before, after | temperature | best epoch"
        " | last epoch | score of the last |",
        "|---" * 7 + "|",
    ]
    for name, result in clean.items():
        calibration, last = result["calibration"], result["last_epoch"]
        before, after = (
            {key: np.mean(calibration[when][key]) for key in ("expected_calibration_error", "cross_entropy")}
            for when in ("before", "after")
        )
        cells = (
            f"**{name}**",
            f"{before['expected_calibration_error']:.3f}, {after['expected_calibration_error']:.3f} "
            f"({np.mean(calibration['after']['error_by_chance']):.3f})",
            f"{before['cross_entropy']:.3f}, {after['cross_entropy']:.3f}",
            _several(calibration["temperature"], ".2f"),
            _several(result["best_epoch"], "d"),
            _several(last["epoch"], "d"),
            _cell(last),
        )
        lines.append("| " + " | ".join(cells) + " |")
    return [*lines, "", "![reliability](reliability.png)"] if clean else lines


def _several(values: Sequence[float], form: str) -> str:
    """One value a seed."""
    return ", ".join(format(value, form) for value in values)


def _headline(name: str, result: Mapping[str, Any], model: str) -> str:
    """One sentence: the score against chance and against the best baseline."""
    methods = result["methods"]
    score, chance = methods[model]["balanced_accuracy"], methods["chance"]["balanced_accuracy"]
    verdict = "above chance" if score["low"] > chance else "not distinguishable from chance"
    text = f"**{name}**: {model} {score['mean']:.2f}, {verdict} ({chance:.2f})"
    named = ("indicators", "rms_threshold", "nearest_spectrum", "minirocket")
    others = {key: methods[key] for key in named if key in methods}
    if others:
        best = max(others, key=lambda key: others[key]["balanced_accuracy"]["mean"])
        value = others[best]["balanced_accuracy"]["mean"]
        # an interval that holds the other's mean tells the two apart neither way
        comparison = (
            "better than" if score["low"] > value else "worse than" if score["high"] < value else "not told from"
        )
        text += f"; {comparison} the {best.replace('_', ' ')} baseline ({value:.2f})"
    if "label_shuffle" in methods:
        shuffled = methods["label_shuffle"]["balanced_accuracy"]
        text += "; label shuffle " + (
            "at chance" if shuffled["low"] <= chance else f"ABOVE chance ({shuffled['mean']:.2f}): look for a leak"
        )
    return text + "."


def _confusions(name: str, confusion: Sequence[Sequence[int]], class_names: Sequence[str]) -> list[str]:
    """The largest off-diagonal shares of a protocol, at most three."""
    found = []
    for true, row in enumerate(confusion):
        total = max(int(np.sum(row)), 1)
        for predicted, count in enumerate(row):
            if true != predicted and count / total >= CONFUSED:
                found.append((count / total, class_names[true], class_names[predicted]))
    if not found:
        return [f"- **{name}**: no class is taken for another in {CONFUSED:.0%} of its records or more."]
    pairs = [f"{_safe(a)} taken for {_safe(b)} ({share:.0%})" for share, a, b in sorted(found, reverse=True)[:3]]
    return [f"- **{name}**: " + "; ".join(pairs) + "."]


def _caveats(metrics: Mapping[str, Any]) -> list[str]:
    lines = ["- Simulated vibration. A score here says nothing yet about measured machines."]
    for name, result in metrics["protocols"].items():
        n_units = result["n_units"]["test"]
        if n_units < FEW_UNITS and not result["leaky"]:
            lines.append(
                f"- {name}: only {n_units} test unit(s). The interval shows the spread of these units and is too "
                f"narrow for new ones; at least {FEW_UNITS} are advisable."
            )
    if metrics["settings"]["normalise"] == "rms":
        lines.append(
            "- The network sees windows without their level, the indicators with it unless stated; "
            "`normalise=none` gives the level to the network too."
        )
    for name, reason in metrics["protocols_left_out"].items():
        lines.append(f"- {name} is left out: {_safe(reason)}.")
    if metrics["n_records_unusable"]:
        lines.append(f"- {metrics['n_records_unusable']} record(s) failed in simulation and are left out.")
    return lines


def _list(names: Sequence[str]) -> str:
    return ", ".join(_safe(name) for name in names)


def _safe(text: str) -> str:
    """Text from a file without what Markdown or HTML would act on."""
    return "".join(character if character.isalnum() or character in " _-./:," else "?" for character in text)
