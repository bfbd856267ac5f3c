"""The result of a study of remaining lives.

``metrics.json``, ``scores.csv``, figures and one HTML page.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.data.lives import Lives
from diagnose.data.protocols import MEANING
from diagnose.report.figures import COLORS, save, subplots
from diagnose.scoring.life_scores import BAND, MEASURES
from diagnose.studies.life_jobs import AGE_ONLY, AND_AGE, LifePrediction
from gensig.text.page import Card, Section, Table, write_page

FEW_LIVES = 10
MOST_LINES = 12  # lives in one panel; more cannot be told apart
ALPHA = 0.2  # share of the true remaining life, the cone of the figure
HEAD = {
    "rmse_h": "RMSE, h",
    "mae_h": "mean error, h",
    "phm_score": "PHM score",
    "phm_score_last": "PHM score, last",
    "coverage": "share in the interval",
    "width_h": "width, h",
    "horizon_h": "horizon, h",
}
MEANINGS = [
    ("Remaining life", "is cut at the early level: long before its failure a machine shows nothing of it. A prediction "
     "at that level says 'that long or longer'."),
    ("Scores", "are means over the snapshots of a life, then over lives, so that every life counts the same; of the "
     "test lives that failed. In brackets 95 % over lives and seeds."),
    ("PHM score", "exp(-d/13) - 1 for too short a prediction, exp(d/10) - 1 for too long a one, d in units of 1/125 of "
     "the early level; smaller is better. 'last': of the last snapshot before the failure alone."),
    ("Share in the interval", "how often the prediction interval holds the true remaining life, beside what was "
     "wanted. Its half width comes of the errors on validation lives (conformal prediction, every life counting the "
     "same); these chose the model too, so that it is a little too narrow."),
    ("Horizon", f"how long before a failure predictions come within {BAND:.0%} of the early level and stay so."),
    ("age_only", "regression on the age alone: what a maintenance plan by the clock knows. A method that is not better "
     "has learnt nothing of the vibration."),
    ("constant", "the mean remaining life of the training, whatever the record."),
    ("indicators", "ridge regression or gradient boosting (chosen on validation lives) on condition indicators, their "
     "change since the first snapshot of the life, speed and torque."),
    ("..." + AND_AGE, "the same with the age beside the vibration."),
    ("Censored lives", "did not fail within their history. They are never scored; in the training their snapshots are "
     "used where the bound is above the early level, and left out below."),
]  # fmt: skip


def write_life_report(
    folder: Path,
    metrics: Mapping[str, Any],
    lives: Lives,
    predictions: Sequence[LifePrediction],
) -> Path:
    """Write ``metrics.json``, ``scores.csv``, a figure a protocol and ``report.html``, and return
    the page.
    """
    (folder / "metrics.json").write_text(
        json.dumps(metrics, indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    _write_scores(folder / "scores.csv", metrics)
    sections = [
        Section(
            title="In short",
            text=[
                "Root of the mean squared error of the remaining life that the network says of machines it never saw."
            ],
            cards=[
                _card(name, result, metrics["model"])
                for name, result in metrics["protocols"].items()
            ],
        )
    ]
    for name, result in metrics["protocols"].items():
        picture = f"remaining_life_{name}.png"
        life_figure(
            folder / picture,
            lives,
            [one for one in predictions if one.protocol == name],
        )
        caption = (
            f"said against true remaining life, a line a life (at most {MOST_LINES}), first seed; grey: within "
            f"{ALPHA:.0%} of the truth; dotted: the early level"
        )
        sections.append(
            Section(
                title=f"Remaining life, {name}",
                text=[_lives_sentence(result)],
                table=life_table(result),
                notes=[("", line) for line in _caveats(name, result)],
                figures=[(picture, caption)],
            )
        )
    left_out = [
        ("", f"{name} is left out: {reason}.")
        for name, reason in metrics["protocols_left_out"].items()
    ]
    sections += [
        Section(title="What the numbers mean", notes=MEANINGS),
        Section(title="Protocols left out", notes=left_out),
        Section(
            title="Files beside this page",
            notes=[
                ("metrics.json", "everything in numbers, with settings and versions."),
                (
                    "predictions.csv",
                    "what each method said of each test record, with its interval.",
                ),
                ("scores.csv", "the scores as a table."),
                ("models/", "each network, for diagnose evaluate, predict and export."),
            ],
            folded=True,
        ),
    ]
    page = folder / "report.html"
    kept = [section for section in sections if section.text or section.notes]
    write_page(
        page,
        title="How long the machines still run",
        lead=_lead(metrics),
        sections=kept,
    )
    return page


def life_table(result: Mapping[str, Any]) -> Table:
    """Scores of one protocol, a row a method."""
    rows = [
        [name.replace("_", " "), *(_cell(method[measure]) for measure in MEASURES)]
        for name, method in result["methods"].items()
    ]
    return Table(head=["method", *HEAD.values()], rows=rows)


def life_tables(metrics: Mapping[str, Any]) -> list[str]:
    """Markdown tables of all protocols."""
    lines = []
    for name, result in metrics["protocols"].items():
        table = life_table(result)
        lines += [f"**{name}**: {_lives_sentence(result)}", ""]
        lines += ["| " + " | ".join(table.head) + " |", "|---" * len(table.head) + "|"]
        lines += ["| " + " | ".join(row) + " |" for row in table.rows]
    return lines


def life_figure(
    path: Path, lives: Lives, predictions: Sequence[LifePrediction]
) -> None:
    """Said against true remaining life, in the manner of alpha-lambda plots, one panel a method."""
    shown = {
        one.method: one for one in reversed(predictions) if one.method != "constant"
    }
    order = [
        name
        for name in dict.fromkeys(one.method for one in predictions)
        if name in shown
    ]
    figure, axes = subplots(len(order), size=(3.1 * len(order) + 0.8, 3.9), sharey=True)
    for panel, name in zip(axes, order, strict=True):
        one = shown[name]
        level = one.early_life
        at = np.linspace(0, level, 50)
        panel.fill_between(
            at, (1 - ALPHA) * at, np.minimum((1 + ALPHA) * at, level), color="0.88"
        )
        panel.plot(at, at, color="0.4", linewidth=1)
        panel.axhline(level, color="0.4", linestyle=":", linewidth=1)
        names = np.unique(lives.name[one.record[lives.failed[one.record]]])[:MOST_LINES]
        for index, life in enumerate(names):
            mine = lives.name[one.record] == life
            true = np.minimum(lives.remaining[one.record[mine]], level)
            by_time = np.argsort(lives.age[one.record[mine]])
            color = COLORS[index % len(COLORS)]
            panel.plot(
                true[by_time],
                one.said[mine][by_time],
                color=color,
                marker=".",
                linewidth=0.8,
                markersize=4,
            )
        panel.set(
            xlim=(1.03 * level, -0.03 * level), ylim=(-0.03 * level, 1.06 * level)
        )
        panel.set(xlabel="true remaining life, h", title=name.replace("_", " "))
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("said, h")
    save(figure, path)


def _card(name: str, result: Mapping[str, Any], model: str) -> Card:
    """The network's error against what the clock alone knows."""
    methods = result["methods"]
    score, better = methods[model]["rmse_h"], methods[model]["gain_over_age_only_h"]
    clock = methods[AGE_ONLY]["rmse_h"]["mean"]
    found = "not told from"
    if better["low"] > 0:
        found = "better than"
    elif better["high"] < 0:
        found = "worse than"
    held = methods[model]["coverage"]["mean"]
    indicators = methods["indicators"]["rmse_h"]["mean"]
    return Card(
        title=name,
        value=f"{score['mean']:.3g} h",
        spread=f"{score['low']:.3g} to {score['high']:.3g}",
        verdict=f"{found} the age alone ({clock:.3g} h); indicators {indicators:.3g} h; intervals hold {held:.0%} "
        f"(wanted {result['coverage_wanted']:.0%})",
        meaning=f"{MEANING.get(name, 'tested on machines never seen')}; early level {result['early_life_h']:.3g} h.",
        mark="good" if better["low"] > 0 else "bad",
    )


