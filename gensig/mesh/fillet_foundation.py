"""Compliance of the gear body under one loaded tooth: Sainsot's fit of the clamped ring."""

from __future__ import annotations

import math
import warnings

import numpy as np

from gensig.arrays import Array
from gensig.errors import ExtrapolationError
from gensig.geometry.gear import Gear
from gensig.material import Material

# rows of X = A/th_f^2 + B h_f^2 + C h_f/th_f + D/th_f + E h_f + F, in the order A..F
COEFFICIENTS = {
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}
# ranges confirmed by finite elements (docs/theory/spur_mesh.md), and plausible ranges
CHECKED = {"theta_f": (0.03, 0.14), "h_f": (1.4, 8.2)}
PLAUSIBLE = {"theta_f": (0.01, 0.20), "h_f": (1.4, 8.2)}


class ExtrapolationWarning(UserWarning):
    """A fit used outside its checked range, but within its plausible range."""


def fillet_foundation_compliance(
    gear: Gear, load_angle: Array, material: Material, *, allow_extrapolation: bool
) -> Array:
    """Compliance of the gear body under one loaded tooth, along the line of action.

    Parameters
    ----------
    load_angle : (phase,) rad    between the load and the tooth thickness direction
    allow_extrapolation : use the fit beyond theta_f 0.01..0.20 and h_f 1.4..8.2 without an error

    Returns
    -------
    (phase,) m/N

    Raises
    ------
    ExtrapolationError    outside the range on which the coefficients were checked, unless allowed

    Source: Sainsot, Velex & Duverger (2004), spur paper eq. (7), with theta_f = b1/r, s_f = 2 r_f
    theta_f and u_f = r_b/cos(angle) - r_f. Assumes an isolated tooth and a bore clamped all
    around; plane stress.
    """
    height = gear.base_radius / np.cos(load_angle) - gear.root_radius
    lever = height / (2.0 * gear.root_radius * gear.root_half_angle)
    return lever_compliance(
        gear, load_angle, lever, material, allow_extrapolation=allow_extrapolation
    )


def lever_compliance(
    gear: Gear,
    load_angle: Array,
    lever: Array,
    material: Material,
    *,
    allow_extrapolation: bool,
) -> Array:
    """``fillet_foundation_compliance`` for a lever u_f / s_f of the load, (phase,) m/N."""
    values = body_coefficients(gear, allow_extrapolation=allow_extrapolation)
    bracket = (
        values["L"] * lever**2
        + values["M"] * lever
        + values["P"] * (1.0 + values["Q"] * np.tan(load_angle) ** 2)
    )
    scale = gear.face_width * material.youngs_modulus
    return np.cos(load_angle) ** 2 / scale * bracket


def body_coefficients(gear: Gear, *, allow_extrapolation: bool) -> dict[str, float]:
    """L*, M*, P* and Q* of the gear body."""
    theta, ratio = gear.root_half_angle, gear.root_radius / gear.bore_radius
    half_angle = f"half root angle theta_f = {theta:.3g}"
    _check_range(gear, "theta_f", theta, half_angle, "the teeth", allow_extrapolation)
    radii = f"root radius over bore radius h_f = {ratio:.3g}"
    _check_range(gear, "h_f", ratio, radii, "bore_radius_mm", allow_extrapolation)
    terms = (theta**-2, ratio**2, ratio / theta, 1.0 / theta, ratio, 1.0)
    return {
        name: math.fsum(c * t for c, t in zip(row, terms, strict=True))
        for name, row in COEFFICIENTS.items()
    }


def _check_range(
    gear: Gear, key: str, value: float, shown: str, cause: str, allowed: bool
) -> None:
    low, high = PLAUSIBLE[key]
    if not low <= value <= high and not allowed:
        raise ExtrapolationError(
            f"{gear.name}: {shown} lies outside {low:g}..{high:g}, where the gear-body fit holds; "
            f"change {cause}, or set mesh.allow_extrapolation=true"
        )
    low, high = CHECKED[key]
    if not low <= value <= high:
        warnings.warn(
            f"{gear.name}: {shown} lies outside {low:g}..{high:g}, where the gear-body fit was "
            f"checked against finite elements",
            ExtrapolationWarning,
            stacklevel=5,
        )
