"""Patches of material lost from a flank, and their raised edges, for pits, spalls and dents."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import FaultError
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.geometry.tooth_profile import involute_point, root_curve

SHAPES = {"rectangular": 1.0, "elliptic": 0.25 * math.pi}  # share of length x width
N_STRIPS = 24  # across an ellipse
EDGE_CELLS = 2  # of the outline, that a raised edge is wide at least


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A hole with a flat floor in a flank, in m.

    ``length`` is along the tooth height, ``width`` along the face, ``depth`` inward. The middle
    lies at ``abscissa`` on the tooth centreline and ``face_position`` from one end of the face.
    Around the hole the flank stands ``edge_height`` proud; that falls to nothing ``edge_width``
    away.
    """

    shape: str
    length: float
    width: float
    depth: float
    abscissa: float
    face_position: float
    edge_height: float = 0.0
    edge_width: float = 0.0

    @property
    def area(self) -> float:
        """Area of the opening, m2; 0 without depth."""
        if self.depth == 0.0:
            return 0.0
        return SHAPES[self.shape] * self.length * self.width

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends across the face, m."""
        half = 0.5 * self.width
        return self.face_position - half, self.face_position + half

    def height_at(self, face_position: Array) -> Array:
        """Extent along the tooth height at positions across the face, m."""
        across = np.abs(face_position - self.face_position) / (0.5 * self.width)
        if self.shape == "rectangular":
            return np.where(across < 1.0, self.length, 0.0)
        return self.length * np.sqrt(np.maximum(1.0 - across**2, 0.0))


def flank_ends(gear: Gear) -> tuple[float, float]:
    """Abscissae of the lower and upper end of the involute on the tooth centreline, m."""
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    x, _ = involute_point(gear, np.array([gear.junction_curvature_radius, tip]))
    return float(x[0]), float(x[1])


def flank_area(gear: Gear) -> float:
    """Height of the involute on the tooth centreline times the face width, m2."""
    low, high = flank_ends(gear)
    return (high - low) * gear.face_width


def root_chord_abscissa(gear: Gear) -> float:
    """Abscissa of the root chord, from which positions on the tooth are measured, m."""
    return float(root_curve(gear, np.array([0.5 * np.pi]))[0][0])


def pitch_abscissa(gear: Gear) -> float:
    """Abscissa of the flank's point on the pitch circle, m."""
    return gear.pitch_radius * math.cos(gear.half_tooth_angle_at(gear.pitch_radius))


def remove_patch(tooth: Tooth, patch: Patch, name: str) -> Tooth:
    """The tooth with one more hole; the tooth itself for a patch without extent.

    Raises
    ------
    FaultError    for a patch that leaves the flank or the face, or reaches the centreline;
        ``name`` is the prefix of the fault's keys
    """
    if patch.length * patch.width * patch.depth == 0.0:
        return tooth
    _require_on_flank(tooth, patch, name)
    n_strips = 1 if patch.shape == "rectangular" else N_STRIPS
    sliced = tooth.split(np.linspace(*patch.ends, n_strips + 1))
    if patch.edge_height > 0.0:
        require_edge(tooth, patch.edge_width, f"{name}_")
        low, high = patch.ends
        sliced = sliced.split(
            np.array([low - patch.edge_width, high + patch.edge_width])
        )
    holed = sliced.with_loss(patch_loss(sliced, patch))
    return holed.with_deviation(-patch_edge(sliced, patch))


def patch_loss(tooth: Tooth, patch: Patch) -> Array:
    """Depth of a patch on the nodes of the flank, (slice, profile) m."""
    loss = np.zeros((len(tooth.slice_width), len(tooth.profile.flank_abscissa)))
    deepen(loss, tooth, patch)
    return loss


def deepen(loss: Array, tooth: Tooth, patch: Patch) -> None:
    """Write the depth of a patch where it exceeds that of others, ``loss`` (slice, profile) m."""
    height = patch.height_at(tooth.slice_middle)
    rows = np.flatnonzero(height > 0.0)
    along = np.abs(tooth.profile.flank_abscissa - patch.abscissa)
    inside = along <= 0.5 * height[rows, None]
    loss[rows] = np.maximum(loss[rows], np.where(inside, patch.depth, 0.0))


