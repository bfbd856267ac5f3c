"""Drawing of a paper's figure: ours in colour, printed numbers in black, the reason below."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

from gensig.commands.figures.style import COLORS, curve, panels, save, titles
from gensig.papers.paper_figure import Panel, PaperFigure

PANEL_WIDTH, HEIGHT = 6.0, 5.2  # inches
LETTERS_PER_INCH = 14
FEW_POINTS = 8  # that are marked one by one


def draw_paper_figure(figure: PaperFigure, path: Path) -> None:
    """Draw every panel side by side, and write the reason below them."""
    width = PANEL_WIDTH * max(len(figure.panels), 1.4)
    page, axes = panels(1, len(figure.panels), width, HEIGHT)
    for axis, panel in zip(axes[0], figure.panels, strict=True):
        _panel(axis, panel)
    page.suptitle(figure.title)
    reason = textwrap.fill(figure.reason, int(LETTERS_PER_INCH * width))
    page.supxlabel(reason, fontsize="small", x=0.02, ha="left")
    save(page, path)


def _panel(axes: Any, panel: Panel) -> None:
    colors = iter(COLORS * len(panel.curves))
    for each in panel.curves:
        color, style = "black", "--"
        if not each.is_printed:
            color, style = next(colors), "-"
        if len(each.x) <= FEW_POINTS:
            style += "o"
        curve(axes, each.x, each.y, color, each.label, style=style, width=1.2)
    titles(axes, panel.title, panel.x_label, panel.y_label)
    below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14), "ncols": 2}
    axes.legend(fontsize="small", frameon=False, **below)
