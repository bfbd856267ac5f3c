"""Root cracks that grow by the Paris law.

The energy release rate of the crack compliance drives them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.faults.crack import N_STRIPS, Crack
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import healthy_tooth
from gensig.life.growth import GrowthLaw, GrowthOptions
from gensig.material import Material
from gensig.mesh.root_crack import DEEPEST, crack_compliance
from gensig.units import check_limits, check_positive, unit

N_DEPTHS = 161
N_POINTS = 9  # over the zone in which one pair carries everything
WIDTH_STEP = 4  # strips of the crack's front between two widths that are looked at
LEAST_DEPTH = 0.005  # of the root chord: below it a crack is a notch of the surface


@dataclass(frozen=True, slots=True, kw_only=True)
class CrackGrowthOptions(GrowthOptions):
    """Paris law da/dN = C dK^m with a threshold, and first and last depth of a crack.

    ``coefficient`` C is in m a cycle at 1 MPa sqrt(m), ``threshold`` in Pa sqrt(m). The depth
    shares are of the root chord; ``width_share`` is of the face (1: through it).
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
        GrowthOptions.__post_init__(self)
        if self.threshold < 0.0:
            raise ConfigError(
                f"life.crack.threshold = {self.threshold:g}: it must not be negative"
            )
        check_positive(self, "life.crack.", "coefficient", "width_share")
        limits = {
            "coefficient": (0.0, 1e-6),
            "exponent": (0.5, 10.0),
            "threshold": (0.0, 1e9),
            "width_share": (0.0, 1.0),
        }
        check_limits(self, "life.crack.", **limits)
        if self.end_share > DEEPEST:
            raise ConfigError(
                f"life.crack.end_share = {self.end_share:g}: cracks are known up to "
                f"{DEEPEST:g} of the root chord"
            )
        most = self.largest_start
        smallest, largest = self.start_share * (1.0 / most), self.start_share * most
        if smallest < LEAST_DEPTH or largest >= self.end_share:
            raise ConfigError(
                f"life.crack.start_share = {self.start_share:g} spreads from {smallest:.3g} to "
                f"{largest:.3g} among machines; it must stay from {LEAST_DEPTH:g} to below "
                f"end_share = {self.end_share:g}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrackGrowth(GrowthLaw):
    """Growth law of one gear's crack; made by ``crack_growth``.

    Parameters
    ----------
    sizes : (node,) m               depth
    width : (node,) m               along the face that goes with it
    torques : (torque,) N m         of the pinion, ascending, at which ``intensity`` is known; one
        where it does not matter
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
        intensity = np.interp(size, self.sizes, self._intensity(torque)) * torque
        grown = self.options.coefficient * (intensity / 1e6) ** self.options.exponent
        is_growing = intensity > self.options.threshold
        return np.where(is_growing, grown * self.meshes, 0.0)

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
        """Stress-intensity range, (node,) Pa sqrt(m) at 1 N m.

        It is linear over the logarithm of the torque between two torques and held beyond them.
        """
        if len(self.torques) == 1:
            return self.intensity[0]
        rows = np.arange(len(self.torques))
        at = float(np.interp(np.log(torque), np.log(self.torques), rows))
        row = min(int(at), len(self.torques) - 2)
        low, high = self.intensity[row : row + 2]
        return (row + 1 - at) * low + (at - row) * high


def crack_growth(
    pair: GearPair, material: Material, crack: Crack, options: CrackGrowthOptions
) -> CrackGrowth:
    """Growth law of a crack like ``crack``, whose depth, width and front are not used.

    The stress intensity follows Irwin's K^2 = E' G, plane strain. The energy release rate is that
    of the loaded tooth, G = F^2 / 2 dC/dA: over the depth dA = w da, over the width dA = a dw, of
    a crack a deep and w wide. F is the greatest load of one tooth, the whole load where one pair
    is in contact, and G the greatest there. Dynamic loads are left out. A crack over part of the
    face grows in both ways by the same law. Its width at a depth is that of growth without a
    threshold from ``width_share`` at the least depth.

    Raises
    ------
    ConfigError    for a crack on the compressed side, and gears of which two pairs always carry
    """
    require_open(crack)
    if pair.transverse_contact_ratio >= 2.0 or pair.pinion.helix_angle != 0.0:
        raise ConfigError(
            "life: crack growth of system=spur_pair asks for spur gears of which one pair "
            "carries everything somewhere, and the transverse contact ratio is "
            f"{pair.transverse_contact_ratio:.3f}; take system=helical_pair, whose pairs "
            "share the load"
        )
    gear = pair.gears[crack.gear]
    begin, end = pair.path_of_contact - pair.base_pitch, pair.base_pitch
    zone = np.linspace(begin, end, N_POINTS)
    curvature = np.asarray(pair.curvature(crack.gear, zone))
    chord, strain = crack.root_chord(gear), material.in_plane("plane_strain")
    tooth = healthy_tooth(gear)
    sizes = crack_depths(options, chord)
    face = gear.face_width

    def compliance(depth: float, width: float | None) -> Array:
        given = replace(
            crack, crack_depth=depth, crack_width=width, crack_front="straight"
        )
        cut = given.apply(tooth, 0)
        return crack_compliance(cut, curvature, strain, allow_extrapolation=True)

    if options.width_share == 1.0:
        width = np.full(N_DEPTHS, face)
        through = np.array([compliance(float(depth), None) for depth in sizes])
        greatest = (0.5 * _slope(sizes, through) / face).max(axis=1)
    else:
        width, greatest = _part_of_face(sizes, face, options, compliance)
    intensity = np.sqrt(np.maximum(greatest, 0.0) * strain.youngs_modulus)
    return CrackGrowth(
        options=options,
        crack=crack,
        sizes=sizes,
        width=width,
        torques=np.ones(1),
        intensity=intensity[None] * (1.0 / pair.pinion.base_radius),
        face_width=face,
        meshes=pair.speed_ratio(crack.gear),
    )


def require_open(crack: Crack) -> None:
    """Refuse a crack that no load opens."""
    if crack.crack_side == "compression":
        raise ConfigError(
            "life: a crack under compression does not open, so it does not grow; crack_side=tension"
        )


def crack_depths(options: CrackGrowthOptions, chord: float) -> Array:
    """Depths at which rates are evaluated, from the least first one to the end, (node,) m."""
    least = options.start_share / options.largest_start
    return np.geomspace(least * chord, options.end_share * chord, N_DEPTHS)


def _slope(depth: Array, values: Array) -> Array:
    """Derivative over the depth, (depth, position)."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(np.log(depth), values, axis=0)
    return np.asarray(spline(np.log(depth), 1)) / depth[:, None]


def _part_of_face(
    sizes: Array, face: float, options: CrackGrowthOptions, compliance: Any
) -> tuple[Array, Array]:
    """Width of each depth, (node,) m, and greatest energy release rate at 1 N, (node,) N/m."""
    from scipy.interpolate import RectBivariateSpline

    depths, widths = sizes[::WIDTH_STEP], crack_widths(face, options)
    table = np.array([[compliance(float(a), float(w)) for w in widths] for a in depths])
    logs = np.log(depths)
    splines = [
        RectBivariateSpline(logs, widths, table[:, :, k]) for k in range(table.shape[2])
    ]

    def release(depth: float, width: float) -> tuple[float, float]:
        at = (math.log(depth), width)
        over_depth = max(float(spline(*at, dx=1)[0, 0]) for spline in splines) / depth
        over_width = max(float(spline(*at, dy=1)[0, 0]) for spline in splines)
        return max(0.5 * over_depth / width, 0.0), max(0.5 * over_width / depth, 0.0)

    width, greatest = np.empty(len(sizes)), np.empty(len(sizes))
    now = options.width_share * face
    steps = np.diff(sizes, append=sizes[-1])
    for k, depth in enumerate(sizes):
        by_depth, by_width = release(float(depth), now)
        width[k], greatest[k] = now, by_depth
        if now < face and by_depth > 0.0:
            ratio = (by_width / by_depth) ** (0.5 * options.exponent)
            now = min(now + ratio * float(steps[k]), face)
    return width, greatest


def crack_widths(face: float, options: CrackGrowthOptions) -> Array:
    """Widths at which a crack over part of the face is evaluated, (width,) m.

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
