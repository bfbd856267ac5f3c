"""Figure of the vibration over the speed, of variants of a machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gensig.commands.figures.panels import COLORS, Figure, Panel, across, curve, curves

SPEED = "speed of the pinion, r/min"
LEVEL = "RMS level, dB re 10$^{-6}$ m/s$^2$"


def variants_figure(content: Mapping[str, Any]) -> Figure:
    """Levels and their changes of all orders and of the mesh orders, by variant.

    ``content`` has the keys of ``gensig run-up --json``.
    """
    rpm = content["speeds_rpm"]
    look: dict[str, Any] = {"xlim": (rpm[0], rpm[-1]), "grid": True}
    levels, changes = [], []
    mesh = f"Mesh and harmonics to {content['harmonics']} x"
    for part, title in {"total": "All orders", "mesh": mesh}.items():
        marks = curves(rpm, content[f"{part}_level_db"])
        legend = {"total": "best"}.get(part)
        levels.append(Panel(title, SPEED, LEVEL, marks, legend=legend, **look))
        colors = dict(zip(content[f"{part}_level_db"], COLORS * 9, strict=False))
        marks = [
            curve(rpm, change, None, colors[name])
            for name, change in content[f"{part}_change_db"].items()
        ]
        title, unit = f"{title}: change", "dB against as configured"
        changes.append(Panel(title, SPEED, unit, [*marks, across()], **look))
    return Figure([levels, changes], (13, 7.5))
