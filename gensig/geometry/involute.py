"""The involute function and its inverse (ISO 21771)."""

from __future__ import annotations

import math

from gensig.errors import GeometryError


def involute(angle: float) -> float:
    """Involute function inv(a) = tan(a) - a, rad."""
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """Angle whose involute is ``value``; between 0 and 80 degrees.

    Newton's method from above, where it cannot overshoot: inv is convex, inv' = tan^2, and inv(a)
    > a^3 / 3.
    """
    upper = math.radians(80.0)
    if not 0.0 <= value <= involute(upper):
        raise GeometryError(
            f"no pressure angle has the involute {value:.6g}; check the profile shifts"
        )
    angle, before = min(math.cbrt(3.0 * value), upper), math.inf
    while 0.0 < angle < before:
        angle, before = angle - (involute(angle) - value) / math.tan(angle) ** 2, angle
    return angle
