"""Figure of a run-up: order map, waterfall with the natural frequencies, order cuts."""

from __future__ import annotations

import numpy as np

from gensig.commands.figures.panels import (
    COLORS,
    FREQUENCY,
    GREY,
    MODE,
    TOGETHER,
    Figure,
    Mark,
    Panel,
    curve,
    level_map,
    modes_across,
    note,
)
from gensig.commands.gears.run_up import RPM, RunUp
from gensig.signals.run_up.level_map import LevelMap

RANGE = 60.0  # dB, of the colors
MOST_LISTED = 11  # natural frequencies
MOST_CURVES = 12  # natural frequencies drawn across the order map
MOST_CROSSINGS = 20  # marked below the cuts
MARGIN = 0.05  # of the height, that a figure leaves free


def run_up_figure(run_up: RunUp, name: str) -> Figure:
    """Levels of one channel over speed; ``name`` is that of the record in the title."""
    rpm = RPM * run_up.orders.speed
    cuts = _cuts(run_up)
    key = _key(run_up, cuts)
    title = f"{name}: {run_up.channel}, {run_up.shaft} from {rpm[0]:.0f} to {rpm[-1]:.0f} r/min"
    return Figure(
        [[_order_map(run_up), _waterfall(run_up), key], [cuts, cuts, key]],
        (13, 9),
        title,
        ratios={"width_ratios": (2.4, 2.4, 1.2), "height_ratios": (1.25, 1.0)},
    )


def _order_map(run_up: RunUp) -> Panel:
    orders = run_up.orders
    rpm, highest = RPM * orders.speed, float(orders.axis[-1])
    title, marks = "Order map", [_levels(run_up, orders)]
    if 0 < len(run_up.modes) <= MOST_CURVES:
        title += " (dashed: natural frequencies)"
        for mode in run_up.modes:
            met = 60.0 * mode.frequency / rpm
            shown = met <= highest
            marks.append(curve(met[shown], rpm[shown], None, MODE, "--", 1.0))
    return Panel(
        title,
        f"order of the {run_up.shaft}",
        _speed(run_up),
        marks,
        xlim=(0.0, highest),
        above={f"{order:.4g}": order for order in run_up.cuts.values()},
    )


def _waterfall(run_up: RunUp) -> Panel:
    spectra = run_up.waterfall
    rpm, highest = RPM * spectra.speed, float(spectra.axis[-1])
    modes = {mode.name: mode.frequency for mode in run_up.modes}
    marks = [_levels(run_up, spectra)]
    for order in run_up.cuts.values():
        hertz = order * rpm / 60.0
        shown = hertz <= highest
        marks.append(curve(hertz[shown], rpm[shown], None, "white", ":", 0.8))
    return Panel(
        "Waterfall (dashed: natural frequencies, dotted: orders)",
        FREQUENCY,
        _speed(run_up),
        [*marks, *modes_across(modes, highest)],
        xlim=(0.0, highest),
        above=modes,
    )


def _cuts(run_up: RunUp) -> Panel:
    """Levels of the followed orders, with their peaks and their natural frequencies."""
    orders = run_up.orders
    rpm, total = RPM * orders.speed, run_up.level(orders.total)
    marks = [curve(rpm, total, "all orders", GREY, width=1.2)]
    levels, peaks = [], []
    for (name, order), color in zip(run_up.cuts.items(), COLORS, strict=False):
        level = run_up.level(orders.at(order))
        if not np.any(np.isfinite(level)):
            continue
        levels.append(level)
        found = run_up.peaks(order)
        marks += [
            curve(rpm, level, name, color),
            curve(rpm[found], level[found], None, color, "o", markersize=5),
        ]
        peaks += [(float(rpm[k]), float(level[k]), color) for k in found]
    low, high = np.nanmin([total, *levels]), np.nanmax([total, *levels])
    low, high = low - MARGIN * (high - low), high + MARGIN * (high - low)
    crossings = {order: run_up.crossings(order) for order in run_up.cuts.values()}
    lowest = min((float(np.nanmin(level)) for level in levels), default=np.inf)
    bottom = max(low, lowest - 3.0) - 0.06 * len(crossings) * (high - low)
    xlim, ylim = (rpm[0], rpm[-1]), (bottom, high + 0.12 * (high - bottom))
    title = "Order cuts; dots: peaks by speed"
    if 0 < sum(map(len, crossings.values())) <= MOST_CROSSINGS:
        title += "; triangles: an order meets a natural frequency"
        for row, met in enumerate(crossings.values()):
            height = ylim[0] + (0.025 + 0.05 * row) * (ylim[1] - ylim[0])
            marks += _crossings(met, COLORS[row], height, TOGETHER * (rpm[-1] - rpm[0]))
    marks += _peak_labels(peaks, xlim, ylim)
    return Panel(
        title,
        _speed(run_up),
        _decibel(run_up),
        marks,
        legend=None,
        grid=True,
        xlim=xlim,
        ylim=ylim,
    )


