"""Archard wear of sliding flanks: sliding, contact pressure, and depth worn off by one mesh.

Depths are normal to the flank. Positions s are along the path of contact as in
``geometry.contact``. Theory, sources and limits: ``docs/theory/wear.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import SIDES, GearPair
from gensig.life.options import WearOptions
from gensig.material import Material

# conforming flanks, where the sum of worn and new curvature falls towards 0, press at least like
# cylinders of this share of the new curvature: Hertz's theory ends there
LEAST_CURVATURE_SHARE = 0.1


# no slots: a life asks for the same curves some thousand times
@dataclass(frozen=True, kw_only=True, eq=False)
class FlankPath:
    """Nodes along the path of contact where wear is followed, ``position`` (node,) m from A to E.

    The pitch point is one of them where it lies on the path. A node of either flank meets the
    same node of its mate in every mesh, so that one row of nodes serves both.
    """

    pair: GearPair
    position: Array

    @cached_property
    def curvature(self) -> Array:
        """Curvature radii of new flanks in the transverse section, (2, node) m: pinion, wheel."""
        pinion = self.pair.pinion_curvature(self.position)
        return np.array([pinion, self.pair.wheel_curvature(self.position)])

    @cached_property
    def arc(self) -> Array:
        """Length along the profile of either flank, (2, node) m; the wheel's falls from A to E."""
        return self.curvature**2 / (2.0 * _base_radii(self.pair))

    @cached_property
    def pressure_angle(self) -> Array:
        """Transverse pressure angle at the contact point on either gear, (2, node) rad."""
        return np.arctan(self.curvature / _base_radii(self.pair))

    @cached_property
    def relative_curvature(self) -> Array:
        """Sum of both flanks' curvatures in the section normal to the contact line, (node,) 1/m."""
        transverse = np.sum(1.0 / self.curvature, axis=0)
        return math.cos(self.pair.base_helix_angle) * transverse

    @cached_property
    def rolling(self) -> Array:
        """Speed of either flank across the contact line for a pinion of 1 rad/s, (2, node) m."""
        return self.curvature / np.array([[1.0], [self.pair.ratio]])

    @cached_property
    def sliding(self) -> Array:
        """Rolling of the wheel less that of the pinion, (node,) m for a pinion of 1 rad/s.

        It is positive at the pinion's root.
        """
        pinion, wheel = self.rolling
        return wheel - pinion

    @cached_property
    def slide_roll(self) -> Array:
        """Specific sliding without its sign: sliding over the speed of either flank, (2, node)."""
        return np.abs(self.sliding) / self.rolling


def flank_path(pair: GearPair, n_nodes: int = 101) -> FlankPath:
    """Nodes from A to E, equally spaced on either side of the pitch point."""
    path, pitch = pair.path_of_contact, pair.pitch_point
    if not 0.0 < pitch < path:
        return FlankPath(pair=pair, position=np.linspace(0.0, path, n_nodes))
    before = min(max(round(n_nodes * pitch / path), 2), n_nodes - 2)
    root = np.linspace(0.0, pitch, before)[:-1]
    tip = np.linspace(pitch, path, n_nodes + 1 - before)
    return FlankPath(pair=pair, position=np.concatenate([root, tip]))


def hertz_pressure(
    path: FlankPath, line_load: Array, material: Material, depth: Array | None = None
) -> Array:
    """Largest Hertzian pressure, (slice, node) Pa.

    Parameters
    ----------
    line_load : (slice, node) N/m    along the transverse line of action per face width
    depth : (2, slice, node) m       worn off both flanks; None or 0 is new ones

    p = sqrt(w E' kappa / (2 pi)) with E' = E / (1 - nu^2), the load w per length of the contact
    line and the relative curvature kappa normal to it, to which wear adds its second derivative
    along both flanks (``worn_curvature``).
    """
    new, scaled = path.relative_curvature, _reduced_modulus(material) / (2.0 * math.pi)
    if depth is None or not depth.any():
        return np.sqrt(line_load * scaled * new)
    half_width = band_half_width(path, line_load, material)
    worn = [
        worn_curvature(path, depth[:, j], half_width[j]).sum(axis=0)
        for j in range(len(line_load))
    ]
    curvature = np.maximum(new + np.stack(worn), LEAST_CURVATURE_SHARE * new)
    return np.sqrt(line_load * scaled * curvature)


def band_half_width(path: FlankPath, line_load: Array, material: Material) -> Array:
    """Half width a of the contact band on new flanks, (..., node) m: a = 2 w / (pi p)."""
    scaled = _reduced_modulus(material) / (2.0 * math.pi)
    return 2.0 / math.pi * np.sqrt(line_load / (scaled * path.relative_curvature))


