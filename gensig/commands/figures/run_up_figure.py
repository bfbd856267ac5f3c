"""Figure of a run-up: order map, waterfall with the natural frequencies, order cuts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.style import (
    COLORS,
    FREQUENCY,
    GREY,
    MODE,
    SMALL,
    TOGETHER,
    curve,
    empty_figure,
    label_above,
    mark_modes,
    save,
    titles,
)
from gensig.commands.gears.run_up import RPM, Mode, RunUp
from gensig.signals.run_up.level_map import LevelMap

RANGE = 60.0  # dB, of the colors
MOST_LISTED = 11  # natural frequencies
MOST_CURVES = 12  # natural frequencies drawn across the order map
MOST_CROSSINGS = 20  # marked below the cuts


def plot_run_up(run_up: RunUp, path: Path, *, name: str) -> None:
    """Draw levels of one channel over speed; ``name`` is that of the record in the title."""
    figure = empty_figure(13, 9)
    rows = figure.add_gridspec(2, 1, height_ratios=(1.25, 1.0))
    maps = rows[0].subgridspec(1, 2)
    lower = rows[1].subgridspec(1, 2, width_ratios=(5.2, 1.0))
    _order_map(figure, figure.add_subplot(maps[0]), run_up)
    _waterfall(figure, figure.add_subplot(maps[1]), run_up)
    cuts, key = figure.add_subplot(lower[0]), figure.add_subplot(lower[1])
    _cuts(cuts, run_up)
    _key(key, cuts, run_up.modes)
    rpm = RPM * run_up.orders.speed
    figure.suptitle(
        f"{name}: {run_up.channel}, {run_up.shaft} from {rpm[0]:.0f} to {rpm[-1]:.0f} r/min"
    )
    save(figure, path)


def _order_map(figure: Any, axes: Any, run_up: RunUp) -> None:
    orders = run_up.orders
    _levels(figure, axes, run_up, orders)
    rpm, highest = RPM * orders.speed, float(orders.axis[-1])
    title = "Order map"
    if 0 < len(run_up.modes) <= MOST_CURVES:
        title += " (dashed: natural frequencies)"
        for mode in run_up.modes:
            met = 60.0 * mode.frequency / rpm
            shown = met <= highest
            curve(axes, met[shown], rpm[shown], MODE, style="--", width=1.0)
    abscissa = f"order of the {run_up.shaft}"
    titles(axes, title, abscissa, _speed(run_up), xlim=(0.0, highest))
    places = {f"{order:.4g}": order for order in run_up.cuts.values()}
    label_above(axes, places, highest)


def _waterfall(figure: Any, axes: Any, run_up: RunUp) -> None:
    spectra = run_up.waterfall
    _levels(figure, axes, run_up, spectra)
    rpm, highest = RPM * spectra.speed, float(spectra.axis[-1])
    for order in run_up.cuts.values():
        hz = order * rpm / 60.0
        shown = hz <= highest
        curve(axes, hz[shown], rpm[shown], "white", style=":", width=0.8)
    title = "Waterfall (dashed: natural frequencies, dotted: orders)"
    titles(axes, title, FREQUENCY, _speed(run_up), xlim=(0.0, highest))
    modes = {mode.name: mode.frequency for mode in run_up.modes}
    mark_modes(axes, modes, highest)


def _cuts(axes: Any, run_up: RunUp) -> None:
    orders = run_up.orders
    rpm = RPM * orders.speed
    curve(axes, rpm, run_up.level(orders.total), GREY, "all orders", width=1.2)
    crossings = {order: run_up.crossings(order) for order in run_up.cuts.values()}
    n_crossings = sum(len(met) for met in crossings.values())
    marks: list[tuple[float, float, str]] = []
    lowest = np.inf
    for (name, order), color in zip(run_up.cuts.items(), COLORS, strict=False):
        level = run_up.level(orders.at(order))
        if not np.any(np.isfinite(level)):
            continue
        lowest = min(lowest, float(np.nanmin(level)))
        curve(axes, rpm, level, color, name)
        peaks = run_up.peaks(order)
        axes.plot(rpm[peaks], level[peaks], "o", color=color, markersize=5)
        marks += [(float(rpm[k]), float(level[k]), color) for k in peaks]
    low, high = axes.get_ylim()
    low = max(low, lowest - 3.0) - 0.06 * len(crossings) * (high - low)
    axes.set_ylim(low, high + 0.12 * (high - low))
    axes.set_xlim(rpm[0], rpm[-1])
    _peak_labels(axes, marks)
    title = "Order cuts; dots: peaks by speed"
    if 0 < n_crossings <= MOST_CROSSINGS:
        title += "; triangles: an order meets a natural frequency"
        for row, (order, color) in enumerate(
            zip(run_up.cuts.values(), COLORS, strict=False)
        ):
            _crossings(axes, crossings[order], color, 0.025 + 0.05 * row)
    titles(axes, title, _speed(run_up), _decibel(run_up))
    axes.grid(alpha=0.3)


def _peak_labels(axes: Any, marks: list[tuple[float, float, str]]) -> None:
    """Write the speed at each peak, above it; a label that would hide another one is left out."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    written: list[tuple[float, float]] = []
    for rpm, level, color in sorted(marks, key=lambda mark: -mark[1]):
        place = (rpm - left) / (right - left), (level - low) / (high - low)
        near = [
            abs(place[0] - x) < 0.05 and abs(place[1] - y) < 0.07 for x, y in written
        ]
        if any(near):
            continue
        written.append(place)
        axes.annotate(
            f"{rpm:.0f}",
            (rpm, level),
            xytext=(0, 6),
            textcoords="offset points",
            ha="center",
            color=color,
            fontsize=9,
        )


