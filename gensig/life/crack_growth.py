"""Root cracks that grow by the Paris law, driven by the energy release rate of our own crack
compliance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.faults.crack import N_STRIPS, Crack
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import healthy_tooth
from gensig.life.growth import GrowthLaw, GrowthOptions
from gensig.life.spread import Spread
from gensig.material import Material
from gensig.mesh.root_crack import DEEPEST, crack_compliance
from gensig.units import unit

Array = NDArray[np.float64]

N_DEPTHS = 161
N_PLACES = 9  # over the zone in which one pair carries everything
WIDTH_STEP = 4  # strips of the crack's front between two widths that are looked at
LEAST_DEPTH = 0.005  # of the root chord: below it a crack is a notch of the surface


@dataclass(frozen=True, slots=True, kw_only=True)
class CrackGrowthOptions(GrowthOptions):
    """Paris law da/dN = C dK^m with a threshold, first and last depth of a crack, and how units
    differ.

    ``coefficient`` C is in m a cycle at 1 MPa sqrt(m), ``threshold`` in Pa sqrt(m); the shares
    are of the root chord, ``width_share`` of the face (1: through it).
    """

    coefficient: float
    exponent: float
    threshold: float = unit("mpa_sqrt_m")
    start_share: float
    end_share: float
    width_share: float
    rate_scatter: float
    start_scatter: float

    def __post_init__(self) -> None:
        for key, low, high in (
            ("coefficient", 0.0, 1e-6),
            ("exponent", 0.5, 10.0),
            ("threshold", -1e-9, 1e9),
        ):
            if not low < getattr(self, key) <= high:
                allowed = (
                    "must not be negative"
                    if low < 0.0
                    else f"must lie above 0, to {high:g}"
                )
                raise ConfigError(
                    f"life.crack.{key} = {getattr(self, key):g}: it {allowed}"
                )
        if not 0.0 < self.width_share <= 1.0:
            raise ConfigError(
                f"life.crack.width_share = {self.width_share:g} must lie above 0, to 1"
            )
        if self.end_share > DEEPEST:
            raise ConfigError(
                f"life.crack.end_share = {self.end_share:g}: cracks are known up to {DEEPEST:g} "
                "of the root chord"
            )
        smallest, largest = (
            self.start_share * factor for factor in (1.0 / self.most, self.most)
        )
        if smallest < LEAST_DEPTH or largest >= self.end_share:
            raise ConfigError(
                f"life.crack.start_share = {self.start_share:g} spreads from {smallest:.3g} to "
                f"{largest:.3g} among "
                f"units; it must stay from {LEAST_DEPTH:g} to below end_share = {self.end_share:g}"
            )

    @property
    def spread(self) -> Spread:
        """How units differ."""
        return Spread(rate_scatter=self.rate_scatter, start_scatter=self.start_scatter)

    @property
    def most(self) -> float:
        """Greatest factor between a unit's first depth and the median."""
        return self.spread.largest_start


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrackGrowth(GrowthLaw):
    """The law of one gear's crack; made by ``crack_growth``.

    Parameters
    ----------
    sizes : (node,) m               depth
    width : (node,) m               along the face that goes with it
    torques : (torque,) N m         of the pinion, ascending, at which the next is known; one where
        it does not matter
    intensity : (torque, node) Pa sqrt(m)    stress-intensity range at 1 N m on the pinion
    meshes : float                  of the cracked tooth in a turn of the pinion
    """

    options: CrackGrowthOptions
    crack: Crack
    sizes: Array
    width: Array
    torques: Array
    intensity: Array
    face_width: float
    meshes: float

    def rate(self, size: Array, torque: float) -> Array:
        """Depth a turn of the pinion, (size,) m: nothing below the threshold.

        Source: Paris & Erdogan (1963). A tooth is unloaded between two meshes, so that the range
        is the greatest value.
        """
        found = np.interp(size, self.sizes, self._intensity(torque)) * torque
        grown = self.options.coefficient * (found / 1e6) ** self.options.exponent
        return np.where(found > self.options.threshold, grown * self.meshes, 0.0)

    def fault(self, size: float) -> dict[str, Any]:
        """Depth and width."""
        keys: dict[str, Any] = {"crack_depth_mm": round(size * 1e3, 9)}
        width = float(np.interp(size, self.sizes, self.width))
        if self.options.width_share < 1.0:
            keys["crack_width_mm"] = round(min(width, self.face_width) * 1e3, 9)
        return keys

    def measures(self, size: float, torque: float) -> dict[str, float]:
        """The stress-intensity range at the record's load."""
        value = float(np.interp(size, self.sizes, self._intensity(torque))) * torque
        return {"stress_intensity_range_mpa_sqrt_m": value / 1e6}

    def _intensity(self, torque: float) -> Array:
        """(node,) Pa sqrt(m) at 1 N m.

        Between two torques it goes with the logarithm, beyond them it stays.
        """
        if len(self.torques) == 1:
            return self.intensity[0]
        place = float(
            np.interp(
                np.log(torque), np.log(self.torques), np.arange(len(self.torques))
            )
        )
        row = min(int(place), len(self.torques) - 2)
        return (row + 1 - place) * self.intensity[row] + (place - row) * self.intensity[
            row + 1
        ]


