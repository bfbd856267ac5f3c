"""Figure of `diagnose detectability`: a row an observer, the best map large, all maps small."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.detectability.maps import Maps, best_and_worst
from diagnose.detectability.summary import short

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
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    small = max(4.6, 1.25 * len(maps.bandwidths))
    large = 1.2 * len(maps.torques_nm) + 3.0
    height = 2.0 * max(4.0, 1.15 * len(maps.channels))
    figure = Figure(figsize=(large + small, height), dpi=130)
    figure.set_layout_engine("constrained", hspace=0.03)
    FigureCanvasAgg(figure)
    parts: Any = figure.subfigures(2, 2, width_ratios=(large, small))
    for (left, right), row in zip(parts, (_known(maps), _seen(maps)), strict=True):
        image = _best_map(left, maps, row)
        axes = _all_maps(right, maps, row)
        right.colorbar(image, ax=axes, label=row.label, fraction=0.05, pad=0.02)
    records = f"{maps.n_units} machines, records of {maps.duration:g} s"
    title = f"Which test shows the fault? {fault_text(maps.fault)}; {records}"
    figure.suptitle(title, fontsize=13)
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
            *words, unit = key.split("_")
            sizes.append(f"{' '.join(words)} {value:g} {unit}")
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
    image = _image(axes, values, row)
    for cell, value in np.ndenumerate(values):
        if not np.isfinite(value):
            continue
        text = short(float(value))
        if row.auroc is not None:
            # adding 0 turns -0.00 into 0.00
            rounded = round(float(value), 2) + 0.0
            text = f"{rounded:.2f}\n({row.auroc[(*cell, channel, band)]:.2f})"
        color, weight = "black", "normal"
        if row.norm(value) < DARK:
            color = "white"
        if list(cell) == best:
            weight = "bold"
        axes.text(
            cell[1],
            cell[0],
            text,
            ha="center",
            va="center",
            color=color,
            fontsize=9.5,
            fontweight=weight,
        )
    for axis, numbers in ((axes.xaxis, maps.torques_nm), (axes.yaxis, maps.speeds_rpm)):
        axis.set_ticks(range(len(numbers)), [f"{number:g}" for number in numbers])
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
        _image(panel, row.values[:, :, channel, band], row)
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


def _image(axes: Any, values: FloatArray, row: _Row) -> Any:
    axes.set_facecolor("0.85")
    return axes.imshow(
        np.ma.masked_invalid(values),
        cmap=COLORS,
        norm=row.norm,
        origin="lower",
        aspect="auto",
    )
