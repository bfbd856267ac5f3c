"""Colors, panels, lines and titles of all figures. The first figure loads matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

# Colors that color-blind readers can tell apart.
SOUND, FAULTY, THIRD, FOURTH = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
GREY = "#777777"
COLORS = (SOUND, FAULTY, THIRD, FOURTH, "#56B4E9", GREY)
MODE = COLORS[4]  # natural frequencies
TOGETHER = 0.035  # of an axis, within which marks share a label
DPI = 130
SMALL = 8  # points, of legends in dense figures

# Axis labels that several figures share.
MESH_PERIODS = "mesh periods"
FIRST_SLICE = "position of the first slice, base pitches"
STIFFNESS = "stiffness, 10$^9$ N/m"
FREQUENCY = "frequency, Hz"
WITH_MODES = "frequency, Hz (dashed: natural frequencies)"
ANGLE_AMPLITUDE = "amplitude, degrees"


def panels(n_rows: int, n_columns: int, width: float, height: float) -> tuple[Any, Any]:
    """An empty figure, and its axes by row and column; width and height in inches."""
    figure = empty_figure(width, height)
    return figure, figure.subplots(n_rows, n_columns, squeeze=False)


def empty_figure(width: float, height: float) -> Any:
    """A figure without axes; width and height in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def save(figure: Any, path: Path, *, dpi: int = DPI) -> None:
    """Write a figure in the format of the file name."""
    figure.savefig(path, dpi=dpi)


def curve(
    axes: Any,
    x: ArrayLike,
    y: ArrayLike,
    color: str,
    label: str | None = None,
    *,
    style: str = "-",
    width: float | None = None,
) -> None:
    """Draw one line; ``width`` in points, ``style`` as of matplotlib."""
    axes.plot(x, y, style, color=color, label=label, linewidth=width)


def titles(axes: Any, title: str, x: str, y: str, **more: Any) -> None:
    """Set the title, the axis labels, and further properties of the axes."""
    axes.set(title=title, xlabel=x, ylabel=y, **more)


def cycle_ticks(axes: Any) -> None:
    """Limit the abscissa to one cycle of two turns, a tick each quarter turn."""
    axes.set(xlim=(0, 720), xticks=range(0, 721, 90))


def zero_line(axes: Any) -> None:
    """Draw the line of ordinate zero."""
    axes.axhline(0.0, color=GREY, linewidth=0.8)


def band(axes: Any, x: ArrayLike, low: ArrayLike, high: ArrayLike, color: str) -> None:
    """Fill between two curves."""
    axes.fill_between(x, low, high, color=color, alpha=0.15, linewidth=0.0)


def waterfall(
    figure: Any,
    axes: Any,
    frequency: ArrayLike,
    rpm: Any,
    level: ArrayLike,
    **ends: Any,
) -> None:
    """Draw levels over frequency (Hz) and speed (r/min), log10 of degrees."""
    image = axes.pcolormesh(
        frequency,
        rpm,
        level,
        cmap="magma",
        shading="nearest",
        rasterized=True,
        **ends,
    )
    figure.colorbar(image, ax=axes, label="log10 of the amplitude in degrees")


def mark_orders(
    axes: Any, orders: Sequence[float], rpm: Any, highest: float, *, lines: bool = False
) -> None:
    """Write orders at the top of a waterfall up to a frequency, with rays if asked for."""
    top = rpm[-1]
    for order in orders:
        if order * top / 60.0 < highest:
            if lines:
                curve(axes, order * rpm / 60.0, rpm, "white", style=":", width=0.4)
            axes.annotate(
                f"{order:g}",
                (order * top / 60.0, top),
                color="white",
                fontsize=SMALL,
                ha="center",
                va="top",
            )


def mark_modes(axes: Any, modes: Mapping[str, float], highest: float) -> None:
    """Draw natural frequencies, Hz by name, up to one across a waterfall, and name them above."""
    for frequency in modes.values():
        if frequency < highest:
            axes.axvline(frequency, color=MODE, linestyle="--", linewidth=1.0)
    label_above(axes, modes, highest)


def label_above(axes: Any, places: Mapping[str, float], highest: float) -> None:
    """Label places of the abscissa above the axes; near ones share a label."""
    groups: list[list[str]] = []
    last = -np.inf
    for name, place in sorted(places.items(), key=lambda item: item[1]):
        if place > highest:
            continue
        if place - last < TOGETHER * highest:
            groups[-1].append(name)
        else:
            groups.append([name])
        last = place
    middles = [np.mean([places[name] for name in group]) for group in groups]
    ends = [dict.fromkeys((group[0], group[-1])) for group in groups]
    top = axes.secondary_xaxis("top")
    top.set_xticks(middles, [" to\n".join(names) for names in ends], fontsize=SMALL)