def flank_radii(
    path: FlankPath, depth: Array, line_load: Array, material: Material
) -> dict[str, Array]:
    """Curvature radii of both flanks normal to the contact line, (2, node) m each.

    Parameters
    ----------
    depth : (2, node) m     worn off
    line_load : (node,) N/m

    Returns
    -------
    ``new``; ``worn``, that of the worn profile itself, negative where it is hollow and infinite
    where flat; and ``by_eq_22``, the wear-life paper's rho - h / 2 with the depth h of both
    flanks, which is a shift and no curvature
    """
    new = path.curvature / math.cos(path.pair.base_helix_angle)
    added = worn_curvature(path, depth, band_half_width(path, line_load, material))
    with np.errstate(divide="ignore"):
        worn = 1.0 / (1.0 / new + added)
    return {"new": new, "worn": worn, "by_eq_22": new - 0.5 * depth.sum(axis=0)}


def worn_curvature(path: FlankPath, depth: Array, half_width: Array) -> Array:
    """Curvature that wear adds to either flank, (2, node) 1/m.

    It is positive where the flank has become rounder.

    Parameters
    ----------
    depth : (2, node) m
    half_width : (node,) m    of the contact band

    The second derivative of the depth along the flank as the band feels it: the mean of its
    second differences over the half width and over half of that, on either side, but never over
    less than a node's distance. One difference alone would be blind to waves as long as itself,
    which then grow. Beyond A and E the profile is taken to go on straight.
    """
    added = np.empty_like(depth)
    for side, (arc, worn) in enumerate(zip(path.arc, depth, strict=True)):
        order = slice(None)
        if arc[0] >= arc[-1]:
            order = slice(None, None, -1)
        length, back = arc[order], worn[order]
        whole = np.maximum(half_width[order], 2.0 * np.gradient(length))
        ends = [2.0 * length[0] - length[-1], 2.0 * length[-1] - length[0]]
        slopes = np.diff(back)[[0, -1]] / np.diff(length)[[0, -1]]
        beyond = slopes * (length[-1] - length[0])
        wide = np.concatenate([ends[:1], length, ends[1:]])
        long = np.concatenate([[back[0] - beyond[0]], back, [back[-1] + beyond[1]]])
        parts = []
        for reach in (whole, 0.5 * whole):
            before = np.interp(length - reach, wide, long)
            after = np.interp(length + reach, wide, long)
            parts.append((before - 2.0 * back + after) / reach**2)
        added[side][order] = 0.5 * (parts[0] + parts[1])
    return added


def depth_per_mesh(
    path: FlankPath, line_load: Array, pressure: Array, options: WearOptions
) -> Array:
    """Depth that one mesh of its tooth takes off either flank, (2, slice, node) m.

    Parameters
    ----------
    line_load : (slice, node) N/m
    pressure : (slice, node) Pa    largest; ``fixed_intervals`` takes it, ``band`` knows it from
        the load

    ``band``: the integral of Archard's dh = (k / H) p ds over the passage of the contact, whose
    band 2a takes 2a / v_i to pass a point of flank i, while the flanks slide |v_1 - v_2| 2a / v_i
    on each other; the mean pressure times 2a is the load w, so that h_i = (k / H)_i w |v_1 - v_2|
    / v_i, whatever the band's width. Source: Flodin & Andersson, "Simulation of mild wear in spur
    gears", Wear 207 (1997).

    ``fixed_intervals``: (k / H)_i p |v_1 - v_2| dt / 2 with the largest pressure and dt the 1 /
    n_intervals part of the time on the path of contact; half of it off either flank. Source:
    wear-life paper, eqs. (18) to (21). It falls to nothing as n_intervals grows.
    """
    factor = np.array([options.wear_factor(side) for side in SIDES])
    if options.rule == "band":
        slip = path.slide_roll
        return np.stack([factor[side] * slip[side] * line_load for side in (0, 1)])
    pair = path.pair
    # rad of the pinion
    interval = pair.path_of_contact / (pair.pinion.base_radius * options.n_intervals)
    both = pressure * np.abs(path.sliding) * interval
    return np.stack([0.5 * factor[side] * both for side in (0, 1)])


def meshes_per_turn(pair: GearPair) -> Array:
    """Meshes of one tooth of the pinion and of the wheel in a turn of the pinion, (2,)."""
    return np.array([1.0, 1.0 / pair.ratio])


def hunting_turns(pair: GearPair) -> int:
    """Turns of the pinion until the same two teeth meet again."""
    return pair.wheel.n_teeth // math.gcd(pair.pinion.n_teeth, pair.wheel.n_teeth)


def _reduced_modulus(material: Material) -> float:
    return material.youngs_modulus / (1.0 - material.poisson_ratio**2)


def _base_radii(pair: GearPair) -> Array:
    return np.array([[pair.pinion.base_radius], [pair.wheel.base_radius]])
