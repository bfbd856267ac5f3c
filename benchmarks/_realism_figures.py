"""The figures of the realism section: simulated intervals beside measured ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

from benchmarks._realism_recording import INDICATORS
from benchmarks._realism_sets import CONTROLS
from gensig.commands.figures.panels import FAULTY, GREY, SOUND
from gensig.report.realism import Comparison, points

FloatArray = NDArray[np.floating]

LEAST = 0.05  # shown at this where a value is 0 or less: the axis is logarithmic


def plot_yardstick(found: Sequence[Comparison], path: Path) -> None:
    """All quantities on one logarithmic axis: measured bands, simulated medians and 5 to 95 %."""
    figure, axes = pyplot.subplots(
        figsize=(10, 1.2 + 0.3 * len(found)), layout="constrained"
    )
    top = (
        max(
            [one.p95 for one in found if one.n]
            + [one.high for one in found if one.high is not None]
        )
        * 1.3
    )
    for place, one in enumerate(found):
        if one.low is not None or one.high is not None:
            low, high = (
                max(one.low or LEAST, LEAST),
                top if one.high is None else one.high,
            )
            axes.barh(place, high - low, left=low, height=0.7, color=GREY, alpha=0.35)
        if one.n:
            _interval(
                axes,
                place,
                max(one.p5, LEAST),
                max(one.median, LEAST),
                max(one.p95, LEAST),
                SOUND,
            )
    axes.set(
        xscale="log",
        xlim=(LEAST, top),
        yticks=range(len(found)),
        yticklabels=[
            f"{one.id}{f', {one.unit}' if one.unit else ''} ({one.at})" for one in found
        ],
        title="Simulated: median and 5 to 95 %, lines; measured ranges, bands",
    )
    axes.invert_yaxis()
    axes.grid(axis="x", which="both", alpha=0.3)
    _save(figure, path)


def plot_recording(
    simulated: Mapping[str, Mapping[str, FloatArray]],
    recorded: Mapping[str, FloatArray] | None,
    path: Path,
) -> None:
    """One panel for each indicator: simulated intervals and the channels of the recording."""
    figure, grid = pyplot.subplots(
        len(INDICATORS), 1, figsize=(9, 1.35 * len(INDICATORS)), layout="constrained"
    )
    for axes, (name, unit) in zip(np.atleast_1d(grid), INDICATORS.items(), strict=True):
        for place, control in enumerate(CONTROLS):
            median, p5, p95, n = points(simulated[control][name])
            if n:
                _interval(axes, place + 1, p5, median, p95, FAULTY if place else SOUND)
        if recorded is not None:
            axes.plot(
                recorded[name],
                np.zeros(len(recorded[name])),
                "k|",
                markersize=11,
                markeredgewidth=1.8,
            )
        names = ["recording, channels" if recorded is not None else "", *CONTROLS]
        axes.set(
            yticks=range(len(names)), yticklabels=names, ylim=(len(names) - 0.4, -0.6)
        )
        axes.set_title(
            f"{name.replace('_', ' ')}{f', {unit}' if unit else ''}",
            fontsize="medium",
            loc="left",
        )
        axes.tick_params(axis="y", labelsize="x-small")
        axes.grid(axis="x", alpha=0.3)
    figure.suptitle(
        "Healthy 23/46 pair at 2000 r/min: simulated 5 to 95 % over units and sensors"
    )
    _save(figure, path)


def _interval(
    axes: Any, place: float, low: float, median: float, high: float, colour: str
) -> None:
    axes.plot(
        [low, high], [place, place], color=colour, linewidth=2.2, solid_capstyle="butt"
    )
    axes.plot([median], [place], "o", color=colour, markersize=5)


def _save(figure: Any, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
