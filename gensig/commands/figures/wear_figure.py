"""Figure of a wear life: sliding, pressure, wear along both flanks, curvature, history."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gensig.commands.figures.panels import (
    COLORS,
    FAULTY,
    GREY,
    THIRD,
    Figure,
    Mark,
    Panel,
    across,
    curve,
    curves,
    upright,
)
from gensig.life.life_laws import LifeMap
from gensig.life.options import SIDES
from gensig.life.wear.wear_life import WearLife

TALLEST = 1.6  # times the largest radius of new flanks; flatter and hollow points are left out
POSITION = "position on the path of contact from A, mm (dotted: pitch point)"
ENDED_BY = {
    "depth": "",
    "transmission_error": ", limit of the transmission error",
    "vibration": ", limit of vibration",
}
SHOWN = (10, 20, 30, 40)  # snapshots: quarters of the life


def wear_life_figure(
    life: WearLife, content: Mapping[str, Any], lives: LifeMap | None
) -> Figure:
    """Six panels; the last is the map of lives where there is one, else the history."""
    position, pair = content["position_mm"], life.case.pair
    pitch_point = upright(pair.pitch_point * 1e3, linewidth=0.6, linestyle=":")
    last = _history(content)
    if lives is not None:
        last = _map(lives, content)

    def along(title: str, unit: str, *marks: Mark, **look: Any) -> Panel:
        return Panel(title, POSITION, unit, [*marks, pitch_point], **look)

    sliding = curve(position, content["sliding_velocity_mm_per_s"])
    new = curve(position, content["contact_pressure_mpa"], "new flanks")
    label, worn = "at the end of the life", content["contact_pressure_at_end_mpa"]
    end = curve(position, worn, label, style="--")
    per_mesh = {name: content[f"{name}_wear_per_mesh_nm"] for name in SIDES}
    radii, highest = _radii(content)
    upper = [
        along("Sliding, wheel's speed less pinion's", "mm/s", sliding, across()),
        along("Largest contact pressure", "MPa", new, end, ylim=(0.0, None)),
        along("Wear of a mesh, new flanks", "nm", *curves(position, per_mesh)),
    ]
    lower = [
        along(
            "Worn off at each quarter of the life",
            "depth normal to the flank, um",
            *_depth(position, life),
            falls=True,
        ),
        along(
            "Curvature radius (green: eq. 22 of the paper)",
            "mm",
            *radii,
            ylim=(0.0, TALLEST * highest),
        ),
        last,
    ]
    return Figure(
        [upper, lower],
        (15, 8),
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, {life.case.torque:g} N m, "
        f"{content['speed_rpm']:g} r/min: {content['life_hours']:.4g} h "
        f"to {content['threshold_um']:.4g} um{ENDED_BY[content['ended_by']]} "
        f"(rule {content['rule']}, sharing {content['sharing']}, "
        f"geometry {content['geometry']})",
    )


def _depth(position: Any, life: WearLife) -> list[Mark]:
    """Both flanks at the quarters of the life; the thinner, the earlier."""
    marks = []
    for side, name in enumerate(SIDES):
        labels = (None, None, None, name)
        for quarter, (snapshot, label) in enumerate(zip(SHOWN, labels, strict=True)):
            depth = life.depth[snapshot, side].max(axis=0) * 1e6
            width = 0.5 + 0.5 * quarter
            marks.append(curve(position, depth, label, COLORS[side], width=width))
    return marks


def _radii(content: Mapping[str, Any]) -> tuple[list[Mark], float]:
    """Curvature radii of both flanks, and the largest of new ones."""
    position, marks, highest = content["position_mm"], [], 0.0
    for name, color in zip(SIDES, COLORS, strict=False):
        new, worn, by_paper = (
            np.array(content[f"{name}_curvature_radius_{state}_mm"], dtype=float)
            for state in ("new", "worn", "by_eq_22")
        )
        shown = np.where((worn > 0.0) & (worn < TALLEST * new.max()), worn, np.nan)
        highest = max(highest, new.max())
        marks += [
            curve(position, new, f"{name}, new", color),
            curve(position, shown, f"{name}, worn profile", color, "--"),
            curve(position, by_paper, None, THIRD, ":"),
        ]
    return marks, highest


def _history(content: Mapping[str, Any]) -> Panel:
    history, vibration = content["history"], content.get("vibration")
    hours, second = history["hours"], None
    error = history["transmission_error_peak_to_peak_um"]
    if vibration is not None:
        times = np.array(vibration["hours"])
        loudest = np.array(vibration["rms_m_per_s2"]).max(axis=1)
        shown = times <= content["life_hours"] * 1.001
        dots = curve(times[shown], loudest[shown], None, GREY, ":o", None, markersize=3)
        unit = "RMS of the loudest sensor (dotted), m/s2"
        second = Panel("", "", unit, [dots], ylim=(0.0, None))
    elif math.isfinite(error[0]):
        unit = "transmission error, peak to peak (dotted), um"
        dotted = curve(hours, error, None, GREY, ":")
        second = Panel("", "", unit, [dotted], ylim=(0.0, None))
    depths = curves(hours, {name: history[f"{name}_depth_um"] for name in SIDES})
    title = "Deepest point over time"
    return Panel(title, "hours", "um", depths, legend="upper left", second=second)


def _map(lives: LifeMap, content: Mapping[str, Any]) -> Panel:
    rpm, hours = lives.speed * 30.0 / math.pi, np.log10(lives.hours)
    values, look = (rpm, lives.torque, hours), {"levels": 14, "cmap": "cividis"}
    colors = Mark("contourf", values, look, "log$_{10}$ of the hours")
    point = content["speed_rpm"], content["torque_nm"]
    return Panel(
        "Life",
        "speed of the pinion, r/min",
        "torque of the pinion, N m",
        [colors, curve(*point, None, FAULTY, "o", clip_on=False)],
        log="xy",
    )
