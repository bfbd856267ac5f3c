"""The papers by the name that ``gensig figures`` takes."""

from __future__ import annotations

from gensig.papers import (
    engine_paper,
    error_paper,
    heat_paper,
    spur_paper,
    wear_paper,
)
from gensig.papers.paper_figure import Paper

PAPERS: dict[str, Paper] = {
    "spur": spur_paper.PAPER,
    "helical_heat": heat_paper.PAPER,
    "helical_error": error_paper.PAPER,
    "engine": engine_paper.PAPER,
    "wear": wear_paper.PAPER,
}
