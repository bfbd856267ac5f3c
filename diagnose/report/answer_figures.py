"""Figures of the answers: score over a condition, severity and length of signal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.report.panels import COLORS, interval_line, panels, save, spaced
from diagnose.scoring.detection_limit import (
    CURVE_NEEDS,
    records_behind,
    too_few_for_curve,
)
from diagnose.studies.result_files import Content

PANELS_A_ROW = 5
SHARES = (-0.03, 1.03)  # limits of an axis


def conditions_figure(path: Path, answers: Content) -> None:
    """Scores of the network and the best baseline over each condition.

    Rings mark groups weaker than the rest.

    Parameters
    ----------
    path : PNG to write
    answers : of one protocol, as `diagnose.studies.answers.protocol_answers` gives them, with at
        least one condition
    """
    columns: dict[str, list[Content]] = {}
    for row in answers["conditions"]["rows"]:
        columns.setdefault(row["column"], []).append(row)
    shown = list(columns.items())[:PANELS_A_ROW]
    figure, axes = panels(len(shown), 3.1, 3.5, sharey=True)
    for panel, (column, rows) in zip(axes, shown, strict=True):
        _condition_panel(panel, answers, rows)
        panel.set(xlabel=column.removeprefix("params/"), ylim=SHARES)
        panel.set_title(spaced(rows[0]["measure"]), fontsize=9)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("score")
    axes[0].legend(loc="lower left", fontsize=8)
    save(figure, path)


def _condition_panel(panel: Any, answers: Content, rows: Sequence[Content]) -> None:
    """Draw the groups of one condition: by their middles, or side by side for names."""
    numbers = rows[0]["low"] is not None
    at, aside = np.arange(len(rows), dtype=float), 0.15
    if numbers:
        at, aside = np.array([(row["low"] + row["high"]) / 2 for row in rows]), 0.0
    for index, method in enumerate(_methods(answers)):
        scores = [row["scores"][method] for row in rows]
        interval_line(panel, at + index * aside, scores, index, method, joined=numbers)
    weak = [(row["difference_at_most"] or 0) < 0 for row in rows]
    means = np.array([row["scores"][answers["network"]]["mean"] for row in rows])
    ring = {"markersize": 14, "fillstyle": "none", "color": "black"}
    panel.plot(at[weak], means[weak], "o", **ring)
    if not numbers:
        groups = [row["group"] for row in rows]
        panel.set_xticks(at, groups, rotation=20, fontsize=7)
        panel.set_xlim(-0.5, len(rows) - 0.5 + aside)


def _methods(answers: Content) -> list[str]:
    """Names of the network and of the best baseline, where there is one."""
    return [name for name in (answers["network"], answers["best_baseline"]) if name]


def detection_figure(path: Path, answers: Content) -> None:
    """Share found at 5 % false alarms against severity: groups, fitted curve, limits.

    Parameters
    ----------
    path : PNG to write
    answers : of one protocol, with at least one class in `graded_classes`
    """
    classes = graded_classes(answers)
    figure, axes = panels(len(classes), 4.2, 3.8, sharey=True)
    for panel, name in zip(axes, classes, strict=True):
        for index, method in enumerate(_methods(answers)):
            detection = answers["detection"][method]
            if not detection["missing"]:
                _detection_lines(panel, detection, name, index, method)
        mine = answers["detection"][answers["network"]]["classes"][name]
        _draw_limits(panel, mine["limits"])
        panel.set(xlabel="severity (dotted: false alarms)", ylim=SHARES)
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


def _detection_lines(
    panel: Any, detection: Content, name: str, index: int, method: str
) -> None:
    """Draw the groups and the curve of one class, and the false alarms, of one method."""
    part, color = detection["classes"][name], COLORS[index]
    rows, curve = part["by_severity"], part["curve"]
    at = np.array([(row["severity_low"] + row["severity_high"]) / 2 for row in rows])
    at = at + index * 0.01 * np.ptp(at)  # so that bars do not hide each other
    shares = [row["share_found"] for row in rows]
    interval_line(panel, at, shares, index, method, joined=False)
    panel.plot(curve["severity"], curve["share_found"], color=color)
    alarms = detection["false_alarms"]["mean"]
    if alarms is not None:
        panel.axhline(alarms, color=color, linestyle=":", linewidth=1)


def graded_classes(answers: Content) -> list[str]:
    """Fault classes whose severity varies among the test records."""
    if "detection" not in answers:
        return []
    classes = answers["detection"][answers["network"]]["classes"]
    return [name for name, part in classes.items() if part["by_severity"]]


def window_length_figure(path: Path, answers: Mapping[str, Content]) -> None:
    """Balanced accuracy of the network over the length of signal judged, one panel a protocol.

    Parameters
    ----------
    path : PNG to write
    answers : protocol -> its answers, each with ``window_length``
    """
    figure, axes = panels(len(answers), 3.4, 3.4, sharey=True)
    for panel, (protocol, part) in zip(axes, answers.items(), strict=True):
        rows = part["window_length"]["rows"]
        seconds = [row["seconds"] for row in rows]
        scores = [row["balanced_accuracy"] for row in rows]
        interval_line(panel, seconds, scores, 0, part["network"])
        panel.set_xscale("log")
        panel.set_xticks(seconds, [f"{value:.3g}" for value in seconds], fontsize=8)
        panel.minorticks_off()
        panel.set(xlabel="signal judged, s", ylim=SHARES, title=protocol)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("balanced accuracy")
    save(figure, path)


def _draw_limits(panel: Any, limits: Sequence[Content]) -> None:
    """Draw a mark and its interval for each limit of severity that is reached."""
    for row in limits:
        if row["quantity"] != "severity" or row["status"] != "reached":
            continue
        value, share = row["value"], row["share"]
        ends = [row["low"], row["high"]]
        if row["low"] is None:
            ends[0] = value
        if row["high"] is None:
            ends[1] = row["largest_tested"]
        panel.plot(ends, [share, share], color="black", linewidth=2, alpha=0.6)
        panel.plot(value, share, color="black", marker="|", markersize=12)
        panel.annotate(
            f"{share:.0%} at {value:.2f}",
            (value, share),
            xytext=(4, 5),
            textcoords="offset points",
            fontsize=8,
        )
