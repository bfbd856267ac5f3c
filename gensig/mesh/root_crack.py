"""Compliance that a root crack adds to its tooth, body included, calibrated to finite elements."""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.errors import ExtrapolationError
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import RootCrack, Tooth
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.root_crack_coefficients import COEFFICIENTS

# range compared with finite elements: depth over root chord, angle to the centreline
DEEPEST = 0.8
ANGLES = (math.radians(30.0), math.radians(75.0))
POWERS = (0.75, 1.0, 1.5)
TOGETHER = 1.25
MIDDLE_ANGLE, MIDDLE_SLOPE = math.radians(45.0), math.radians(40.0)


def crack_compliance(
    tooth: Tooth,
    curvature_radius: Array,
    material: Material,
    *,
    allow_extrapolation: bool = False,
) -> Array:
    """Compliance that the cracks of a tooth add along the line of action, (phase,) m/N.

    Parameters
    ----------
    curvature_radius : (phase,) m    of the tooth's own flank at the contact
    material : as ``Material.in_plane`` gives it

    Source: Irwin's relation between energy release and compliance. The stress intensity at the
    tip is linear in moment, shear and normal force at the root, so a unit load adds [k_m M / h +
    k_v cos(alpha) - k_n sin(alpha)]^2 / (E' W): M about the middle of the root chord h through
    the mouth, each k a function of depth over h, crack angle and the slope of the root curve at
    the mouth. The coefficients of that function are fitted to two-dimensional finite elements of
    whole gears (``tests/reference``), so the body behind the crack gives way too.
    """
    total = np.zeros_like(curvature_radius)
    for crack in tooth.cracks:
        total = total + _crack_compliance(
            tooth, crack, curvature_radius, material, allow_extrapolation
        )
    return total


def _crack_compliance(
    tooth: Tooth,
    crack: RootCrack,
    curvature_radius: Array,
    material: Material,
    allow_extrapolation: bool,
) -> Array:
    gear = tooth.gear
    if crack.side == "compression" and crack.breathing:
        return np.zeros_like(curvature_radius)
    depth = crack.depth / (2.0 * crack.mouth_half_thickness)
    _require_checked(tooth, crack, float(depth.max()), allow_extrapolation)
    angle = load_angle(gear, curvature_radius)
    factors = basis(depth, crack.angle, crack.mouth_slope) @ np.array(COEFFICIENTS).T
    intensity = np.maximum(factors @ root_loads(gear, crack, angle), 0.0)
    through = intensity**2 / (material.youngs_modulus * gear.face_width)
    if len(depth) == 1:
        return through[0]
    compliance = tooth_compliance(
        tooth, curvature_radius, material, reach="to_centreline", papers_crack=False
    ).total
    return _side_by_side(compliance, through)


def basis(depth: Array, angle: float, slope: float) -> Array:
    """Basis functions of the stress intensity factors, (depth, function); 0 at no depth.

    Powers of depth over root chord times low-order terms of crack angle and mouth slope about the
    middle of the calibrated range.
    """
    tilt, fillet = angle - MIDDLE_ANGLE, slope - MIDDLE_SLOPE
    angles = np.array([1.0, tilt, tilt**2, fillet, tilt * fillet])
    powers = np.power(depth[:, None], np.array(POWERS))
    return (powers[:, :, None] * angles).reshape(len(depth), -1)


def root_loads(gear: Gear, crack: RootCrack, load_angle: Array) -> Array:
    """Moment over chord, shear and normal force at the crack's root chord per unit load, (3,
    phase).

    Positive values open the crack.
    """
    chord = 2.0 * crack.mouth_half_thickness
    moment = (gear.base_radius - crack.mouth_abscissa * np.cos(load_angle)) / chord
    normal = np.sin(load_angle)
    if crack.side == "tension":
        normal = -normal
    return np.stack([moment, np.cos(load_angle), normal])


def _require_checked(
    tooth: Tooth, crack: RootCrack, depth: float, allow_extrapolation: bool
) -> None:
    if allow_extrapolation:
        return
    chord = 2.0 * crack.mouth_half_thickness
    if depth > DEEPEST * (1.0 + 1e-6):
        raise ExtrapolationError(
            f"crack_depth {depth * chord * 1e3:.4g} mm is {depth:.2f} of the root chord "
            f"{chord * 1e3:.4g} mm of the {tooth.gear.name} tooth; the calibrated crack was "
            f"checked up to {DEEPEST:g}, {DEEPEST * chord * 1e3:.4g} mm: reduce "
            "fault.crack_depth_mm, take mesh.crack=paper, or set mesh.allow_extrapolation=true"
        )
    if not ANGLES[0] - 1e-9 <= crack.angle <= ANGLES[1] + 1e-9:
        raise ExtrapolationError(
            f"fault.crack_angle_deg = {math.degrees(crack.angle):g}: the calibrated crack was "
            f"checked from {math.degrees(ANGLES[0]):g} to {math.degrees(ANGLES[1]):g}; take "
            "mesh.crack=paper or set mesh.allow_extrapolation=true"
        )


def _side_by_side(compliance: Array, through: Array) -> Array:
    """Compliance of parallel strips, each in series with its crack, less the healthy tooth's.

    The strips share their deflection at the load as far as the tooth holds them together. Its
    compliance for this is ``TOGETHER`` times that of the tooth. The factor is calibrated to
    three-dimensional finite elements of cracks over a quarter and half of the face
    (``tests/reference``), within 9 % of them.
    """
    together = TOGETHER * compliance
    return 1.0 / np.mean(1.0 / (together + through), axis=0) - together