def _lives_sentence(result: Mapping[str, Any]) -> str:
    lives, censored = result["n_lives"], result["n_lives_censored"]
    return (
        f"{lives['train']} training, {lives['validation']} validation and {lives['test']} test lives that failed (and "
        f"{censored['train']}, {censored['validation']}, {censored['test']} censored); remaining life cut at "
        f"{result['early_life_h']:.4g} h; intervals for {result['coverage_wanted']:.0%}."
    )


def _caveats(name: str, result: Mapping[str, Any]) -> list[str]:
    lines = []
    if result["n_lives"]["test"] < FEW_LIVES:
        lines.append(
            f"{name}: only {result['n_lives']['test']} test lives failed. The brackets are too narrow for new ones; at "
            f"least {FEW_LIVES} are advisable."
        )
    if not result["intervals_hold"]:
        lines.append(
            f"{result['n_lives']['validation']} validation lives are too few for intervals of "
            f"{result['coverage_wanted']:.0%}: they reach from 0 to the early level and say nothing."
        )
    if unknown := sum(result["n_records_unknown"].values()):
        lines.append(
            f"{unknown} training or validation snapshots of censored lives are left out: bound below the level."
        )
    return lines


def _lead(metrics: Mapping[str, Any]) -> list[str]:
    settings = metrics["settings"]
    level = (
        "level kept"
        if settings["normalise"] == "none"
        else "level removed (RMS-normalised)"
    )
    return [
        f"Data: {metrics['data']}, {metrics['n_records']} records; channels {', '.join(metrics['channel_names'])} at "
        f"{metrics['sampling_rate_hz']:g} Hz. Simulated vibration: a score says nothing yet about measured machines.",
        f"Network: {metrics['model']}, {level}, told speed and torque, {len(settings['seeds'])} seed(s). "
        f"gensig {metrics['environment']['gensig']}, {metrics['environment']['finished']}.",
    ]


def _cell(score: Mapping[str, float]) -> str:
    return f"{score['mean']:.3g} [{score['low']:.3g}, {score['high']:.3g}]"


def _write_scores(path: Path, metrics: Mapping[str, Any]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["protocol", "method", "measure", "mean", "low", "high"])
        for protocol, result in metrics["protocols"].items():
            for name, method in result["methods"].items():
                for measure in (*MEASURES, "gain_over_age_only_h"):
                    row = method[measure]
                    writer.writerow(
                        [
                            protocol,
                            name,
                            measure,
                            *(f"{row[key]:.6g}" for key in ("mean", "low", "high")),
                        ]
                    )