def _crossings(axes: Any, met: Mapping[str, float], color: str, height: float) -> None:
    """Mark speeds of one order at a height of the axes; a name that would hide another is left
    out.
    """
    left, right = axes.get_xlim()
    across = axes.get_xaxis_transform()
    last = -np.inf
    for name, rpm in sorted(met.items(), key=lambda item: item[1]):
        axes.plot(rpm, height, "^", color=color, markersize=5, transform=across)
        if rpm - last < TOGETHER * (right - left):
            continue
        last = rpm
        axes.annotate(
            name,
            (rpm, height),
            xycoords=across,
            xytext=(5, -3),
            textcoords="offset points",
            color=color,
            fontsize=SMALL,
        )


def _levels(figure: Any, axes: Any, run_up: RunUp, levels: LevelMap) -> None:
    """Draw levels over the axis and speed, down to `RANGE` below the highest."""
    values = run_up.level(levels.rms)
    top = float(np.nanmax(values))
    image = axes.pcolormesh(
        levels.axis,
        RPM * levels.speed,
        np.maximum(values, top - RANGE),
        cmap="magma",
        shading="nearest",
        rasterized=True,
        vmin=top - RANGE,
        vmax=top,
    )
    figure.colorbar(image, ax=axes, label=_decibel(run_up))


def _key(axes: Any, cuts: Any, modes: tuple[Mode, ...]) -> None:
    """List the curves of the cuts and the natural frequencies beside them."""
    axes.set_axis_off()
    handles, labels = cuts.get_legend_handles_labels()
    axes.legend(
        handles,
        labels,
        fontsize=SMALL,
        loc="upper left",
        frameon=False,
        labelspacing=0.3,
        borderaxespad=0.0,
    )
    lines = ["natural frequencies, Hz", "(damping ratio)"]
    lines += [
        f"{mode.name}  {mode.frequency:.0f} ({mode.damping_ratio:.2g})"
        for mode in modes[:MOST_LISTED]
    ]
    if len(modes) > MOST_LISTED:
        lines.append(
            f"and {len(modes) - MOST_LISTED} more to {modes[-1].frequency:.0f}"
        )
    axes.text(0.05, 0.0, "\n".join(lines), fontsize=SMALL, va="bottom")


def _speed(run_up: RunUp) -> str:
    return f"speed of the {run_up.shaft}, r/min"


def _decibel(run_up: RunUp) -> str:
    unit = run_up.unit.replace("^2", "$^2$")
    reference = f"1 {unit}"
    if run_up.reference != 1.0:
        reference = f"10$^{{{np.log10(run_up.reference):.0f}}}$ {unit}"
    return f"RMS level, dB re {reference}"
