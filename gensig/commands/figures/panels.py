"""Figures as data: marks on panels, panels in rows. `draw` alone loads matplotlib."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

# Colors that color-blind readers can tell apart.
SOUND, FAULTY, THIRD, FOURTH = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
GREY = "#777777"
COLORS = (SOUND, FAULTY, THIRD, FOURTH, "#56B4E9", GREY)
MODE = COLORS[4]  # natural frequencies
TOGETHER = 0.035  # of an axis, within which marks share a label
DPI = 130
SMALL = 8  # points, of legends and notes
# ticks of a cycle of two turns, degrees
QUARTERS = {degrees: f"{degrees}" for degrees in range(0, 721, 90)}

# Axis labels that several figures share.
MESH_PERIODS = "mesh periods"
FIRST_SLICE = "position of the first slice, base pitches"
STIFFNESS = "stiffness, 10$^9$ N/m"
FREQUENCY = "frequency, Hz"
WITH_MODES = "frequency, Hz (dashed: natural frequencies)"
ANGLE_AMPLITUDE = "amplitude, degrees"
# of a legend below its panel
BELOW: dict[str, Any] = {
    "loc": "upper center",
    "bbox_to_anchor": (0.5, -0.14),
    "frameon": False,
}


Limits: TypeAlias = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True, eq=False)
class Mark:
    """Lines, bars, texts or a map on a panel.

    Attributes
    ----------
    kind : method of matplotlib's axes that draws it
    values, options : what it takes; a color of None is the next of `COLORS`
    scale : label of the scale of colors of a map
    """

    kind: str
    values: tuple[Any, ...]
    options: Mapping[str, Any]
    scale: str | None = None

    def draw(self, axes: Any, colors: Iterator[str]) -> None:
        """Draw it."""
        options = dict(self.options)
        if options.get("color", "") is None:
            options["color"] = next(colors)
        drawn = getattr(axes, self.kind)(*self.values, **options)
        if self.scale is not None:
            axes.figure.colorbar(drawn, ax=axes, label=self.scale)


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """Marks on the same axes, with a title and the labels of both.

    Attributes
    ----------
    marks : in the order in which they are drawn
    legend, columns : place and columns of the legend, where a mark has a label; also "below"
    above : places of the abscissa that have names above the panel, by name
    second : a panel whose ordinate is on the right of this one
    margin : share of the height that is left free above and below
    dense : True for a low panel, with a small title and small numbers
    hidden : True for marks and a legend without axes
    falls : True where the ordinate grows downwards
    log : names of the logarithmic axes, such as xy
    ticks : names of places on the abscissa
    """

    title: str
    x: str
    y: str
    marks: Sequence[Mark]
    _: KW_ONLY
    legend: str | None = "best"
    columns: int = 1
    above: Mapping[str, float] = field(default_factory=dict)
    second: Panel | None = None
    margin: float = 0.05
    grid: bool = False
    dense: bool = False
    hidden: bool = False
    falls: bool = False
    log: str = ""
    aspect: str = "auto"
    xlim: Limits = (None, None)
    ylim: Limits = (None, None)
    ticks: Mapping[Any, str] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """Rows of panels, ``size`` inches wide and high; one that stands in several cells spans them.

    None is an empty cell, ``below`` a text; ``ratios`` are of widths or heights, as of matplotlib.
    """

    rows: Sequence[Sequence[Panel | None]]
    size: tuple[float, float]
    title: str = ""
    below: str = ""
    ratios: Mapping[str, Sequence[float]] = field(default_factory=dict)


def curve(
    x: ArrayLike,
    y: ArrayLike,
    label: str | None = None,
    color: str | None = None,
    style: str = "-",
    width: float | None = None,
    **options: Any,
) -> Mark:
    """One line; ``width`` in points, ``style`` as of matplotlib."""
    look = {"color": color, "label": label, "linewidth": width, **options}
    return Mark("plot", (x, y, style), look)


def curves(x: ArrayLike, rows: Mapping[str, ArrayLike], **options: Any) -> list[Mark]:
    """Lines over the same abscissa by their labels, each in a color of its own."""
    return [curve(x, row, name, **options) for name, row in rows.items()]


def bars(x: ArrayLike, height: ArrayLike, **options: Any) -> Mark:
    """Bars at places of the abscissa."""
    return Mark("bar", (x, height), options)


def band(
    x: ArrayLike, low: ArrayLike, high: ArrayLike, color: str, **options: Any
) -> Mark:
    """The room between two curves."""
    look = {"color": color, "alpha": 0.15, "linewidth": 0.0, **options}
    return Mark("fill_between", (x, low, high), look)


def across(y: float = 0.0, **options: Any) -> Mark:
    """A line from left to right, that of ordinate zero."""
    return Mark("axhline", (y,), {"color": GREY, "linewidth": 0.8, **options})


def upright(x: float, **options: Any) -> Mark:
    """A line from the bottom to the top."""
    return Mark("axvline", (x,), {"color": GREY, **options})


def level_map(
    x: ArrayLike, y: ArrayLike, level: ArrayLike, scale: str, **options: Any
) -> Mark:
    """Levels as colors over abscissa and ordinate."""
    look = {"cmap": "magma", "shading": "nearest", "rasterized": True, **options}
    return Mark("pcolormesh", (x, y, level), look, scale)


def note(text: str, place: tuple[float, float], **options: Any) -> Mark:
    """A text at a place, or some points beside it, ``xytext``."""
    if "xytext" in options:
        options["textcoords"] = "offset points"
    return Mark("annotate", (text, place), {"fontsize": SMALL, **options})


def modes_across(modes: Mapping[str, float], highest: float) -> list[Mark]:
    """Natural frequencies up to the highest, Hz by name, across a waterfall."""
    look = {"color": MODE, "linestyle": "--", "linewidth": 1.0}
    return [upright(hertz, **look) for hertz in modes.values() if hertz < highest]


def waterfall(
    hertz: ArrayLike,
    rpm: Any,
    level: ArrayLike,
    orders: Sequence[float],
    *,
    rays: bool = False,
    **ends: float,
) -> list[Mark]:
    """Levels over frequency and speed, log10 of degrees, with names of orders at their top."""
    marks = [level_map(hertz, rpm, level, "log10 of the amplitude in degrees", **ends)]
    look = {"color": "white", "ha": "center", "va": "top"}
    for order in orders:
        ray = order * rpm / 60.0
        if ray[-1] < np.max(hertz):
            if rays:
                marks.append(curve(ray, rpm, None, "white", ":", 0.4))
            marks.append(note(f"{order:g}", (ray[-1], rpm[-1]), **look))
    return marks


def draw(figure: Figure, path: Path) -> None:
    """Write a figure in the format of the file name."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Page

    page = Page(figsize=figure.size, layout="constrained")
    panels = {id(panel): panel for row in figure.rows for panel in row if panel}
    layout: list[Any] = [list(map(id, row)) for row in figure.rows]
    ratios: dict[str, Any] = dict(figure.ratios)
    with rc_context({"axes.formatter.useoffset": False}):
        cells = page.subplot_mosaic(layout, empty_sentinel=id(None), **ratios)
    for name, axes in cells.items():
        _draw_panel(axes, panels[name])
    if figure.title:
        page.suptitle(figure.title)
    if figure.below:
        page.supxlabel(figure.below, fontsize="small", x=0.02, ha="left")
    page.savefig(path, dpi=DPI)


