"""Drawing of a paper's figure: ours in colour, printed numbers in black, the reason below."""

from __future__ import annotations

import textwrap

from gensig.commands.figures.panels import Figure, Mark, Panel, curve
from gensig.papers import paper_figure
from gensig.papers.paper_figure import PaperFigure

PANEL_WIDTH, HEIGHT = 6.0, 5.2  # inches
LETTERS_PER_INCH = 14
FEW_POINTS = 8  # that are marked one by one


def paper_page(figure: PaperFigure) -> Figure:
    """Every panel side by side, and the reason below them."""
    width = PANEL_WIDTH * max(len(figure.panels), 1.4)
    reason = textwrap.fill(figure.reason, int(LETTERS_PER_INCH * width))
    panels = [
        Panel(
            panel.title,
            panel.x_label,
            panel.y_label,
            [_mark(each) for each in panel.curves],
            legend="below",
            columns=2,
        )
        for panel in figure.panels
    ]
    return Figure([panels], (width, HEIGHT), figure.title, reason)


def _mark(each: paper_figure.Curve) -> Mark:
    color, style = None, "-"
    if each.is_printed:
        color, style = "black", "--"
    if len(each.x) <= FEW_POINTS:
        style += "o"
    return curve(each.x, each.y, each.label, color, style, 1.2)