def patch_edge(tooth: Tooth, patch: Patch) -> Array:
    """Height of a patch's raised edge on the nodes of the flank, (slice, profile) m.

    Nothing inside the hole. Distances from an ellipse are of first order.
    """
    along = np.abs(tooth.profile.flank_abscissa - patch.abscissa)
    across = np.abs(tooth.slice_middle - patch.face_position)[:, None]
    if patch.edge_height == 0.0:
        return np.zeros(np.broadcast_shapes(along.shape, across.shape))
    half_length, half_width = 0.5 * patch.length, 0.5 * patch.width
    if patch.shape == "rectangular":
        outside = (
            np.maximum(along - half_length, 0.0),
            np.maximum(across - half_width, 0.0),
        )
        distance = np.hypot(*outside)
    else:
        level = np.hypot(along / half_length, across / half_width)
        slope = np.hypot(along / half_length**2, across / half_width**2)
        steepness = np.maximum(slope / np.maximum(level, 1e-12), 1e-12)
        distance = np.maximum(level - 1.0, 0.0) / steepness
    height = edge_height(distance, patch.edge_height, patch.edge_width)
    return np.where(patch_loss(tooth, patch) > 0.0, 0.0, height)


def edge_height(distance: Array, height: float, width: float) -> Array:
    """Height of a raised edge at distances from its rim, m: falls evenly to 0 at ``width``."""
    return height * np.maximum(1.0 - distance / width, 0.0)


def require_edge(tooth: Tooth, width: float, prefix: str) -> None:
    """Raise a FaultError for a raised edge too narrow for the nodes of the outline.

    ``prefix`` is that of the fault's keys of the edge.
    """
    least = EDGE_CELLS * float(np.diff(tooth.profile.flank_abscissa).max())
    if width < least:
        raise FaultError(
            f"fault.{prefix}edge_width_mm = {width * 1e3:.4g} is too narrow for a raised edge: the "
            f"{tooth.gear.name} tooth is drawn in steps, {EDGE_CELLS} of them are "
            f"{least * 1e3:.3g} mm; increase it, or set fault.{prefix}edge_height_um=0"
        )


def _require_on_flank(tooth: Tooth, patch: Patch, name: str) -> None:
    gear, profile = tooth.gear, tooth.profile
    flank, root = profile.flank_abscissa, float(profile.abscissa[0])
    low, high = patch.abscissa - 0.5 * patch.length, patch.abscissa + 0.5 * patch.length
    if low < flank[0] - 1e-9 or high > flank[-1] + 1e-9:
        raise FaultError(
            f"the {name} from {(low - root) * 1e3:.4g} to {(high - root) * 1e3:.4g} mm above the "
            f"root chord leaves the flank of the {gear.name} tooth, which reaches from "
            f"{(flank[0] - root) * 1e3:.4g} to {(flank[-1] - root) * 1e3:.4g} mm; change "
            f"fault.{name}_position_mm or fault.{name}_length_mm"
        )
    begin, end = patch.ends
    if begin < -1e-9 or end > gear.face_width + 1e-9:
        raise FaultError(
            f"the {name} from {begin * 1e3:.4g} to {end * 1e3:.4g} mm across the face leaves the "
            f"{gear.name} tooth, which is {gear.face_width * 1e3:.4g} mm wide; change "
            f"fault.{name}_width_mm or fault.{name}_face_position_mm"
        )
    require_depth(tooth, low, high, patch.depth, name)


def require_depth(
    tooth: Tooth, low: float, high: float, depth: float, name: str
) -> None:
    """Raise a FaultError for a hole between two abscissae that reaches the centreline."""
    gear, profile = tooth.gear, tooth.profile
    flank = profile.flank_abscissa
    inside = (flank >= low) & (flank <= high)
    half = profile.half_thickness[profile.n_root_cells :][inside]
    if len(half) and depth >= half.min():
        raise FaultError(
            f"{name}_depth {depth * 1e3:.4g} mm reaches the centreline of the {gear.name} "
            f"tooth (half thickness {float(half.min()) * 1e3:.4g} mm there); reduce "
            f"fault.{name}_depth_mm"
        )
