"""Tooth stiffness by ISO 6336-1, Method B: a standard value to compare with."""

from __future__ import annotations

import math

from gensig.errors import ConfigError, ExtrapolationError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear

# q' = sum of these times 1, 1/z1, 1/z2, x1, x1/z1, x2, x2/z2, x1^2, x2^2; q' in mm um / N
FLEXIBILITY = (
    0.04723,
    0.15551,
    0.25791,
    -0.00635,
    -0.11654,
    -0.00193,
    -0.24188,
    0.00529,
    0.00182,
)
FLEXIBILITY_UNIT = 1e-9  # mm um / N in m2/N
SHIFT_SUM = (-0.5, 2.0)  # range of x1 + x2 of the series, which also asks for x1 >= x2
LEAST_CONTACT_RATIO = 1.2  # of c_gamma

CORRECTION_FACTOR = 0.8  # C_M, between the series and measured gears
LINEAR_LINE_LOAD = 1e5  # N/m, 100 N/mm: below it the contact softens
STEEL_YOUNGS_MODULUS = 206e9  # E_st, Pa


def single_stiffness(
    pair: GearPair,
    *,
    line_load: float | None = None,
    correction_factor: float = CORRECTION_FACTOR,
    youngs_modulus: float = STEEL_YOUNGS_MODULUS,
    allow_extrapolation: bool = False,
) -> float:
    """Largest stiffness c' of a single tooth pair per face width, along the line of action, N/m/m.

    Parameters
    ----------
    line_load : F_t K_A / b, N/m, at the reference circle; None: 100 N/mm or more, without effect
    correction_factor : C_M; 1 gives the theoretical stiffness
    youngs_modulus : of both gears, Pa; the series was fitted for steel
    allow_extrapolation : use the series beyond its range without an error

    Raises
    ------
    ConfigError           for a load, factor or modulus that is not positive
    ExtrapolationError    for profile shifts outside x1 >= x2, -0.5 <= x1 + x2 <= 2, unless allowed

    Source: ISO 6336-1, Method B, c' = c'_th C_M C_R C_B cos(beta), virtual teeth z /
    (cos^2(beta_b) cos(beta)), solid discs (C_R = 1) and (F_t K_A / b / 100 N/mm)^0.25 below 100
    N/mm. One N/(mm um) of the standard is 1e9 N/m/m. The body down to the bore, which makes
    thin-rimmed gears softer, is not in it.
    """
    for name, value in (
        ("line_load", line_load),
        ("correction_factor", correction_factor),
        ("youngs_modulus", youngs_modulus),
    ):
        if value is not None and not value > 0.0:
            raise ConfigError(f"ISO 6336-1: {name} = {value:g} must be positive")
    low, high = SHIFT_SUM
    x1, x2 = pair.pinion.profile_shift, pair.wheel.profile_shift
    if not (x1 >= x2 and low <= x1 + x2 <= high) and not allow_extrapolation:
        raise ExtrapolationError(
            f"ISO 6336-1: profile shifts {x1:g} (pinion) and {x2:g} (wheel) lie outside x1 >= x2, "
            f"{low:g} <= x1 + x2 <= {high:g}, where its tooth stiffness holds; change them, or "
            "allow extrapolation"
        )
    rack = 0.5 * (basic_rack_factor(pair.pinion) + basic_rack_factor(pair.wheel))
    load = 1.0
    if line_load is not None:
        load = min(1.0, line_load / LINEAR_LINE_LOAD) ** 0.25
    helix = math.cos(pair.pinion.helix_angle)
    factors = correction_factor * rack * helix * load
    return factors * youngs_modulus / STEEL_YOUNGS_MODULUS / flexibility(pair)


def mesh_stiffness(
    pair: GearPair,
    *,
    line_load: float | None = None,
    correction_factor: float = CORRECTION_FACTOR,
    youngs_modulus: float = STEEL_YOUNGS_MODULUS,
    allow_extrapolation: bool = False,
) -> float:
    """Mean mesh stiffness c_gamma = c' (0.75 eps_alpha + 0.25) per face width, N/m/m.

    Parameters are those of ``single_stiffness``.

    Raises
    ------
    ExtrapolationError    also for a transverse contact ratio below 1.2, unless allowed
    """
    ratio = pair.transverse_contact_ratio
    if ratio < LEAST_CONTACT_RATIO and not allow_extrapolation:
        raise ExtrapolationError(
            f"ISO 6336-1: the transverse contact ratio {ratio:.4g} lies below "
            f"{LEAST_CONTACT_RATIO:g}, where its mesh stiffness holds; use more teeth or a larger "
            "addendum_coefficient, or allow extrapolation"
        )
    single = single_stiffness(
        pair,
        line_load=line_load,
        correction_factor=correction_factor,
        youngs_modulus=youngs_modulus,
        allow_extrapolation=allow_extrapolation,
    )
    return single * (0.75 * ratio + 0.25)


def flexibility(pair: GearPair) -> float:
    """Least flexibility q' of a pair of steel teeth per face width, m2/N."""
    virtual = math.cos(pair.base_helix_angle) ** 2 * math.cos(pair.pinion.helix_angle)
    z1, z2 = pair.pinion.n_teeth / virtual, pair.wheel.n_teeth / virtual
    x1, x2 = pair.pinion.profile_shift, pair.wheel.profile_shift
    terms = (1.0, 1.0 / z1, 1.0 / z2, x1, x1 / z1, x2, x2 / z2, x1**2, x2**2)
    return FLEXIBILITY_UNIT * math.fsum(
        c * term for c, term in zip(FLEXIBILITY, terms, strict=True)
    )


def basic_rack_factor(gear: Gear) -> float:
    """C_B = [1 + 0.5 (1.2 - h_fP / m)] [1 - 0.02 (20 deg - alpha_P)] of one gear.

    1 for h_fP = 1.2 m, 20 deg.
    """
    dedendum = gear.addendum_coefficient + gear.clearance_coefficient
    return (1.0 + 0.5 * (1.2 - dedendum)) * (
        1.0 - 0.02 * (20.0 - math.degrees(gear.pressure_angle))
    )
