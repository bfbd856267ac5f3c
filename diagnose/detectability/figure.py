"""Figure of `diagnose detectability`: a row an observer, the best map large, all maps small."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.detectability.maps import Maps, best_and_worst
from diagnose.detectability.summary import short, two_digits
from gensig.text.parameters import size_words

FloatArray = NDArray[np.floating]

COLORS = "cividis"  # even steps for every kind of colour vision, and in print
DARK = 0.55  # of the colour scale: below it white letters are read best
LEAST_TOP = (
    1.0  # d' at the top of the scale of indicators, so that small values look small
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """Maps of one observer.

    Attributes
    ----------
    values : (speed, torque, channel, band)
    norm : scale of the colors
    auroc : like the values, written below them; None where there is none
    """

    title: str
    label: str
    values: FloatArray
    norm: Any
    auroc: FloatArray | None = None

    @property
    def best(self) -> tuple[int, ...]:
        """Speed, torque, channel and band of the largest value."""
        return best_and_worst(self.values)[0]


def detectability_figure(path: Path, maps: Maps) -> None:
    """Write the figure; its type is that of the name."""
    small = max(4.6, 1.25 * len(maps.bandwidths))
    large = 1.2 * len(maps.torques_nm) + 3.0
    height = 2.0 * max(4.0, 1.15 * len(maps.channels))
    figure = new_figure(large + small, height, hspace=0.03)
    parts: Any = figure.subfigures(2, 2, width_ratios=(large, small))
    for (left, right), row in zip(parts, (_known(maps), _seen(maps)), strict=True):
        image = _best_map(left, maps, row)
        axes = _all_maps(right, maps, row)
        right.colorbar(image, ax=axes, label=row.label, fraction=0.05, pad=0.02)
    records = f"{maps.n_units} machines, records of {maps.duration:g} s"
    title = f"Which test shows the fault? {fault_text(maps.fault)}; {records}"
    figure.suptitle(title, fontsize=13)
    save(figure, path)


def new_figure(width: float, height: float, **spaces: float) -> Any:
    """An empty figure, inches, without the state of pyplot: no display is needed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=130)
    figure.set_layout_engine("constrained", **spaces)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Any, path: Path) -> None:
    """Write a figure, a PNG with the same bytes on every run."""
    metadata = None
    if path.suffix == ".png":
        metadata = {"Software": None}
    figure.savefig(path, metadata=metadata)


def fault_text(fault: dict[str, Any]) -> str:
    """The fault with its sizes: 'crack on the pinion (crack depth 1 mm, crack angle 45 deg)'."""
    parts = fault.get("parts") or [fault]
    return " and ".join(_part_text(part) for part in parts)


def _part_text(part: dict[str, Any]) -> str:
    text = f"{str(part['kind']).replace('_', ' ')} on the {part['gear']}"
    sizes = []
    for key, value in part.items():
        if isinstance(value, int | float) and key != "tooth":
            words, unit = size_words(key)
            sizes.append(f"{words} {value:g} {unit}")
    if sizes:
        text += f" ({', '.join(sizes[:3])})"
    return text


def _known(maps: Maps) -> _Row:
    """Maps of the observer that knows what the fault adds."""
    from matplotlib.colors import LogNorm

    known = maps.known[np.isfinite(maps.known) & (maps.known > 0.0)]
    low, high = 0.1, 1.0
    if known.size:
        low, high = known.min(), known.max()
    return _Row(
        title="Physically there",
        label="d' of a filter that knows what the fault adds",
        values=maps.known,
        norm=LogNorm(low, max(high, 1.01 * low)),
    )


def _seen(maps: Maps) -> _Row:
    """Maps of the observer that knows indicators."""
    from matplotlib.colors import Normalize

    return _Row(
        title="Seen by indicators among machines",
        label="d' of the indicator chosen on other machines",
        values=maps.seen,
        norm=Normalize(0.0, float(np.nanmax([LEAST_TOP, *maps.seen.flat]))),
        auroc=maps.auroc,
    )


def _best_map(figure: Any, maps: Maps, row: _Row) -> Any:
    """Speed by torque for the best channel and bandwidth, values in the cells."""
    *best, channel, band = row.best
    values = row.values[:, :, channel, band]
    axes = figure.subplots()
    image = shades(axes, values, row.norm)

    def text(cell: tuple[int, ...]) -> str:
        if row.auroc is None:
            return short(float(values[cell]))
        auroc = row.auroc[(*cell, channel, band)]
        return f"{two_digits(float(values[cell]))}\n({auroc:.2f})"

    write_cells(axes, values, row.norm, text, bold=tuple(best), fontsize=9.5)
    set_numbers(axes, maps.torques_nm, maps.speeds_rpm)
    axes.set(xlabel="torque of the pinion, N m", ylabel="speed of the pinion, r/min")
    inside = "d'"
    if row.auroc is not None:
        inside = "d' (AUROC)"
    test = f"{maps.channels[channel]}, up to {maps.bandwidths[band] / 1e3:.3g} kHz"
    title = f"{row.title}\nbest: {test}; in the cells {inside}"
    axes.set_title(title, fontsize=10.5)
    return image


def _all_maps(figure: Any, maps: Maps, row: _Row) -> Any:
    """The same map for every channel (down) and bandwidth (across), on the same scale of colors."""
    axes = figure.subplots(len(maps.channels), len(maps.bandwidths), squeeze=False)
    for (channel, band), panel in np.ndenumerate(axes):
        shades(panel, row.values[:, :, channel, band], row.norm)
        panel.set_xticks([])
        panel.set_yticks([])
        if channel == 0:
            panel.set_title(f"to {maps.bandwidths[band] / 1e3:.3g} kHz", fontsize=9)
        if band == 0:
            panel.set_ylabel(maps.channels[channel], fontsize=9)
        if (channel, band) == row.best[2:]:
            for edge in panel.spines.values():
                edge.set(color="#D55E00", linewidth=2.5)
    title = "every channel and bandwidth: speed upwards, torque to the right"
    figure.suptitle(title, fontsize=10)
    return axes


def shades(axes: Any, values: FloatArray, norm: Any) -> Any:
    """Values, (up, across), as colors; what is no number is grey."""
    axes.set_facecolor("0.85")
    return axes.imshow(
        np.ma.masked_invalid(values),
        cmap=COLORS,
        norm=norm,
        origin="lower",
        aspect="auto",
    )


def write_cells(
    axes: Any,
    values: FloatArray,
    norm: Any,
    text: Callable[[tuple[int, ...]], str],
    *,
    bold: tuple[int, ...] = (),
    **font: float,
) -> None:
    """Write the text of each cell that has a number; one of them may be bold."""
    for cell, value in np.ndenumerate(values):
        if not np.isfinite(value):
            continue
        color, weight = "black", "normal"
        if norm(value) < DARK:
            color = "white"
        if cell == bold:
            weight = "bold"
        place = {"ha": "center", "va": "center", "fontweight": weight}
        axes.text(cell[1], cell[0], text(cell), color=color, **place, **font)


def set_numbers(axes: Any, across: Sequence[float], up: Sequence[float]) -> None:
    """Numbers of the columns and rows of cells."""
    for axis, numbers in ((axes.xaxis, across), (axes.yaxis, up)):
        axis.set_ticks(range(len(numbers)), [f"{number:g}" for number in numbers])
