"""Colors, panels, lines and titles of all figures. The first figure loads matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

# Colors that color-blind readers can tell apart.
SOUND, FAULTY, THIRD, FOURTH = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
GREY = "#777777"
COLORS = (SOUND, FAULTY, THIRD, FOURTH, "#56B4E9", GREY)
DPI = 130
SMALL = 8  # points, of legends in dense figures

# Axis labels that several figures share.
MESH_PERIODS = "mesh periods"
FIRST_SLICE = "position of the first slice, base pitches"
STIFFNESS = "stiffness, 10$^9$ N/m"
FREQUENCY = "frequency, Hz"
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
