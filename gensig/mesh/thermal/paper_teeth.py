"""Compliance of hot teeth by the equations of the paper on helical stiffness with temperature.

The equations hold for a slice; per width they are those of any slice (eqs. 16, 19, 24 to 29).
"""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array, Integers
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth_profile import tooth_profile
from gensig.material import Material
from gensig.mesh.compliance import SHEAR_FACTORS
from gensig.mesh.fillet_foundation import lever_compliance
from gensig.mesh.options import MeshOptions
from gensig.mesh.thermal.paper_growth import (
    HotGear,
    PaperGrowth,
    shift_angle,
)

PHASES_AT_ONCE = 256
TERMS = ("bending", "shear", "axial", "foundation")


def paper_terms(
    pair: GearPair,
    side: str,
    position: Array,
    material: Material,
    options: MeshOptions,
    growth: PaperGrowth,
) -> dict[str, Array]:
    """Terms of one gear's compliance over its whole face along the line of action, (phase,) m/N.

    Parameters
    ----------
    position : (phase,) m    on the path of contact, from A

    Source: thermal paper eqs. (15) to (17) and (24) to (29), on the outline that the cutter makes,
    moved by eqs. (10) to (12). Put right, unless the reading has the misprints: sin(alpha') for
    sin(alpha_m) in A of eq. (18), z(alpha_k) for z(0) in eq. (28), E dy and the lever arm's z
    tan(alpha') in eq. (29), and the profile shift in alpha_2. L* to Q* are of the cold sizes.
    """
    gear = HotGear(gear=pair.gears[side], growth=growth.of(side), reading=growth.rules)
    curvature = np.asarray(pair.curvature(side, position))
    enters = np.array([0.0])
    entry = (
        float(np.asarray(pair.curvature(side, enters))[0]),
        float(growth.strain(side, enters)[0]),
    )
    strain = growth.strain(side, position)
    angle = gear.load_angle(curvature, entry)
    parts = []
    for begin in range(0, len(position), PHASES_AT_ONCE):
        some = slice(begin, begin + PHASES_AT_ONCE)
        at = curvature[some], angle[some], strain[some]
        parts.append(_terms(gear, material, options, *at))
    return {name: np.concatenate([part[name] for part in parts]) for name in TERMS}


def _terms(
    hot: HotGear,
    material: Material,
    options: MeshOptions,
    curvature: Array,
    angle: Array,
    strain: Array,
) -> dict[str, Array]:
    """``paper_terms`` at some curvature radii, load angles and strains, (phase,) each."""
    gear, reading = hot.gear, hot.reading
    profile = tooth_profile(gear)
    less = shift_angle(gear) if reading.has_misprints else 0.0
    radius = np.hypot(profile.abscissa, profile.half_thickness)
    half = np.arctan2(profile.half_thickness, profile.abscissa) - less
    strains = strain[:, None]
    x, z = _cartesian(*hot.outline(strains, radius, half))
    base, roll = gear.base_radius, curvature / gear.base_radius
    contact = np.hypot(base, curvature)
    contact_half = hot.half_angle(roll)
    at_contact = contact[:, None], contact_half[:, None]
    x_load, z_load = _cartesian(*hot.outline(strains, *at_contact))
    # the contact lies between the same points of the outline, hot or cold
    cold_x = radius * np.cos(half)
    cell = np.searchsorted(cold_x, contact * np.cos(contact_half)) - 1
    cell = np.clip(cell, 0, len(cold_x) - 2)
    sine = np.sin(np.arctan(roll) if reading.has_misprints else angle)
    middle_x, middle_z = 0.5 * (x[:, 1:] + x[:, :-1]), 0.5 * (z[:, 1:] + z[:, :-1])
    arm = (x_load - middle_x) * np.cos(angle)[:, None] - z_load * sine[:, None]
    step, young = np.diff(x, axis=1), material.youngs_modulus * gear.face_width
    axial_z = middle_z
    if reading.has_misprints:
        axial_z = _cartesian(*hot.base_point(strains))[1]
    integrands = {
        "bending": arm**2 * 12.0 / (young * (2.0 * middle_z) ** 3),
        "shear": SHEAR_FACTORS["to_contact"]
        / (material.shear_modulus * gear.face_width * 2.0 * middle_z),
        "axial": 1.0 / (young * 2.0 * axial_z) + np.zeros_like(middle_z),
    }
    factors = {
        "bending": np.ones_like(angle),
        "shear": np.cos(angle) ** 2,
        "axial": np.sin(angle) ** 2,
    }
    terms = {
        name: factors[name] * _up_to(values * step, cell, x, x_load[:, 0])
        for name, values in integrands.items()
    }
    load = angle, x_load[:, 0], z_load[:, 0], strain
    return {
        **terms,
        "foundation": _foundation(hot, material, options, *load),
    }


def _foundation(
    hot: HotGear,
    material: Material,
    options: MeshOptions,
    angle: Array,
    x_load: Array,
    z_load: Array,
    strain: Array,
) -> Array:
    """Compliance of the body under one loaded tooth, (phase,) m/N: eq. (29)."""
    gear, strains = hot.gear, strain[:, None]
    root = gear.root_radius + hot.growth.root
    if hot.reading.has_misprints:
        height = x_load - root
        grown, half = hot.base_point(strains)
        root_half = np.arcsin(grown[:, 0] * np.sin(half[:, 0]) / root)
    else:
        height = x_load - z_load * np.tan(angle) - root
        cold = np.array([gear.root_radius]), np.array([gear.root_half_angle])
        root_half = hot.outline(strains, *cold)[1][:, 0]
    lever = height / (2.0 * root * root_half)
    extrapolates = options.allow_extrapolation
    return lever_compliance(
        gear, angle, lever, material, allow_extrapolation=extrapolates
    )


def _cartesian(radius: Array, half_angle: Array) -> tuple[Array, Array]:
    """x and z of eq. (15): along the tooth's centreline, and across it."""
    return radius * np.cos(half_angle), radius * np.sin(half_angle)


def _up_to(cells: Array, cell: Integers, abscissa: Array, x_load: Array) -> Array:
    """Sums of cells up to the load, (phase,); ``cells`` (phase, cell), the load in ``cell``."""
    row = np.arange(len(cell))
    running = np.concatenate([np.zeros((len(cells), 1)), np.cumsum(cells, axis=1)], 1)
    low, high = abscissa[row, cell], abscissa[row, cell + 1]
    return running[row, cell] + cells[row, cell] * (x_load - low) / (high - low)
