"""The figure of `diagnose detectability`.

A row an observer, the best map large, all channels and bandwidths small.
"""

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
LEAST_TOP = 1.0  # d' at the top of the scale of indicators, so that next to nothing does not look like much


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """One observer.

    Values (speed, torque, channel, band), their scale, and what is written into a cell.
    """

    title: str
    label: str
    values: FloatArray
    norm: Any
    texts: FloatArray | None


def detectability_figure(path: Path, maps: Maps) -> None:
    """Write the figure; its type is that of the name."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n_channels, n_bands = len(maps.channels), len(maps.bandwidths)
    small = max(4.6, 1.25 * n_bands)
    figure = Figure(
        figsize=(
            1.2 * len(maps.torques_nm) + 3.0 + small,
            2.0 * max(4.0, 1.15 * n_channels),
        ),
        dpi=130,
    )
    figure.set_layout_engine("constrained", hspace=0.03)
    FigureCanvasAgg(figure)
    parts: Any = figure.subfigures(
        2, 2, width_ratios=(1.2 * len(maps.torques_nm) + 3.0, small)
    )
    for (large, many), row in zip(parts, _rows(maps), strict=True):
        image = _large(large, maps, row)
        axes = _many(many, maps, row)
        many.colorbar(image, ax=axes, label=row.label, fraction=0.05, pad=0.02)
    noise = f"{maps.n_units} machines, records of {maps.duration:g} s"
    figure.suptitle(
        f"Which test shows the fault? {fault_text(maps.fault)}; {noise}", fontsize=13
    )
    figure.savefig(path, metadata={"Software": None} if path.suffix == ".png" else None)


def fault_text(fault: dict[str, Any]) -> str:
    """The fault with its sizes: 'crack on the pinion (crack depth 1 mm, crack angle 45 deg)'."""
    parts = fault.get("parts") or [fault]
    return " and ".join(_part_text(part) for part in parts)


def _part_text(part: dict[str, Any]) -> str:
    sizes = [
        (key.split("_"), value)
        for key, value in part.items()
        if isinstance(value, int | float) and key != "tooth"
    ]
    told = ", ".join(
        f"{' '.join(words[:-1])} {value:g} {words[-1]}" for words, value in sizes[:3]
    )
    return f"{str(part['kind']).replace('_', ' ')} on the {part['gear']}" + (
        f" ({told})" if told else ""
    )


def _rows(maps: Maps) -> list[_Row]:
    from matplotlib.colors import LogNorm, Normalize

    known = np.where(maps.known > 0.0, maps.known, np.nan)
    low, high = (
        (np.nanmin(known), np.nanmax(known)) if np.isfinite(known).any() else (0.1, 1.0)
    )
    top = (
        max(LEAST_TOP, float(np.nanmax(maps.seen)))
        if np.isfinite(maps.seen).any()
        else LEAST_TOP
    )
    return [
        _Row(
            title="Physically there",
            label="d' of a filter that knows what the fault adds",
            values=maps.known,
            norm=LogNorm(low, max(high, 1.01 * low)),
            texts=None,
        ),
        _Row(
            title="Seen by indicators among machines",
            label="d' of the indicator chosen on other machines",
            values=maps.seen,
            norm=Normalize(0.0, top),
            texts=maps.auroc,
        ),
    ]


def _large(figure: Any, maps: Maps, row: _Row) -> Any:
    """Speed by torque for the best channel and bandwidth, values in the cells."""
    speed, torque, channel, band = best_and_worst(row.values)[0]
    values = row.values[:, :, channel, band]
    axes = figure.subplots()
    image = _image(axes, values, row)
    for place in np.ndindex(values.shape):
        if not np.isfinite(values[place]):
            continue
        text = short(float(values[place]))
        if row.texts is not None:
            text = f"{round(float(values[place]), 2) + 0.0:.2f}\n({row.texts[:, :, channel, band][place]:.2f})"
        color = "white" if row.norm(values[place]) < DARK else "black"
        weight = "bold" if place == (speed, torque) else "normal"
        axes.text(
            place[1],
            place[0],
            text,
            ha="center",
            va="center",
            color=color,
            fontsize=9.5,
            fontweight=weight,
        )
    axes.set_xticks(
        range(len(maps.torques_nm)), [f"{one:g}" for one in maps.torques_nm]
    )
    axes.set_yticks(
        range(len(maps.speeds_rpm)), [f"{one:g}" for one in maps.speeds_rpm]
    )
    inside = "d'" if row.texts is None else "d' (AUROC)"
    axes.set(xlabel="torque of the pinion, N m", ylabel="speed of the pinion, r/min")
    test = f"{maps.channels[channel]}, up to {maps.bandwidths[band] / 1e3:.3g} kHz"
    axes.set_title(f"{row.title}\nbest: {test}; in the cells {inside}", fontsize=10.5)
    return image


def _many(figure: Any, maps: Maps, row: _Row) -> Any:
    """The same map for every channel (down) and bandwidth (across), on the same scale of colours."""
    n_channels, n_bands = len(maps.channels), len(maps.bandwidths)
    axes = figure.subplots(n_channels, n_bands, squeeze=False)
    _, _, best_channel, best_band = best_and_worst(row.values)[0]
    for (channel, band), panel in np.ndenumerate(axes):
        _image(panel, row.values[:, :, channel, band], row)
        panel.set_xticks([])
        panel.set_yticks([])
        if channel == 0:
            panel.set_title(f"to {maps.bandwidths[band] / 1e3:.3g} kHz", fontsize=9)
        if band == 0:
            panel.set_ylabel(maps.channels[channel], fontsize=9)
        if (channel, band) == (best_channel, best_band):
            for edge in panel.spines.values():
                edge.set(color="#D55E00", linewidth=2.5)
    figure.suptitle(
        "every channel and bandwidth: speed upwards, torque to the right", fontsize=10
    )
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
