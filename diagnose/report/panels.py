"""Figures as PNG: colors, panels, lines with intervals, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Okabe & Ito (2008), "Color universal design", without the yellow.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def panels(
    n_panels: int, width: float, height: float, *, margin: float = 0.8, **options: Any
) -> tuple[Any, list[Any]]:
    """Figure and its panels side by side, without the state of pyplot: no display is needed.

    Parameters
    ----------
    width, height, margin : inches, of a panel and of what is left of them
    options : of `matplotlib.figure.Figure.subplots`
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    size = (width * n_panels + margin, height)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(1, n_panels, squeeze=False, **options)[0])


def spaced(name: str) -> str:
    """Name of a method or measure as a label."""
    return name.replace("_", " ")


def interval_line(
    panel: Any,
    at: Sequence[float] | NDArray[np.floating],
    scores: Sequence[Mapping[str, float | None]],
    index: int,
    label: str,
    *,
    joined: bool = True,
) -> None:
    """Draw scores with their intervals: a line in a band where `joined`, else points with bars.

    Parameters
    ----------
    at : (score,) horizontal places
    scores : with ``mean``, ``low`` and ``high``; None where unknown
    index : of color and marker
    """
    mean, low, high = (
        np.array([score[key] for score in scores], dtype=float)
        for key in ("mean", "low", "high")
    )
    color = COLORS[index]
    line = panel.plot(at, mean, color=color, marker=MARKERS[index], label=spaced(label))
    if joined:
        panel.fill_between(at, low, high, color=color, alpha=0.18, linewidth=0)
        return
    line[0].set_linestyle("none")
    panel.vlines(at, low, high, color=color, linewidth=1.2, alpha=0.7)


def save(figure: Any, path: Path) -> None:
    """Write a PNG with the same bytes on every run."""
    figure.savefig(path, dpi=120, metadata={"Software": None})
