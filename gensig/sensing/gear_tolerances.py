"""Limits of the flank deviations of a cylindrical gear by ISO 1328-1:2013, in m.

All grow by the square root of 2 from one grade to the next. The standard rounds the values of its
printed tables; here they are as the formulas give them, so that a limit changes smoothly with a
drawn grade. Limits of pitch and cumulative pitch are arcs on the reference circle, those of the
profile lengths along the line of action, runout is radial.
"""

from __future__ import annotations

import math

from gensig.errors import ConfigError
from gensig.geometry.gear import Gear

LOWEST_GRADE, HIGHEST_GRADE = 1, 11
# range of clause 1: teeth, reference diameter and normal module in mm; face width (4 to 1200 mm)
# and helix angle (to 45 degrees) stand in none of the formulas below
TEETH, DIAMETER, MODULE = (5, 1000), (5.0, 15_000.0), (0.5, 70.0)


def single_pitch_limit(gear: Gear, grade: float) -> float:
    """Limit of the single pitch deviation f_p, m of arc.

    Source: ISO 1328-1:2013, f_pT = (0.001 d + 0.4 m + 5) sqrt(2)^(A - 5) with d and m in mm,
    result in micrometres.
    """
    return _limit(gear, grade, 0.001 * _diameter(gear) + 0.4 * _module(gear) + 5.0)


def cumulative_pitch_limit(gear: Gear, grade: float) -> float:
    """Limit of the total cumulative pitch (index) deviation F_p, m of arc.

    Source: ISO 1328-1:2013, F_pT = (0.002 d + 0.55 sqrt(d) + 0.7 m + 12) sqrt(2)^(A - 5), units
    as above.
    """
    diameter = _diameter(gear)
    total = 0.002 * diameter + 0.55 * math.sqrt(diameter) + 0.7 * _module(gear) + 12.0
    return _limit(gear, grade, total)


def profile_slope_limit(gear: Gear, grade: float) -> float:
    """Limit of the size of the profile slope deviation f_Halpha, m.

    Source: ISO 1328-1:2013, f_HalphaT = (0.4 m + 0.001 d + 4) sqrt(2)^(A - 5), units as above.
    """
    return _limit(gear, grade, 0.4 * _module(gear) + 0.001 * _diameter(gear) + 4.0)


def profile_form_limit(gear: Gear, grade: float) -> float:
    """Limit of the profile form deviation f_falpha, m.

    Source: ISO 1328-1:2013, f_falphaT = (0.55 m + 5) sqrt(2)^(A - 5), units as above.
    """
    return _limit(gear, grade, 0.55 * _module(gear) + 5.0)


def runout_limit(gear: Gear, grade: float) -> float:
    """Limit of the runout F_r, m: twice the largest eccentricity where nothing else runs out.

    Source: ISO 1328-1:2013 (informative annex), F_rT = 0.9 F_pT.
    """
    return 0.9 * cumulative_pitch_limit(gear, grade)


def check_covered(gear: Gear) -> None:
    """Raise ConfigError for a gear that the standard does not cover."""
    for what, value, (low, high) in (
        ("teeth", float(gear.n_teeth), TEETH),
        ("mm reference diameter", _diameter(gear), DIAMETER),
        ("mm module", _module(gear), MODULE),
    ):
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            raise ConfigError(
                f"quality.iso1328_grade: ISO 1328-1:2013 covers {low:g} to {high:g} {what}, "
                f"the {gear.name} has {value:g}; set quality.iso1328_grade=null for perfect gears"
            )


def _limit(gear: Gear, grade: float, micrometers: float) -> float:
    check_covered(gear)
    if not LOWEST_GRADE <= grade <= HIGHEST_GRADE:
        raise ConfigError(
            f"ISO 1328-1:2013 has the grades {LOWEST_GRADE} to {HIGHEST_GRADE}, not {grade:g}"
        )
    return 1e-6 * micrometers * math.sqrt(2.0) ** (grade - 5.0)


def _diameter(gear: Gear) -> float:
    return 2e3 * gear.pitch_radius


def _module(gear: Gear) -> float:
    return 1e3 * gear.normal_module
