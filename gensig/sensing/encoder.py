"""Incremental encoders with an index mark, read as an angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.units import check_limits, unit

MOST_LINES = 100_000
MOST_ECCENTRICITY = math.radians(5.0)
# standard deviation of a line's position over the spacing; with WIDEST no line passes another
MOST_LINE_SHARE = 0.1
WIDEST = 4.0  # standard deviations


@dataclass(frozen=True, slots=True, kw_only=True)
class Encoder:
    """A disc with lines on the shaft of the gear that ``shaft`` names.

    ``eccentricity_error`` is the largest amplitude of the once-per-turn error and ``line_error``
    the standard deviation of the position of each line, both in rad. ``quantised`` reads the last
    line that passed; otherwise the angle is read between lines too.
    """

    shaft: str
    lines_per_turn: int
    eccentricity_error: float = unit("deg")
    line_error: float = unit("deg")
    quantised: bool

    def __post_init__(self) -> None:
        check_limits(self, "sensing.encoder.", lines_per_turn=(4, MOST_LINES))
        check_limits(
            self,
            "sensing.encoder.",
            eccentricity_error=(0.0, MOST_ECCENTRICITY * (1.0 + 1e-9)),
            line_error=(0.0, MOST_LINE_SHARE * self.spacing * (1.0 + 1e-9)),
        )

    @property
    def spacing(self) -> float:
        """Angle between lines, rad."""
        return 2.0 * math.pi / self.lines_per_turn


@dataclass(frozen=True, slots=True, kw_only=True)
class Disc:
    """Disc of one gearbox.

    ``index`` rad is the angle of the gear at which the encoder reads 0. ``line_angles`` (line,)
    rad are the angles after it at which the lines pass. Nominally they are 0, 1, 2, ... times
    the spacing; errors may move them beyond either end of a turn.
    """

    index: float
    line_angles: Array

    def read(self, angle: Array, *, quantised: bool) -> Array:
        """Reading, (sample,) rad from the index, at an angle of the gear, (sample,) rad."""
        n_lines = len(self.line_angles)
        line_angles = np.concatenate(
            [self.line_angles + turn * 2.0 * math.pi for turn in (-1.0, 0.0, 1.0)]
        )
        turns = np.floor((angle - self.index) / (2.0 * math.pi))
        within = angle - self.index - 2.0 * math.pi * turns
        number = np.searchsorted(line_angles, within, side="right") - 1.0
        if not quantised:
            number = np.interp(within, line_angles, np.arange(3.0 * n_lines))
        return 2.0 * math.pi * (turns + (number - n_lines) / n_lines)


def draw_disc(rng: np.random.Generator, encoder: Encoder) -> Disc:
    """Disc of an encoder, see `draw_lines`."""
    return draw_lines(
        rng, encoder.lines_per_turn, encoder.eccentricity_error, encoder.line_error
    )


def draw_lines(
    rng: np.random.Generator, n_lines: int, eccentricity_error: float, line_error: float
) -> Disc:
    """Disc with drawn errors.

    Index and eccentricity have any direction; the eccentricity has any size up to the largest.
    A disc whose center is off the shaft's by e is misread by e / R sin(angle + direction) at a
    reading radius R.
    """
    index, direction = rng.uniform(0.0, 2.0 * math.pi, 2)
    amplitude = eccentricity_error * float(rng.random())
    nominal = 2.0 * math.pi / n_lines * np.arange(n_lines)
    scatter = np.clip(rng.standard_normal(n_lines), -WIDEST, WIDEST)
    return Disc(
        index=float(index),
        line_angles=nominal
        + amplitude * np.sin(nominal + direction)
        + line_error * scatter,
    )
