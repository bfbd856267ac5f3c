"""Figure of a wear life.

Sliding and pressure, wear along both flanks, curvature, and the way to the end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.machine_figures import (
    COLOURS,
    FAULTY,
    GREY,
    SOUND,
    THIRD,
    pyplot,
    save,
)
from gensig.life.life_laws import LifeMap
from gensig.life.options import SIDES
from gensig.life.wear.wear_life import WearLife

Array = NDArray[np.float64]

TALLEST = 1.6  # times the largest radius of new flanks; flatter and hollow places are left out
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
    """Six panels.

    The last is the map of lives where there is one, else the greatest depths over time.
    """
    figure, axes = pyplot.subplots(2, 3, figsize=(15, 8), layout="constrained")
    place = np.array(content["position_mm"])
    _sliding(axes[0, 0], place, content)
    _pressure(axes[0, 1], place, content)
    _per_mesh(axes[0, 2], place, content)
    _depth(axes[1, 0], place, life)
    _radii(axes[1, 1], place, content)
    if lives is None:
        _history(axes[1, 2], content)
    else:
        _map(figure, axes[1, 2], lives, content)
    pitch = life.case.pair.pitch_point * 1e3
    for axis in axes.ravel()[:5]:
        axis.axvline(pitch, color=GREY, linewidth=0.6, linestyle=":")
        axis.set_xlabel("place on the path of contact from A, mm (dotted: pitch point)")
    pair = life.case.pair
    figure.suptitle(
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, {life.case.torque:g} N m, {content['speed_rpm']:g} r/min: "
        f"{content['life_hours']:.4g} h to {content['threshold_um']:.4g} um{ENDED_BY[content['ended_by']]} (rule "
        f"{content['rule']}, sharing {content['sharing']}, geometry {content['geometry']})"
    )
    save(figure, path)


def _sliding(axes: Any, place: Array, content: Mapping[str, Any]) -> None:
    axes.plot(place, content["sliding_velocity_mm_per_s"], color=SOUND)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.set(title="Sliding, wheel's speed less pinion's", ylabel="mm/s")


def _pressure(axes: Any, place: Array, content: Mapping[str, Any]) -> None:
    axes.plot(place, content["contact_pressure_mpa"], color=SOUND, label="new flanks")
    axes.plot(
        place,
        content["contact_pressure_at_end_mpa"],
        "--",
        color=FAULTY,
        label="at the end of the life",
    )
    axes.set(title="Largest contact pressure", ylabel="MPa")
    axes.set_ylim(bottom=0.0)
    axes.legend()


def _per_mesh(axes: Any, place: Array, content: Mapping[str, Any]) -> None:
    for name, colour in zip(SIDES, COLOURS, strict=False):
        axes.plot(place, content[f"{name}_wear_per_mesh_nm"], color=colour, label=name)
    axes.set(title="Wear of a mesh, new flanks", ylabel="nm")
    axes.legend()


def _depth(axes: Any, place: Array, life: WearLife) -> None:
    """Both flanks at the quarters of the life; the thinner, the earlier."""
    for side, (name, colour) in enumerate(zip(SIDES, COLOURS, strict=False)):
        for number, snapshot in enumerate(SHOWN):
            depth = life.depth[snapshot, side].max(axis=0) * 1e6
            last = number == len(SHOWN) - 1
            axes.plot(
                place,
                depth,
                color=colour,
                linewidth=0.5 + 0.5 * number,
                label=name if last else None,
            )
    axes.invert_yaxis()
    axes.set(
        title="Worn off at each quarter of the life",
        ylabel="depth normal to the flank, um",
    )
    axes.legend()


def _radii(axes: Any, place: Array, content: Mapping[str, Any]) -> None:
    highest = 0.0
    for name, colour in zip(SIDES, COLOURS, strict=False):
        new = np.array(content[f"{name}_curvature_radius_new_mm"])
        worn = np.array(
            [
                math.nan if one is None else one
                for one in content[f"{name}_curvature_radius_worn_mm"]
            ]
        )
        shown = np.where((worn > 0.0) & (worn < TALLEST * new.max()), worn, np.nan)
        highest = max(highest, new.max())
        axes.plot(place, new, color=colour, label=f"{name}, new")
        axes.plot(place, shown, "--", color=colour, label=f"{name}, worn profile")
        axes.plot(
            place,
            content[f"{name}_curvature_radius_by_eq_22_mm"],
            ":",
            color=THIRD,
            label=None,
        )
    axes.set(
        title="Curvature radius (green: eq. 22 of the paper)",
        ylabel="mm",
        ylim=(0.0, TALLEST * highest),
    )
    axes.legend(fontsize="small")


def _history(axes: Any, content: Mapping[str, Any]) -> None:
    history = content["history"]
    for name, colour in zip(SIDES, COLOURS, strict=False):
        axes.plot(
            history["hours"], history[f"{name}_depth_um"], color=colour, label=name
        )
    axes.set(title="Deepest place over time", xlabel="hours", ylabel="um")
    axes.legend(loc="upper left")
    error, vibration = (
        history["transmission_error_peak_to_peak_um"],
        content.get("vibration"),
    )
    if vibration is not None:
        beside = axes.twinx()
        loudest = np.array(vibration["rms_m_per_s2"]).max(axis=1)
        shown = np.array(vibration["hours"]) <= content["life_hours"] * 1.001
        beside.plot(
            np.array(vibration["hours"])[shown],
            loudest[shown],
            ":o",
            color=GREY,
            markersize=3,
        )
        beside.set_ylabel("RMS of the loudest sensor (dotted), m/s2")
        beside.set_ylim(bottom=0.0)
    elif error[0] is not None:
        beside = axes.twinx()
        beside.plot(history["hours"], error, ":", color=GREY)
        beside.set_ylabel("transmission error, peak to peak (dotted), um")
        beside.set_ylim(bottom=0.0)


def _map(figure: Any, axes: Any, lives: LifeMap, content: Mapping[str, Any]) -> None:
    rpm = lives.speed * 30.0 / math.pi
    image = axes.contourf(
        rpm, lives.torque, np.log10(lives.hours), levels=14, cmap="cividis"
    )
    axes.plot(
        content["speed_rpm"], content["torque_nm"], "o", color=FAULTY, clip_on=False
    )
    axes.set(
        title="Life",
        xlabel="speed of the pinion, r/min",
        ylabel="torque of the pinion, N m",
    )
    axes.set(xscale="log", yscale="log")
    figure.colorbar(image, ax=axes, label="log$_{10}$ of the hours")