def crack_growth(
    pair: GearPair, material: Material, crack: Crack, options: CrackGrowthOptions
) -> CrackGrowth:
    """The law of a crack like ``crack``, of which depth, width and front are left aside.

    The stress intensity follows Irwin's K^2 = E' G, plane strain, with the energy release rate of
    the loaded tooth, G = F^2 / 2 dC/dA: over the depth dA = w da, over the width dA = a dw, of a
    crack a deep and w wide; F is the greatest that one tooth carries, the whole load where one
    pair is in contact, and G the greatest there. Dynamic loads are left out. A crack over part of
    the face grows in both ways by the same law; the width that goes with a depth is that which
    growth without a threshold leads to from ``width_share`` at the least depth.

    Raises
    ------
    ConfigError    for a crack on the compressed side, and gears of which two pairs always carry
    """
    require_open(crack)
    if pair.transverse_contact_ratio >= 2.0 or pair.pinion.helix_angle != 0.0:
        raise ConfigError(
            "life: crack growth of system=spur_pair asks for spur gears of which one pair "
            "carries everything "
            "somewhere, and the transverse contact ratio is "
            f"{pair.transverse_contact_ratio:.3f}; take "
            f"system=helical_pair, whose pairs share the load"
        )
    gear = pair.gears[crack.gear]
    zone = np.linspace(
        pair.path_of_contact - pair.base_pitch, pair.base_pitch, N_PLACES
    )
    curvature = np.asarray(pair.curvature(crack.gear, zone))
    chord, strain = crack.root_chord(gear), material.in_plane("plane_strain")
    tooth = healthy_tooth(gear)
    sizes = crack_depths(options, chord)

    def compliance(depth: float, width: float | None) -> Array:
        cut = replace(
            crack, crack_depth=depth, crack_width=width, crack_front="straight"
        ).apply(tooth, 0)
        return crack_compliance(cut, curvature, strain, allow_extrapolation=True)

    if options.width_share == 1.0:
        width = np.full(N_DEPTHS, gear.face_width)
        through = np.array([compliance(float(depth), None) for depth in sizes])
        release = 0.5 * _slope(sizes, through) / gear.face_width
        greatest = release.max(axis=1)
    else:
        width, greatest = _part_of_face(sizes, gear.face_width, options, compliance)
    force = 1.0 / pair.pinion.base_radius
    return CrackGrowth(
        options=options,
        crack=crack,
        sizes=sizes,
        width=width,
        torques=np.ones(1),
        intensity=np.sqrt(np.maximum(greatest, 0.0) * strain.youngs_modulus)[None]
        * force,
        face_width=gear.face_width,
        meshes=pair.speed_ratio(crack.gear),
    )


def require_open(crack: Crack) -> None:
    """Refuse a crack that no load opens."""
    if crack.crack_side == "compression":
        raise ConfigError(
            "life: a crack under compression does not open, so it does not grow; crack_side=tension"
        )


def crack_depths(options: CrackGrowthOptions, chord: float) -> Array:
    """Depths at which rates are looked at, from the least first one to the end, (node,) m."""
    return np.geomspace(
        options.start_share / options.most * chord, options.end_share * chord, N_DEPTHS
    )


def _slope(depth: Array, values: Array) -> Array:
    """Derivative over the depth, (depth, place)."""
    from scipy.interpolate import CubicSpline

    return (
        np.asarray(CubicSpline(np.log(depth), values, axis=0)(np.log(depth), 1))
        / depth[:, None]
    )


def _part_of_face(
    sizes: Array, face: float, options: CrackGrowthOptions, compliance: Any
) -> tuple[Array, Array]:
    """Width that goes with each depth, (node,) m, and the greatest energy release rate at 1 N,
    (node,) N/m.
    """
    from scipy.interpolate import RectBivariateSpline

    depths, widths = sizes[::WIDTH_STEP], crack_widths(face, options)
    table = np.array([[compliance(float(a), float(w)) for w in widths] for a in depths])
    splines = [
        RectBivariateSpline(np.log(depths), widths, table[:, :, k])
        for k in range(table.shape[2])
    ]

    def release(depth: float, width: float) -> tuple[float, float]:
        place = (math.log(depth), width)
        over_depth = max(float(one(*place, dx=1)[0, 0]) for one in splines) / depth
        over_width = max(float(one(*place, dy=1)[0, 0]) for one in splines)
        return max(0.5 * over_depth / width, 0.0), max(0.5 * over_width / depth, 0.0)

    width, greatest = np.empty(len(sizes)), np.empty(len(sizes))
    now = options.width_share * face
    for k, depth in enumerate(sizes):
        by_depth, by_width = release(float(depth), now)
        width[k], greatest[k] = now, by_depth
        if k + 1 < len(sizes) and now < face:
            ratio = (
                (by_width / by_depth) ** (0.5 * options.exponent)
                if by_depth > 0.0
                else 0.0
            )
            now = min(now + ratio * float(sizes[k + 1] - depth), face)
    return width, greatest


def crack_widths(face: float, options: CrackGrowthOptions) -> Array:
    """Widths that are looked at of a crack over part of the face, (width,) m.

    Raises
    ------
    ConfigError    for a first width below the least of them
    """
    widths = face * np.arange(WIDTH_STEP, N_STRIPS + 1, WIDTH_STEP) / N_STRIPS
    if options.width_share * face < widths[0]:
        raise ConfigError(
            f"life.crack.width_share = {options.width_share:g} must be {WIDTH_STEP / N_STRIPS:g} "
            "or more of the face"
        )
    return widths
