"""Figure of the vibration over the speed, of variants of a machine."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gensig.commands.figures.style import (
    COLORS,
    SMALL,
    curve,
    panels,
    save,
    titles,
    zero_line,
)

SPEED = "speed of the pinion, r/min"
LEVEL = "RMS level, dB re 10$^{-6}$ m/s$^2$"


def plot_variants(content: Mapping[str, Any], path: Path) -> None:
    """Draw levels and their changes of all orders and of the mesh orders, by variant.

    ``content`` has the keys of ``gensig run-up --json``.
    """
    figure, axes = panels(2, 2, 13, 7.5)
    harmonics = content["harmonics"]
    columns = {"total": "All orders", "mesh": f"Mesh and harmonics to {harmonics} x"}
    for column, (part, title) in enumerate(columns.items()):
        levels, changes = content[f"{part}_level_db"], content[f"{part}_change_db"]
        rpm = content["speeds_rpm"]
        color_of = {
            name: COLORS[index % len(COLORS)] for index, name in enumerate(levels)
        }
        for name, level in levels.items():
            curve(axes[0, column], rpm, level, color_of[name], name)
        for name, change in changes.items():
            curve(axes[1, column], rpm, change, color_of[name])
        zero_line(axes[1, column])
        titles(axes[0, column], title, SPEED, LEVEL)
        titles(axes[1, column], f"{title}: change", SPEED, "dB against as configured")
        for panel in axes[:, column]:
            panel.set_xlim(rpm[0], rpm[-1])
            panel.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=SMALL)
    save(figure, path)
