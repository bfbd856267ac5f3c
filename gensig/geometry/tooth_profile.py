"""Tooth outline on the tooth axis: root transition curve and involute.

Axes: X along the tooth centreline from the gear centre, Y half thickness. The root curve is eq.
(6) of the spur paper, read as in ``docs/theory/spur_mesh.md`` (gamma from pi/2 at the root circle
to alpha at the involute).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.geometry.gear import Gear


def root_curve(gear: Gear, gamma: Array) -> tuple[Array, Array]:
    """Points of the root transition curve.

    Parameters
    ----------
    gamma : (point,) rad    pi/2 on the root circle, the pressure angle at the involute

    Returns
    -------
    X, Y : (point,) m

    Source: spur paper eq. (6), with r_p read as the cutter tip radius and phi = (a1/tan(gamma) +
    b1)/r.
    """
    a1, b1 = gear.rounding_center_depth, gear.rounding_center_offset
    r = gear.pitch_radius
    phi = (a1 / np.tan(gamma) + b1) / r
    reach = a1 / np.sin(gamma) + gear.cutter_tip_radius
    x = r * np.cos(phi) - reach * np.sin(gamma - phi)
    y = r * np.sin(phi) - reach * np.cos(gamma - phi)
    return x, y


def involute_point(gear: Gear, curvature_radius: Array) -> tuple[Array, Array]:
    """Points X, Y of the involute flank at the given curvature radii, (point,) m."""
    radius = np.hypot(gear.base_radius, curvature_radius)
    roll = curvature_radius / gear.base_radius
    half_angle = gear.half_tooth_angle_base - (roll - np.arctan(roll))
    return radius * np.cos(half_angle), radius * np.sin(half_angle)


def load_angle(gear: Gear, curvature_radius: Array) -> Array:
    """Angle alpha_p between the load and the tooth thickness direction, rad: rc / r_b - th_b."""
    return curvature_radius / gear.base_radius - gear.half_tooth_angle_base


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToothProfile:
    """Outline from the root circle to the tip, sampled for quadrature.

    ``abscissa`` and ``half_thickness`` are (profile,) m at cell edges; ``n_root_cells`` cells lie
    on the root curve, the rest on the involute, where ``curvature_radius`` (profile -
    n_root_cells,) gives the contact.
    """

    gear: Gear
    abscissa: Array
    half_thickness: Array
    n_root_cells: int
    curvature_radius: Array

    @property
    def flank_abscissa(self) -> Array:
        """Abscissa of the involute's nodes, (profile - n_root_cells,) m."""
        return self.abscissa[self.n_root_cells :]


N_ROOT_CELLS = 256
N_FLANK_CELLS = 384


def tooth_profile(
    gear: Gear, *, n_root_cells: int = N_ROOT_CELLS, n_flank_cells: int = N_FLANK_CELLS
) -> ToothProfile:
    """Outline with cells uniform in gamma on the root curve, in curvature on the involute."""
    gamma = np.linspace(0.5 * np.pi, gear.transverse_pressure_angle, n_root_cells + 1)
    tip = np.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    curvature = np.linspace(gear.junction_curvature_radius, tip, n_flank_cells + 1)
    x_root, y_root = root_curve(gear, gamma)
    x_flank, y_flank = involute_point(gear, curvature)
    return ToothProfile(
        gear=gear,
        abscissa=np.concatenate([x_root[:-1], x_flank]),
        half_thickness=np.concatenate([y_root[:-1], y_flank]),
        n_root_cells=n_root_cells,
        curvature_radius=curvature,
    )


@functools.lru_cache(maxsize=64)  # called for every cracked record of a plan
def root_curve_middle(gear: Gear, where: str) -> float:
    """Parameter gamma of the middle of the root transition curve, rad.

    Parameters
    ----------
    where : ``"gamma_mid"`` halves the range of gamma, ``"arc_mid"`` the arc length
    """
    if where == "gamma_mid":
        return 0.5 * (0.5 * np.pi + gear.transverse_pressure_angle)
    gamma = np.linspace(0.5 * np.pi, gear.transverse_pressure_angle, 4001)
    x, y = root_curve(gear, gamma)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return float(np.interp(0.5 * arc[-1], arc, gamma))


@functools.lru_cache(maxsize=64)
def root_curve_point(gear: Gear, where: str) -> tuple[float, float]:
    """Middle of the root transition curve, X and Y in m; ``where`` as in ``root_curve_middle``."""
    x, y = root_curve(gear, np.array([root_curve_middle(gear, where)]))
    return float(x[0]), float(y[0])


def root_curve_slope(gear: Gear, where: str) -> float:
    """Angle of the root curve to the tooth centreline at its middle, rad.

    The rack's rounding rolls on the pitch circle. The normal of the generated curve therefore
    passes through the pitch point, at gamma - phi to the tooth's thickness direction.
    """
    gamma = root_curve_middle(gear, where)
    rolled = gear.rounding_center_depth / np.tan(gamma) + gear.rounding_center_offset
    return float(gamma - rolled / gear.pitch_radius)
