"""Figure of a wear life: sliding, pressure, wear along both flanks, curvature, history."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.style import (
    COLORS,
    FAULTY,
    GREY,
    SOUND,
    THIRD,
    curve,
    panels,
    save,
    titles,
)
from gensig.life.life_laws import LifeMap
from gensig.life.options import SIDES
from gensig.life.wear.wear_life import WearLife

Array = NDArray[np.float64]

TALLEST = 1.6  # times the largest radius of new flanks; flatter and hollow points are left out
POSITION = "position on the path of contact from A, mm (dotted: pitch point)"
ENDED_BY = {
    "depth": "",
    "transmission_error": ", limit of the transmission error",
    "vibration": ", limit of vibration",
}
SHOWN = (10, 20, 30, 40)  # snapshots: quarters of the life


def plot_wear_life(
    life: WearLife,
    speed: float,
    content: Mapping[str, Any],
    lives: LifeMap | None,
    path: Path,
) -> None:
    """Draw six panels; the last is the map of lives where there is one, else the history."""
    figure, axes = panels(2, 3, 15, 8)
    position = np.array(content["position_mm"])
    sliding, pressure, per_mesh, depth, radii, last = axes.flat
    _sliding(sliding, position, content)
    _pressure(pressure, position, content)
    _per_mesh(per_mesh, position, content)
    _depth(depth, position, life)
    _radii(radii, position, content)
    if lives is None:
        _history(last, content)
    else:
        _map(figure, last, lives, content)
    pair = life.case.pair
    for panel in axes.flat[:5]:
        panel.axvline(pair.pitch_point * 1e3, color=GREY, linewidth=0.6, linestyle=":")
        panel.set_xlabel(POSITION)
    figure.suptitle(
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, {life.case.torque:g} N m, "
        f"{content['speed_rpm']:g} r/min: {content['life_hours']:.4g} h "
        f"to {content['threshold_um']:.4g} um{ENDED_BY[content['ended_by']]} "
        f"(rule {content['rule']}, sharing {content['sharing']}, "
        f"geometry {content['geometry']})"
    )
    save(figure, path)


def _sliding(axes: Any, position: Array, content: Mapping[str, Any]) -> None:
    curve(axes, position, content["sliding_velocity_mm_per_s"], SOUND)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.set(title="Sliding, wheel's speed less pinion's", ylabel="mm/s")


def _pressure(axes: Any, position: Array, content: Mapping[str, Any]) -> None:
    curve(axes, position, content["contact_pressure_mpa"], SOUND, "new flanks")
    worn, label = content["contact_pressure_at_end_mpa"], "at the end of the life"
    curve(axes, position, worn, FAULTY, label, style="--")
    axes.set(title="Largest contact pressure", ylabel="MPa")
    axes.set_ylim(bottom=0.0)
    axes.legend()


def _per_mesh(axes: Any, position: Array, content: Mapping[str, Any]) -> None:
    for name, color in zip(SIDES, COLORS, strict=False):
        curve(axes, position, content[f"{name}_wear_per_mesh_nm"], color, name)
    axes.set(title="Wear of a mesh, new flanks", ylabel="nm")
    axes.legend()


def _depth(axes: Any, position: Array, life: WearLife) -> None:
    """Both flanks at the quarters of the life; the thinner, the earlier."""
    for side, (name, color) in enumerate(zip(SIDES, COLORS, strict=False)):
        labels = (None, None, None, name)
        for quarter, (snapshot, label) in enumerate(zip(SHOWN, labels, strict=True)):
            depth = life.depth[snapshot, side].max(axis=0) * 1e6
            curve(axes, position, depth, color, label, width=0.5 + 0.5 * quarter)
    axes.invert_yaxis()
    title = "Worn off at each quarter of the life"
    axes.set(title=title, ylabel="depth normal to the flank, um")
    axes.legend()


def _radii(axes: Any, position: Array, content: Mapping[str, Any]) -> None:
    highest = 0.0
    for name, color in zip(SIDES, COLORS, strict=False):
        new, worn, by_paper = (
            np.array(content[f"{name}_curvature_radius_{state}_mm"], dtype=float)
            for state in ("new", "worn", "by_eq_22")
        )
        shown = np.where((worn > 0.0) & (worn < TALLEST * new.max()), worn, np.nan)
        highest = max(highest, new.max())
        curve(axes, position, new, color, f"{name}, new")
        curve(axes, position, shown, color, f"{name}, worn profile", style="--")
        curve(axes, position, by_paper, THIRD, style=":")
    title = "Curvature radius (green: eq. 22 of the paper)"
    axes.set(title=title, ylabel="mm", ylim=(0.0, TALLEST * highest))
    axes.legend(fontsize="small")


def _history(axes: Any, content: Mapping[str, Any]) -> None:
    history, vibration = content["history"], content.get("vibration")
    for name, color in zip(SIDES, COLORS, strict=False):
        curve(axes, history["hours"], history[f"{name}_depth_um"], color, name)
    titles(axes, "Deepest point over time", "hours", "um")
    axes.legend(loc="upper left")
    error = history["transmission_error_peak_to_peak_um"]
    if vibration is not None:
        second = axes.twinx()
        hours = np.array(vibration["hours"])
        loudest = np.array(vibration["rms_m_per_s2"]).max(axis=1)
        shown = hours <= content["life_hours"] * 1.001
        second.plot(hours[shown], loudest[shown], ":o", color=GREY, markersize=3)
        second.set_ylabel("RMS of the loudest sensor (dotted), m/s2")
        second.set_ylim(bottom=0.0)
    elif math.isfinite(error[0]):
        second = axes.twinx()
        curve(second, history["hours"], error, GREY, style=":")
        second.set_ylabel("transmission error, peak to peak (dotted), um")
        second.set_ylim(bottom=0.0)


def _map(figure: Any, axes: Any, lives: LifeMap, content: Mapping[str, Any]) -> None:
    rpm, hours = lives.speed * 30.0 / math.pi, np.log10(lives.hours)
    image = axes.contourf(rpm, lives.torque, hours, levels=14, cmap="cividis")
    point = content["speed_rpm"], content["torque_nm"]
    axes.plot(*point, "o", color=FAULTY, clip_on=False)
    speed, torque = "speed of the pinion, r/min", "torque of the pinion, N m"
    titles(axes, "Life", speed, torque, xscale="log", yscale="log")
    figure.colorbar(image, ax=axes, label="log$_{10}$ of the hours")
