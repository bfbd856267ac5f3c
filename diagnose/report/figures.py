"""Figures of a study as PNG, readable without telling red from green."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

# Okabe & Ito (2008), "Color universal design", without the yellow.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def confusion_figure(
    path: Path,
    confusion: Sequence[Sequence[int]],
    class_names: Sequence[str],
    title: str,
) -> None:
    """Share of each true class given each label, with counts of records (summed over seeds)."""
    figure, axes = subplots(
        1, size=(1.2 * len(class_names) + 2.4, 1.0 * len(class_names) + 1.9)
    )
    counts = np.asarray(confusion)
    total = counts.sum(axis=1, keepdims=True)
    share = np.divide(counts, total, out=np.zeros(counts.shape), where=total > 0)
    image = axes[0].imshow(share, cmap="cividis", vmin=0, vmax=1)
    for (row, column), value in np.ndenumerate(share):
        text = f"{value:.2f}\n({counts[row, column]})"
        color = "black" if value > 0.5 else "white"
        axes[0].text(
            column, row, text, ha="center", va="center", color=color, fontsize=9
        )
    ticks = range(len(class_names))
    axes[0].set_xticks(ticks, class_names, rotation=20, ha="right")
    axes[0].set_yticks(ticks, class_names)
    axes[0].set(xlabel="predicted", ylabel="true", title=title)
    figure.colorbar(image, ax=axes[0], label="share of the true class", fraction=0.046)
    save(figure, path)


def scores_figure(path: Path, metrics: Mapping[str, Any]) -> None:
    """Balanced accuracy and interval of every method, one panel a protocol, leaky ones last and
    in grey.
    """
    results = sorted(metrics["protocols"].items(), key=lambda item: item[1]["leaky"])
    named = dict.fromkeys(
        [
            metrics["model"],
            *(name for _, result in results for name in result["methods"]),
        ]
    )
    methods = [name for name in named if name != "chance"]
    height = 0.34 * len(methods) + 1.1
    figure, axes = subplots(
        len(results), size=(min(3.4 * len(results) + 1.6, 16), height), sharey=True
    )
    for panel, (protocol, result) in zip(axes, results, strict=True):
        panel.axvline(
            result["methods"]["chance"]["balanced_accuracy"], color="0.4", linestyle=":"
        )
        for place, name in enumerate(reversed(methods)):
            if name not in result["methods"]:
                continue
            score = result["methods"][name]["balanced_accuracy"]
            color = (
                "0.6"
                if result["leaky"]
                else COLORS[0]
                if name == metrics["model"]
                else COLORS[-1]
            )
            if score["low"] is not None:
                panel.plot(
                    [score["low"], score["high"]],
                    [place, place],
                    color=color,
                    linewidth=2,
                )
            panel.plot(score["mean"], place, color=color, marker="o")
        panel.set_yticks(
            range(len(methods)), [name.replace("_", " ") for name in reversed(methods)]
        )
        title = protocol + ("\nLEAKY: not a result" if result["leaky"] else "")
        panel.set(
            xlim=(0, 1.02), ylim=(-0.6, len(methods) - 0.4), xlabel="balanced accuracy"
        )
        panel.set_title(title, fontsize=10)
        panel.grid(alpha=0.3, axis="x")
    save(figure, path)


def reliability_figure(path: Path, protocols: Mapping[str, Mapping[str, Any]]) -> None:
    """Share of right predictions against their probability, one panel a protocol.

    `calibration.calibration_scores`.
    """
    figure, axes = subplots(len(protocols), size=(3.9 * len(protocols) + 0.6, 3.9))
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


def subplots(
    n_panels: int, *, size: tuple[float, float], sharey: bool = False
) -> tuple[Any, list[Any]]:
    """Figure and axes without touching the state of pyplot, so that no display is needed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(np.atleast_1d(figure.subplots(1, n_panels, sharey=sharey)))


def save(figure: Any, path: Path) -> None:
    """Write a PNG with the same bytes on every run."""
    figure.savefig(path, dpi=120, metadata={"Software": None})