def _peak_labels(
    peaks: list[tuple[float, float, str]],
    xlim: tuple[float, float],
    ylim: tuple[float, float],
) -> list[Mark]:
    """The speed at each peak, above it; a label that would hide another one is left out."""
    (left, right), (low, high) = xlim, ylim
    written: list[tuple[float, float]] = []
    marks = []
    for rpm, level, color in sorted(peaks, key=lambda peak: -peak[1]):
        place = (rpm - left) / (right - left), (level - low) / (high - low)
        near = [
            abs(place[0] - x) < 0.05 and abs(place[1] - y) < 0.07 for x, y in written
        ]
        if not any(near):
            written.append(place)
            look = {"xytext": (0, 6), "ha": "center", "color": color, "fontsize": 9}
            marks.append(note(f"{rpm:.0f}", (rpm, level), **look))
    return marks


def _crossings(
    met: dict[str, float], color: str, height: float, least: float
) -> list[Mark]:
    """Speeds of one order at a height; a name that would hide another is left out."""
    marks, last = [], -np.inf
    for name, rpm in sorted(met.items(), key=lambda item: item[1]):
        marks.append(curve(rpm, height, None, color, "^", markersize=5))
        if rpm - last >= least:
            last = rpm
            marks.append(note(name, (rpm, height), xytext=(5, -3), color=color))
    return marks


def _levels(run_up: RunUp, levels: LevelMap) -> Mark:
    """Levels over the axis and speed, down to `RANGE` below the highest."""
    values = run_up.level(levels.rms)
    top = float(np.nanmax(values))
    shown = np.maximum(values, top - RANGE)
    ends = {"vmin": top - RANGE, "vmax": top}
    speed = RPM * levels.speed
    return level_map(levels.axis, speed, shown, _decibel(run_up), **ends)


def _key(run_up: RunUp, cuts: Panel) -> Panel:
    """The names of the curves of the cuts, and the natural frequencies below them."""
    modes = run_up.modes
    named = [mark.options for mark in cuts.marks if mark.options.get("label")]
    marks = [curve([], [], look["label"], look["color"]) for look in named]
    lines = ["natural frequencies, Hz", "(damping ratio)"]
    lines += [
        f"{mode.name}  {mode.frequency:.0f} ({mode.damping_ratio:.2g})"
        for mode in modes[:MOST_LISTED]
    ]
    if len(modes) > MOST_LISTED:
        lines.append(
            f"and {len(modes) - MOST_LISTED} more to {modes[-1].frequency:.0f}"
        )
    look = {"xycoords": "axes fraction", "va": "bottom"}
    listed = note("\n".join(lines), (0.05, 0.0), **look)
    return Panel("", "", "", [*marks, listed], legend="upper left", hidden=True)


def _speed(run_up: RunUp) -> str:
    return f"speed of the {run_up.shaft}, r/min"


def _decibel(run_up: RunUp) -> str:
    unit = run_up.unit.replace("^2", "$^2$")
    reference = f"1 {unit}"
    if run_up.reference != 1.0:
        reference = f"10$^{{{np.log10(run_up.reference):.0f}}}$ {unit}"
    return f"RMS level, dB re {reference}"
