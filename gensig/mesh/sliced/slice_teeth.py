"""Faulty teeth in slices: added compliance per slice, flanks that stand back or are missing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array, Flags, Integers
from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import RootCrack, Tooth, healthy_tooth
from gensig.material import Material
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.face import is_nominal, slice_gaps
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import (
    FlankSide,
    distinct_teeth,
    flank_sides,
    node_positions,
    structural_compliance,
)
from gensig.mesh.root_crack import crack_compliance

NO_FLANK = 1.0  # m; gap of a missing flank, finite for interpolation
NARROWEST = 1e-6  # of the face; edges closer than this are merged
NEWTON_STEPS = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GearSlices:
    """One gear's teeth in slices, by kind; kind 0 is healthy, with zeros only.

    Parameters
    ----------
    softening : (kind, slice, node) m2/N    structural compliance beyond a healthy tooth, per width
    gap : (kind, slice, node) m             of its flank; ``NO_FLANK`` where it is missing
    present : (kind,)
    kind : (tooth,)
    """

    softening: Array
    gap: Array
    present: Flags
    kind: Integers


def is_uneven(tooth: Tooth) -> bool:
    """True if lost material or crack depth varies across the face."""
    loss = tooth.material_loss
    return bool((loss != loss[:1]).any()) or any(
        (crack.depth != crack.depth[0]).any() for crack in tooth.cracks
    )


def check_independent(teeth: Iterable[Tooth], slices: SliceOptions) -> None:
    """Raise a ConfigError for independent slices with a fault over part of the face.

    ``independent_faulty_slices`` allows them.
    """
    if (
        slices.slice_coupling == "independent"
        and not slices.independent_faulty_slices
        and any(map(is_uneven, teeth))
    ):
        raise ConfigError(
            "mesh.slice_coupling = 'independent' with a fault over part of the face: the tooth "
            "beside the fault would not help to carry; take mesh.slice_coupling=coupled, or set "
            "mesh.independent_faulty_slices=true"
        )


def merged_edges(pair: GearPair, n_slices: int, teeth: Collection[Tooth]) -> Array:
    """Edges of equal slices over the common face, and of the teeth's own slices, (edge,) m.

    The middles of both faces coincide.
    """
    even = np.linspace(0.0, pair.face_width, n_slices + 1)
    of_teeth = [tooth.slice_edges - _overhang(pair, tooth.gear) for tooth in teeth]
    further = np.unique(np.concatenate([*of_teeth, np.empty(0)]))
    least = NARROWEST * pair.face_width
    nearest = even[np.searchsorted(0.5 * (even[1:] + even[:-1]), further)]
    inside = (further > 0.0) & (further < pair.face_width)
    further = further[inside & (np.abs(further - nearest) > least)]
    further = further[np.diff(further, prepend=-np.inf) > least]
    return np.sort(np.concatenate([even, further]))


def slices_of_gears(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    teeth: Mapping[tuple[str, int], Tooth],
    edges: Array,
    structure: Array,
) -> dict[str, GearSlices]:
    """Both gears' teeth in the slices between ``edges``.

    Parameters
    ----------
    teeth : the faulty teeth, by (gear, tooth)
    structure : (node,) m2/N    of healthy pairs per width, less the shared compliance
    """
    position = node_positions(pair, options)
    flanks = flank_sides(pair, position, material, options, 1.0)
    sides = {}
    for side, gear in pair.gears.items():
        distinct, kind = distinct_teeth(healthy_tooth(gear), teeth)
        shape = (len(distinct), len(edges) - 1, len(structure))
        softening, gap = np.zeros(shape), np.zeros(shape)
        for row, tooth in enumerate(distinct):
            if row and tooth.present:
                softening[row] = _softening(
                    tooth, flanks[side], pair, material, options, edges, structure
                )
                gap[row] = _gap(tooth, flanks[side], pair, edges)
        present = np.array([tooth.present for tooth in distinct])
        sides[side] = GearSlices(
            softening=softening, gap=gap, present=present, kind=kind
        )
    return sides


def _overhang(pair: GearPair, gear: Gear) -> float:
    """Length of a gear's face beyond the common face, at the end that enters first, m."""
    return 0.5 * (gear.face_width - pair.face_width)


def _source(tooth: Tooth, pair: GearPair, edges: Array) -> Integers:
    """Index of the tooth's slice that contains each slice of the pair, (slice,)."""
    middle = 0.5 * (edges[1:] + edges[:-1]) + _overhang(pair, tooth.gear)
    index = np.searchsorted(tooth.slice_edges, middle) - 1
    return np.clip(index, 0, len(tooth.slice_width) - 1)


def _gap(tooth: Tooth, flank: FlankSide, pair: GearPair, edges: Array) -> Array:
    """Gap of the flank, (slice, node) m."""
    if is_nominal(tooth):
        return np.zeros((len(edges) - 1, len(flank.curvature)))
    gaps = slice_gaps(tooth, flank.contacts)
    return np.where(np.isfinite(gaps), gaps, NO_FLANK)[_source(tooth, pair, edges)]


