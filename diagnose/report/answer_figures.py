"""Figures of the answers as PNG.

Score over a condition, found share over severity, score over length of signal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.report.figures import COLORS, MARKERS, save, subplots
from diagnose.scoring.detection_limit import (
    CURVE_NEEDS,
    records_behind,
    too_few_for_curve,
)

PANELS_A_ROW = 5
Answers = Mapping[str, Any]


def conditions_figure(path: Path, answers: Answers) -> None:
    """Scores of the network and the best baseline over each condition; rings mark groups weaker
    than the rest.

    Parameters
    ----------
    path : PNG to write
    answers : of one protocol, as `diagnose.studies.answers.protocol_answers` gives them, with at least one condition
    """
    rows = answers["conditions"]["rows"]
    columns = list(dict.fromkeys(row["column"] for row in rows))[:PANELS_A_ROW]
    methods = [
        name
        for name in (answers["network"], answers["best_baseline"])
        if name is not None
    ]
    figure, axes = subplots(
        len(columns), size=(3.1 * len(columns) + 0.8, 3.5), sharey=True
    )
    for panel, column in zip(axes, columns, strict=True):
        mine = [row for row in rows if row["column"] == column]
        numbers = mine[0]["low"] is not None
        at = [
            (row["low"] + row["high"]) / 2 if numbers else place
            for place, row in enumerate(mine)
        ]
        aside = 0.0 if numbers else 0.15
        for index, method in enumerate(methods):
            places = np.asarray(at) + index * aside
            _line_with_band(
                panel,
                places,
                [row["scores"][method] for row in mine],
                index,
                method,
                joined=numbers,
            )
        weak = [
            place
            for place, row in enumerate(mine)
            if (row["difference_at_most"] or 0) < 0
        ]
        values = [mine[place]["scores"][methods[0]]["mean"] for place in weak]
        panel.plot(
            [at[place] for place in weak],
            values,
            "o",
            markersize=14,
            fillstyle="none",
            color="black",
        )
        if not numbers:
            panel.set_xticks(
                at, [row["group"] for row in mine], rotation=20, fontsize=7
            )
            panel.set_xlim(-0.5, len(mine) - 0.5 + aside)
        panel.set(xlabel=column.removeprefix("params/"), ylim=(-0.03, 1.03))
        panel.set_title(mine[0]["measure"].replace("_", " "), fontsize=9)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("score")
    axes[0].legend(loc="lower left", fontsize=8)
    save(figure, path)


def detection_figure(path: Path, answers: Answers) -> None:
    """Share found at 5 % false alarms against severity: groups, fitted curve, and the limits of
    the network.

    Parameters
    ----------
    path : PNG to write
    answers : of one protocol, with at least one class in `graded_classes`
    """
    detection = answers["detection"]
    classes = graded_classes(answers)
    methods = [
        name
        for name in (answers["network"], answers["best_baseline"])
        if name is not None
    ]
    figure, axes = subplots(
        len(classes), size=(4.2 * len(classes) + 0.8, 3.8), sharey=True
    )
    for panel, name in zip(axes, classes, strict=True):
        for index, method in enumerate(methods):
            found = detection[method]["classes"][name]
            rows = found["by_severity"]
            at = np.array(
                [(row["severity_low"] + row["severity_high"]) / 2 for row in rows]
            )
            at = at + index * 0.01 * (
                at.max() - at.min()
            )  # so that bars do not hide each other
            _line_with_band(
                panel,
                at,
                [row["share_found"] for row in rows],
                index,
                method,
                joined=False,
            )
            panel.plot(
                found["curve"]["severity"],
                found["curve"]["share_found"],
                color=COLORS[index],
            )
            alarms = detection[method]["false_alarms"]["mean"]
            if alarms is not None:
                panel.axhline(alarms, color=COLORS[index], linestyle=":", linewidth=1)
        _draw_limits(panel, detection[methods[0]]["classes"][name]["limits"])
        panel.set(xlabel="severity (dotted: false alarms)", ylim=(-0.03, 1.03))
        mine = detection[methods[0]]["classes"][name]
        panel.set_title(f"{name}: {records_behind(mine)}", fontsize=9)
        if too_few_for_curve(mine):
            panel.text(
                0.5,
                0.5,
                f"too few: {CURVE_NEEDS}",
                fontsize=8,
                ha="center",
                transform=panel.transAxes,
            )
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("share of records found")
    axes[-1].legend(loc="best", fontsize=8)
    save(figure, path)


def graded_classes(answers: Answers) -> list[str]:
    """Fault classes whose severity varies among the test records."""
    found = answers.get("detection", {}).get(answers["network"], {"classes": {}})[
        "classes"
    ]
    return [name for name, part in found.items() if part["by_severity"]]


def window_length_figure(path: Path, answers: Mapping[str, Answers]) -> None:
    """Balanced accuracy of the network over the length of signal judged, one panel a protocol.

    Parameters
    ----------
    path : PNG to write
    answers : protocol -> its answers, each with ``window_length``
    """
    figure, axes = subplots(
        len(answers), size=(3.4 * len(answers) + 0.8, 3.4), sharey=True
    )
    for panel, (protocol, part) in zip(axes, answers.items(), strict=True):
        rows = part["window_length"]["rows"]
        seconds = [row["seconds"] for row in rows]
        scores = [row["balanced_accuracy"] for row in rows]
        _line_with_band(panel, seconds, scores, 0, part["network"], joined=True)
        panel.set_xscale("log")
        panel.set_xticks(seconds, [f"{value:.3g}" for value in seconds], fontsize=8)
        panel.minorticks_off()
        panel.set(xlabel="signal judged, s", ylim=(-0.03, 1.03), title=protocol)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("balanced accuracy")
    save(figure, path)


def _line_with_band(
    panel: Any,
    at: Sequence[float] | NDArray[np.floating],
    scores: Sequence[Mapping[str, float | None]],
    index: int,
    label: str,
    *,
    joined: bool,
) -> None:
    """Values with their intervals: a line in a band where `joined`, else points with bars.

    Open where unknown.
    """
    mean, low, high = (
        np.array(
            [np.nan if score[key] is None else score[key] for score in scores],
            dtype=float,
        )
        for key in ("mean", "low", "high")
    )
    color, marker = COLORS[index], MARKERS[index]
    if joined:
        panel.plot(at, mean, color=color, marker=marker, label=label.replace("_", " "))
        panel.fill_between(at, low, high, color=color, alpha=0.18, linewidth=0)
        return
    panel.plot(
        at,
        mean,
        color=color,
        marker=marker,
        linestyle="none",
        label=label.replace("_", " "),
    )
    panel.vlines(at, low, high, color=color, linewidth=1.2, alpha=0.7)


def _draw_limits(panel: Any, limits: Sequence[Mapping[str, Any]]) -> None:
    """A mark on the severity axis for each limit reached, with its interval."""
    for row in limits:
        if row["quantity"] != "severity" or row["status"] != "reached":
            continue
        low = row["value"] if row["low"] is None else row["low"]
        high = row["largest_tested"] if row["high"] is None else row["high"]
        panel.plot(
            [low, high],
            [row["share"], row["share"]],
            color="black",
            linewidth=2,
            alpha=0.6,
        )
        panel.plot(row["value"], row["share"], color="black", marker="|", markersize=12)
        text = f"{row['share']:.0%} at {row['value']:.2f}"
        panel.annotate(
            text,
            (row["value"], row["share"]),
            xytext=(4, 5),
            textcoords="offset points",
            fontsize=8,
        )
