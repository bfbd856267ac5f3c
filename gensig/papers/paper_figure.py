"""One figure of a paper: curves by panel, ours and printed ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np

from gensig.arrays import Array
from gensig.text.csv_tables import write_rows


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One curve ``y`` over ``x``, (point,) each; ``is_printed`` if the paper prints it."""

    label: str
    x: Array
    y: Array
    is_printed: bool = False


def printed_level(label: str, value: float, x: Array) -> Curve:
    """A printed value as a line from the least to the greatest abscissa."""
    ends = np.array([x.min(), x.max()])
    return Curve(label, ends, np.full(2, value), is_printed=True)


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """Curves on the same axes, with labels that have units."""

    title: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]


@dataclass(frozen=True, slots=True, eq=False)
class PaperFigure:
    """A figure of a paper, and the reason where ours differs from what is printed."""

    title: str
    panels: Sequence[Panel]
    reason: str = ""

    def write_csv(self, file: TextIO) -> None:
        """Write a line for every point: panel, curve, whether it is printed, x, y."""
        head = ["panel", "curve", "is_printed", "x", "x_is", "y", "y_is"]
        write_rows(file, [head])
        for panel in self.panels:
            for curve in panel.curves:
                for x, y in zip(curve.x, curve.y, strict=True):
                    point = f"{x:.10g}", panel.x_label, f"{y:.10g}", panel.y_label
                    printed = int(curve.is_printed)
                    write_rows(file, [[panel.title, curve.label, printed, *point]])


@dataclass(frozen=True, slots=True, kw_only=True)
class Paper:
    """A paper: its title, and its figures by number as functions that compute them."""

    title: str
    figures: Mapping[str, Callable[[], PaperFigure]]