def _draw_panel(axes: Any, panel: Panel) -> None:
    colors = itertools.cycle(COLORS)
    for mark in panel.marks:
        mark.draw(axes, colors)
    axes.set(title=panel.title, xlabel=panel.x, ylabel=panel.y, aspect=panel.aspect)
    for axis in panel.log:
        axes.set(**{f"{axis}scale": "log"})
    axes.margins(y=panel.margin)
    axes.set(xlim=panel.xlim, ylim=panel.ylim)
    if panel.ticks is not None:
        axes.set_xticks(list(panel.ticks), list(panel.ticks.values()))
    if panel.falls:
        axes.invert_yaxis()
    if panel.dense:
        axes.title.set_fontsize(9)
        axes.tick_params(labelsize=7)
    if panel.grid:
        axes.grid(alpha=0.3)
    if panel.above:
        _label_above(axes, panel.above)
    if panel.hidden:
        axes.set_axis_off()
    handles, labels = axes.get_legend_handles_labels()
    if panel.second is not None:
        twin = axes.twinx()
        _draw_panel(twin, panel.second)
        more = twin.get_legend_handles_labels()
        handles, labels = handles + more[0], labels + more[1]
    if labels and panel.legend is not None:
        look = {"loc": panel.legend, "fontsize": SMALL, "ncols": panel.columns}
        if panel.legend == "below":
            look |= BELOW
        axes.legend(handles, labels, **look)


def _label_above(axes: Any, places: Mapping[str, float]) -> None:
    """Names of places above the axes, as far as they reach; near ones share a label."""
    groups: list[list[str]] = []
    last, highest = -np.inf, axes.get_xlim()[1]
    for name, place in sorted(places.items(), key=lambda item: item[1]):
        if place > highest:
            continue
        if place - last < TOGETHER * highest:
            groups[-1].append(name)
        else:
            groups.append([name])
        last = place
    middles = [np.mean([places[name] for name in group]) for group in groups]
    ends = [" to\n".join(dict.fromkeys((group[0], group[-1]))) for group in groups]
    axes.secondary_xaxis("top").set_xticks(middles, ends, fontsize=SMALL)
