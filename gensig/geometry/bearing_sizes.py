"""Deep-groove ball bearings of a usual size for a shaft, where nothing else is known."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gensig.errors import ConfigError

# Dimension series 02 of ISO 15 (bearings 62xx): bore, outside diameter and width in mm. To 150 mm
# as in makers' and dealers' tables; above from memory of the standard, not checked against its
# text. The rare bores of 22, 28 and 32 mm are left out
SERIES_02 = (
    (3, 10, 4), (4, 13, 5), (5, 16, 5), (6, 19, 6), (7, 22, 7), (8, 24, 8), (9, 26, 8), (10, 30, 9),
    (12, 32, 10), (15, 35, 11), (17, 40, 12), (20, 47, 14), (25, 52, 15), (30, 62, 16),
    (35, 72, 17), (40, 80, 18), (45, 85, 19), (50, 90, 20), (55, 100, 21), (60, 110, 22),
    (65, 120, 23), (70, 125, 24), (75, 130, 25), (80, 140, 26), (85, 150, 28), (90, 160, 30),
    (95, 170, 32), (100, 180, 34), (105, 190, 36), (110, 200, 38), (120, 215, 40), (130, 230, 40),
    (140, 250, 42), (150, 270, 45), (160, 290, 48), (170, 310, 52), (180, 320, 52), (190, 340, 55),
    (200, 360, 58),
)  # fmt: skip
# Least radial clearance of ISO 5753-1, group N, deep-groove ball bearings: largest bore in mm,
# clearance in micrometres. To 100 mm as in makers' tables; above from memory of the standard, not
# checked against its text
GROUP_N = (
    (10, 2), (18, 3), (30, 5), (50, 6), (65, 8), (80, 10), (100, 12), (120, 15), (160, 18),
    (180, 20), (200, 25),
)  # fmt: skip
# of half the ring's section D - d, times 2; assumed: makers' 6203 to 6210 have 0.29 to 0.32
BALL_SHARE = 0.3
# share of the pitch circle that balls take up; assumed: the same bearings have 0.57 to 0.60
FILLED_SHARE = 0.59


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingSize:
    """One bearing of the series: all sizes in mm, ``clearance_um`` in micrometres."""

    bore: int
    outside: int
    width: int
    n_balls: int
    ball_diameter: float
    pitch_diameter: float
    clearance_um: float

    @property
    def describes(self) -> str:
        """Name of the size, for a remark."""
        return f"ISO 15 series 02: {self.bore} x {self.outside} x {self.width} mm"


def bearing_for(shaft_mm: float) -> BearingSize:
    """The largest bearing of the series whose bore is not above a shaft's diameter.

    Raises
    ------
    ConfigError    for a shaft that is thinner than any
    """
    fitting = [size for size in SERIES_02 if size[0] <= shaft_mm + 1e-9]
    if not fitting:
        raise ConfigError(
            f"a shaft of {shaft_mm:g} mm is thinner than any bearing of ISO 15 series 02, "
            f"{SERIES_02[0][0]} mm; give a larger bore"
        )
    bore, outside, width = fitting[-1]
    ball, pitch = BALL_SHARE * (outside - bore), 0.5 * (outside + bore)
    clearance = next(least for largest, least in GROUP_N if bore <= largest)
    return BearingSize(
        bore=bore,
        outside=outside,
        width=width,
        n_balls=round(FILLED_SHARE * math.pi * pitch / ball),
        ball_diameter=round(ball, 3),
        pitch_diameter=pitch,
        clearance_um=float(clearance),
    )
