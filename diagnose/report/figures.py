"""Figures of scores, confusion and calibration, readable without telling red from green."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from diagnose.report.panels import COLORS, MARKERS, panels, save, spaced
from diagnose.studies.result_files import Content
from diagnose.studies.verdicts import failed_controls

WIDEST = 16.0  # inches, of a figure of scores


def confusion_figure(
    path: Path,
    confusion: Sequence[Sequence[int]],
    class_names: Sequence[str],
    title: str,
) -> None:
    """Share of each true class given each label, with counts of records (summed over seeds)."""
    n_classes = len(class_names)
    figure, (panel,) = panels(1, 1.2 * n_classes, n_classes + 1.9, margin=2.4)
    counts = np.asarray(confusion)
    total = counts.sum(axis=1, keepdims=True)
    share = np.divide(counts, total, out=np.zeros(counts.shape), where=total > 0)
    image = panel.imshow(share, cmap="cividis", vmin=0, vmax=1)
    colors = np.where(share > 0.5, "black", "white")
    for (row, column), value in np.ndenumerate(share):
        panel.text(
            column,
            row,
            f"{value:.2f}\n({counts[row, column]})",
            ha="center",
            va="center",
            color=colors[row, column],
            fontsize=9,
        )
    panel.set_xticks(range(n_classes), class_names, rotation=20, ha="right")
    panel.set_yticks(range(n_classes), class_names)
    panel.set(xlabel="predicted", ylabel="true", title=title)
    figure.colorbar(image, ax=panel, label="share of the true class", fraction=0.046)
    save(figure, path)


def scores_figure(path: Path, metrics: Content) -> None:
    """Balanced accuracy and interval of every method, one panel a protocol.

    Leaky protocols come last and in grey.
    """
    model = metrics["model"]
    results = sorted(metrics["protocols"].items(), key=lambda item: item[1]["leaky"])
    methods = [model]
    for _, result in results:
        methods += [name for name in result["methods"] if name not in methods]
    methods.remove("chance")
    methods.reverse()
    width = min(3.4, (WIDEST - 1.6) / len(results))
    figure, axes = panels(
        len(results), width, 0.34 * len(methods) + 1.1, margin=1.6, sharey=True
    )
    for panel, (protocol, result) in zip(axes, results, strict=True):
        scores = {
            name: method["balanced_accuracy"]
            for name, method in result["methods"].items()
            if not failed_controls(result, name)
        }
        panel.axvline(scores["chance"], color="0.4", linestyle=":")
        for row, name in enumerate(methods):
            if name not in scores:
                continue
            color = {model: COLORS[0]}.get(name, COLORS[-1])
            if result["leaky"]:
                color = "0.6"
            score = scores[name]
            if score["low"] is not None:
                ends = [score["low"], score["high"]]
                panel.plot(ends, [row, row], color=color, linewidth=2)
            panel.plot(score["mean"], row, color=color, marker="o")
        panel.set_yticks(range(len(methods)), [spaced(name) for name in methods])
        panel.set(
            xlim=(0, 1.02), ylim=(-0.6, len(methods) - 0.4), xlabel="balanced accuracy"
        )
        title = protocol
        if result["leaky"]:
            title += "\nLEAKY: not a result"
        panel.set_title(title, fontsize=10)
        panel.grid(alpha=0.3, axis="x")
    save(figure, path)


def reliability_figure(path: Path, protocols: Mapping[str, Content]) -> None:
    """Share of right predictions against their probability, one panel a protocol.

    Parameters
    ----------
    protocols : protocol -> `diagnose.networks.calibration.calibration_scores`
    """
    figure, axes = panels(len(protocols), 3.9, 3.9, margin=0.6)
    for panel, (protocol, calibration) in zip(axes, protocols.items(), strict=True):
        panel.plot([0, 1], [0, 1], color="0.6", linestyle="--", label="calibrated")
        for index, name in enumerate(("before", "after")):
            rows = calibration[name]["reliability"]
            error = np.mean(calibration[name]["expected_calibration_error"])
            panel.plot(
                [row["confidence"] for row in rows],
                [row["accuracy"] for row in rows],
                color=COLORS[index],
                marker=MARKERS[index],
                label=f"{name} scaling, error {error:.2f}",
            )
        panel.set(
            xlabel="probability of the predicted class",
            xlim=(0, 1),
            ylim=(0, 1.03),
            title=protocol,
        )
        panel.grid(alpha=0.3)
        panel.legend(loc="upper left", fontsize=8)
    axes[0].set_ylabel("share of records that are right")
    save(figure, path)
