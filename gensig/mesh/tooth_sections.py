"""Area and second moment of the sections of a tooth, from root to tip."""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.errors import FaultError
from gensig.geometry.tooth import RootCrack, Tooth


def sections(tooth: Tooth, *, papers_crack: bool) -> tuple[Array, Array]:
    """Area in m2 and second moment in m4 of every cell of the outline, (cell,) each.

    Material lost from the flank moves the centroid of its section: the parallel-axis result. The
    spur paper's eqs. (14) and (15) are its case of one rectangular pit. ``papers_crack`` also
    reduces the sections that a crack cuts by eqs. (11) and (12), strip by strip, in one piece.
    """
    gear, half = tooth.gear, tooth.cell_half_thickness
    area = 2.0 * half * gear.face_width
    second_moment = (2.0 * half) ** 3 * gear.face_width / 12.0
    if tooth.material_loss.any():
        flank = slice(tooth.profile.n_root_cells, None)
        kept = np.maximum(1e-9 * gear.normal_module, _kept_height(tooth, half[flank]))
        lost_moment = tooth.slice_width @ (kept * (half[flank] - 0.5 * kept))
        area[flank] = tooth.slice_width @ kept
        centroid = lost_moment / area[flank]
        offset = half[flank] - 0.5 * kept - centroid
        second_moment[flank] = tooth.slice_width @ (kept**3 / 12.0 + kept * offset**2)
    if papers_crack:
        for crack in tooth.cracks:
            share = kept_shares(tooth, crack)
            area = area * share.mean(axis=0)
            second_moment = second_moment * (share**3).mean(axis=0)
    return area, second_moment


def _kept_height(tooth: Tooth, half: Array) -> Array:
    """Height of the sections on the involute that is left in each slice, (slice, cell) m."""
    thickness = 2.0 * tooth.profile.half_thickness[tooth.profile.n_root_cells :]
    lost = np.minimum(tooth.material_loss, thickness)
    return 2.0 * half - 0.5 * (lost[:, 1:] + lost[:, :-1])


def kept_shares(tooth: Tooth, crack: RootCrack) -> Array:
    """Share of its height that each section keeps in each strip of a crack, (strip, cell).

    Source: spur paper eqs. (11) and (12): h_q = h_c - q sin(angle), and every section thicker
    than h_q keeps h_x + h_q of its height. Every section below the mouth is thicker than h_c, so
    that the equations cut the tooth even at depth 0. Strips without depth are therefore left
    whole, and the first micrometre costs up to 34e-12 m/N.

    Raises
    ------
    FaultError    where no height is left
    """
    half = tooth.cell_half_thickness
    reach = crack.depth * math.sin(crack.angle)
    kept = half + np.minimum(half, crack.mouth_half_thickness - reach[:, None])
    if np.any(kept <= 0.0):
        limit = (crack.mouth_half_thickness + float(half.min())) / math.sin(crack.angle)
        raise FaultError(
            f"crack_depth {float(crack.depth.max()) * 1e3:.4g} mm leaves no section near the tip "
            f"of the {tooth.gear.name} tooth (spur paper eqs. 11-12 hold below {limit * 1e3:.4g} "
            "mm); reduce fault.crack_depth_mm or take mesh.crack=calibrated"
        )
    return np.where(crack.depth[:, None] > 0.0, kept / (2.0 * half), 1.0)