def _softening(
    tooth: Tooth,
    flank: FlankSide,
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    edges: Array,
    structure: Array,
) -> Array:
    """Compliance above the healthy tooth's per width, (slice, node) m2/N."""
    in_plane, gear = material.in_plane(options.elasticity), tooth.gear
    nodes = np.stack([flank.curvature, structure])
    (curvature, rest), inverse = np.unique(nodes, axis=1, return_inverse=True)
    softer = opened = np.zeros((1, len(curvature)))
    if tooth.material_loss.any():
        of_loss = _loss_compliance(tooth, curvature, in_plane, options)
        softer = of_loss[_source(tooth, pair, edges)]
    if tooth.cracks:
        reached = np.minimum(curvature, tooth.tip_curvature_radius)
        cracks = [
            _strips(tooth, crack, reached, in_plane, options, pair, edges)
            for crack in tooth.cracks
        ]
        local = np.sum(cracks, axis=0)
        whole = _opened(tooth, reached, in_plane, options)
        opened = _scaled(local, whole, rest / gear.face_width, np.diff(edges))
    softening = np.empty((len(edges) - 1, len(curvature)))
    softening[:] = gear.face_width * (softer + opened)
    return softening[:, inverse.ravel()]


def _loss_compliance(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """Compliance that lost material adds in every slice of the tooth, (slice, phase) m/N.

    A slice without its tip is loaded at its new corner, where the lost part carried nothing.
    """
    gone = ~np.isfinite(tooth.material_loss)
    profile = tooth.profile.curvature_radius
    corner = profile[np.maximum(gone.argmax(axis=1) - 1, 0)]
    tip = np.where(gone.any(axis=1), corner, profile[-1])
    loss = np.where(gone, 0.0, tooth.material_loss)
    left = replace(tooth, cracks=(), material_loss=loss)
    known = np.unique(np.concatenate([curvature, tip]))
    compliance = structural_compliance(left, known, material, options)
    loaded = np.interp(np.minimum(curvature, tip[:, None]), known, compliance)
    sound = healthy_tooth(tooth.gear)
    return loaded - structural_compliance(sound, curvature, material, options)


def _opened(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """Compliance that the cracks of a tooth add, (phase,) m/N."""
    if options.crack != "paper":
        return crack_compliance(
            tooth, curvature, material, allow_extrapolation=options.allow_extrapolation
        )
    cut, whole = (
        tooth_compliance(
            tooth, curvature, material, reach=options.tooth, papers_crack=papers_crack
        ).total
        for papers_crack in (True, False)
    )
    return cut - whole


def _strips(
    tooth: Tooth,
    crack: RootCrack,
    curvature: Array,
    material: Material,
    options: MeshOptions,
    pair: GearPair,
    edges: Array,
) -> Array:
    """Compliance of a crack that is everywhere as deep as in a slice, (slice, phase) m/N."""
    depths, strip = np.unique(crack.depth, return_inverse=True)
    compliance = np.zeros((len(depths), len(curvature)))
    for row, depth in enumerate(depths):
        if depth > 0.0:
            alone = replace(crack, depth=depths[row : row + 1])
            cracked = replace(tooth, cracks=(alone,))
            compliance[row] = _opened(cracked, curvature, material, options)
    strips = np.linspace(0.0, tooth.gear.face_width, len(crack.depth) + 1)
    slices = edges + _overhang(pair, tooth.gear)
    begin = np.maximum(slices[:-1, None], strips[:-1])
    end = np.minimum(slices[1:, None], strips[1:])
    share = np.maximum(end - begin, 0.0) / np.diff(slices)[:, None]
    return share @ compliance[strip]


def _scaled(local: Array, whole: Array, rest: Array, width: Array) -> Array:
    """Compliance of the crack in every slice, scaled to that of the whole crack.

    A crack over part of the width is stiffened by the healthy tooth next to it. One factor scales
    all slices. With it, slices in parallel, each of compliance ``rest`` plus its part of the
    crack, have the compliance ``rest`` plus the calibrated compliance of the whole crack.

    Parameters
    ----------
    local : (slice, phase) m/N    of a crack through the whole width
    whole, rest : (phase,) m/N
    width : (slice,) m

    Returns
    -------
    (slice, phase) m/N
    """
    if (local == local[:1]).all():
        return np.broadcast_to(whole, local.shape)
    share = (width / width.sum())[:, None]
    factor = np.zeros_like(whole)
    aim = 1.0 / (rest + whole)
    for _ in range(NEWTON_STEPS):  # convex and falling: from 0 on, no step goes too far
        stiffness = share / (rest + factor * local)
        slope = (stiffness * local / (rest + factor * local)).sum(axis=0)
        excess, step = stiffness.sum(axis=0) - aim, np.zeros_like(aim)
        np.divide(excess, slope, out=step, where=slope > 0.0)
        factor = factor + np.maximum(step, 0.0)
    return factor * local
