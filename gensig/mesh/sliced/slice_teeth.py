"""What single teeth change in the slices of their pair.

Softer structure, flanks that stand back or are gone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
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

Array = NDArray[np.float64]

NO_FLANK = 1.0  # m; the gap of what is gone, finite so that it can be interpolated
NARROWEST = 1e-6  # of the face; edges nearer to each other are one
NEWTON_STEPS = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GearSlices:
    """One gear's teeth in slices, by kind; kind 0 is sound, and all zero.

    Parameters
    ----------
    softening : (kind, slice, node) m2/N    what a tooth's structure is softer than a sound one's, per width
    gap : (kind, slice, node) m             how far its flank stands back; ``NO_FLANK`` where it is gone
    present : (kind,)
    kind : (tooth,)
    """

    softening: Array
    gap: Array
    present: NDArray[np.bool_]
    kind: NDArray[np.int64]


def is_uneven(tooth: Tooth) -> bool:
    """True where material is lost, or a crack is deep, over a part of the width only."""
    loss = tooth.material_loss
    return bool((loss != loss[:1]).any()) or any(
        (crack.depth != crack.depth[0]).any() for crack in tooth.cracks
    )


def check_independent(teeth: Iterable[Tooth], slices: SliceOptions) -> None:
    """Refuse what slices that know nothing of each other get wrong, unless it was asked for.

    Raises
    ------
    ConfigError
    """
    if (
        slices.slice_coupling == "independent"
        and not slices.independent_faulty_slices
        and any(map(is_uneven, teeth))
    ):
        raise ConfigError(
            "mesh.slice_coupling = 'independent' with a fault over part of the face: the tooth beside the fault would "
            "not help to carry; take mesh.slice_coupling=coupled, or set mesh.independent_faulty_slices=true"
        )


def merged_edges(pair: GearPair, n_slices: int, teeth: Collection[Tooth]) -> Array:
    """Edges of slices of equal width over the common face, and where slices of the teeth begin
    and end, (edge,) m.

    Faces lie with their middles on each other.
    """
    even = np.linspace(0.0, pair.face_width, n_slices + 1)
    own = [tooth.slice_edges - _overhang(pair, tooth) for tooth in teeth]
    further = np.unique(np.concatenate(own)) if own else np.empty(0)
    least = NARROWEST * pair.face_width
    nearest = even[np.searchsorted(0.5 * (even[1:] + even[:-1]), further)]
    further = further[
        (further > 0.0)
        & (further < pair.face_width)
        & (np.abs(further - nearest) > least)
    ]
    if len(further):
        further = further[np.append(True, np.diff(further) > least)]
    return np.sort(np.concatenate([even, further]))


def slices_of_gears(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    odd: Mapping[tuple[str, int], Tooth],
    edges: Array,
    structure: Array,
) -> dict[str, GearSlices]:
    """Both gears' teeth in the slices between ``edges``.

    Parameters
    ----------
    odd : the teeth that are not sound, by (gear, tooth)
    structure : (node,) m2/N    of sound pairs per width, less what pairs share
    """
    sides = {}
    flanks = (
        flank_sides(pair, node_positions(pair, options), material, options, 1.0)
        if odd
        else {}
    )
    for gear in (pair.pinion, pair.wheel):
        teeth = {
            number: odd[name, number]
            for name, number in sorted(odd)
            if name == gear.name
        }
        distinct, kind = distinct_teeth(healthy_tooth(gear), teeth)
        shape = (len(distinct), len(edges) - 1, len(structure))
        if len(distinct) == 1:
            softening = gap = np.broadcast_to(0.0, shape)
        else:
            softening, gap = np.zeros(shape), np.zeros(shape)
            for row, tooth in enumerate(distinct[1:], start=1):
                if tooth.present:
                    softening[row] = _softening(
                        tooth,
                        flanks[gear.name],
                        pair,
                        material,
                        options,
                        edges,
                        structure,
                    )
                    gap[row] = _gap(tooth, flanks[gear.name], pair, edges)
        present = np.array([tooth.present for tooth in distinct])
        sides[gear.name] = GearSlices(
            softening=softening, gap=gap, present=present, kind=kind
        )
    return sides


def _overhang(pair: GearPair, tooth: Tooth) -> float:
    """How far a tooth reaches beyond the common face at the end that enters first, m."""
    return 0.5 * (tooth.gear.face_width - pair.face_width)


def _source(tooth: Tooth, pair: GearPair, edges: Array) -> NDArray[np.int64]:
    """Which slice of a tooth every slice of the pair is part of, (slice,)."""
    middle = 0.5 * (edges[1:] + edges[:-1]) + _overhang(pair, tooth)
    return np.clip(
        np.searchsorted(tooth.slice_edges, middle) - 1, 0, len(tooth.slice_width) - 1
    )


def _gap(tooth: Tooth, flank: FlankSide, pair: GearPair, edges: Array) -> Array:
    """(slice, node) m."""
    if is_nominal(tooth):
        return np.zeros((len(edges) - 1, len(flank.curvature)))
    gaps = slice_gaps(tooth, flank.flank_curvature, flank.relative_radius)
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
    """(slice, node) m2/N: lost material weakens all slices alike, a crack those that it cuts."""
    in_plane, gear = material.in_plane(options.elasticity), tooth.gear
    different, place = np.unique(
        np.stack([flank.curvature, structure]), axis=1, return_inverse=True
    )
    curvature, rest = different
    softer = opened = np.zeros((1, len(curvature)))
    if tooth.material_loss.any():
        softer = _without_loss(tooth, curvature, in_plane, options)[
            _source(tooth, pair, edges)
        ]
    if tooth.cracks:
        reached = np.minimum(curvature, tooth.tip_curvature_radius)
        cracks = [
            _strips(tooth, crack, reached, in_plane, options, pair, edges)
            for crack in tooth.cracks
        ]
        local = np.sum(cracks, axis=0)
        whole = _opened(tooth, reached, in_plane, options)
        opened = _shared_out(local, whole, rest / gear.face_width, np.diff(edges))
    softer = np.broadcast_to(
        gear.face_width * (softer + opened), (len(edges) - 1, len(curvature))
    )
    return softer[:, place.ravel()]


def _without_loss(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """What lost material adds to the compliance in every slice of the tooth, (slice, phase) m/N.

    A slice without its tip is loaded at its new corner; what it lost above carried nothing there.
    """
    gone = ~np.isfinite(tooth.material_loss)
    profile = tooth.profile.curvature_radius
    tip = np.where(
        gone.any(axis=1), profile[np.maximum(gone.argmax(axis=1) - 1, 0)], profile[-1]
    )
    left = replace(
        tooth, cracks=(), material_loss=np.where(gone, 0.0, tooth.material_loss)
    )
    known = np.unique(np.concatenate([curvature, tip]))
    compliance = structural_compliance(left, known, material, options)
    loaded = np.interp(np.minimum(curvature, tip[:, None]), known, compliance)
    return loaded - structural_compliance(
        healthy_tooth(tooth.gear), curvature, material, options
    )


def _opened(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """What the cracks of a tooth add to its compliance, (phase,) m/N."""
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
    """What the crack adds if it is everywhere as deep as in a slice, (slice, phase) m/N."""
    depth, strip = np.unique(crack.depth, return_inverse=True)
    alone = [
        replace(tooth, cracks=(replace(crack, depth=np.array([one])),)) for one in depth
    ]
    found = np.array([_opened(one, curvature, material, options) if one.cracks[0].depth[0] else 0.0 * curvature
                      for one in alone])  # fmt: skip
    strips = np.linspace(0.0, tooth.gear.face_width, len(crack.depth) + 1)
    own = edges + _overhang(pair, tooth)
    common = np.minimum(own[1:, None], strips[None, 1:]) - np.maximum(
        own[:-1, None], strips[None, :-1]
    )
    share = np.maximum(common, 0.0) / np.diff(own)[:, None]
    return share @ found[strip]


def _shared_out(local: Array, whole: Array, rest: Array, width: Array) -> Array:
    """The crack's compliance in every slice, so that slices pressed evenly give way together as
    the whole tooth does.

    A crack over part of the width holds on to the tooth beside it: its own strips give way less
    than if it went through. All are scaled by one factor, at which slices side by side, each as
    soft as ``rest`` and its part of the crack, are as soft as ``rest`` and the calibrated
    compliance of the whole crack.

    Parameters
    ----------
    local : (slice, phase) m/N    as if the crack went through
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
        step = np.divide(
            stiffness.sum(axis=0) - aim,
            slope,
            out=np.zeros_like(aim),
            where=slope > 0.0,
        )
        factor = factor + np.maximum(step, 0.0)
    return factor * local
