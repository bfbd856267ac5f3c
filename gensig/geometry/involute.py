"""The involute function and its inverse (ISO 21771)."""

from __future__ import annotations

import math

from scipy.optimize import brentq

from gensig.errors import GeometryError


def involute(angle: float) -> float:
    """Involute function inv(a) = tan(a) - a, rad."""
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """Angle whose involute is ``value``; between 0 and 80 degrees."""
    upper = math.radians(80.0)
    if not 0.0 <= value <= involute(upper):
        raise GeometryError(f"no pressure angle has the involute {value:.6g}; check the profile shifts")
    return float(brentq(lambda angle: involute(angle) - value, 0.0, upper, xtol=1e-15, rtol=1e-14))
