"""Loaded tooth contact of a spur or helical pair in slices of the face, each a spur pair.

Theory, limits and choices: ``docs/theory/helical_mesh.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Integers
from gensig.errors import ConfigError, ExtrapolationError, GeometryError
from gensig.geometry.contact import GearPair, corner_gap_by_pinion
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.material import Material
from gensig.mesh.load_distribution import PERFECT, Meeting
from gensig.mesh.local_contact import contact_law
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import (
    FIRST_PITCH,
    LAST_PITCH,
    coupling_compliance,
    node_positions,
    structural_compliance,
)
from gensig.mesh.sliced._slice_kernels import solve_slices
from gensig.mesh.sliced.slice_teeth import (
    NO_FLANK,
    GearSlices,
    check_independent,
    merged_edges,
    slices_of_gears,
)
from gensig.mesh.thermal.paper_growth import PaperGrowth
from gensig.mesh.thermal.paper_teeth import paper_terms


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlicedMesh:
    """A gear pair cut into slices, by position s along the path.

    Parameters
    ----------
    position : (node,) m             from A, as ``node_positions``
    structure : (node,) m2/N         compliance of both teeth and bodies per width, unshared part
    contact_factor : m2/N, contact_constant : (node,), log_weight : see ``ContactLaw``
    gap : (slice, node) m            corner gap plus the deviation common to all teeth
    shared_compliance : m/N
    deviation : (slice, node) m      common deviation in slices of equal width; None: none
    edges : (slice + 1,) m           of the slices, from the end that enters first
    pinion, wheel : further gaps and compliance of single teeth
    """

    pair: GearPair
    options: MeshOptions
    slices: SliceOptions
    position: Array
    structure: Array
    contact_factor: float
    contact_constant: Array
    log_weight: float
    gap: Array
    shared_compliance: float
    deviation: Array | None
    edges: Array
    pinion: GearSlices
    wheel: GearSlices

    @property
    def sides(self) -> dict[str, GearSlices]:
        """The slices of each gear, by its side of the pair."""
        return {"pinion": self.pinion, "wheel": self.wheel}

    @property
    def slice_width(self) -> Array:
        """Width of the slices, (slice,) m."""
        return np.diff(self.edges)

    @property
    def slice_middle(self) -> Array:
        """Middle of each slice from the end that enters first, (slice,) m."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    @property
    def coupling_length_squared(self) -> float:
        """Square of the length over which slices couple, m2."""
        if self.slices.slice_coupling == "independent":
            return 0.0
        length = self.slices.coupling_modules * self.pair.pinion.normal_module
        return length**2

    @property
    def lag(self) -> Array:
        """Lag of each slice's phase, (slice,) m along the path."""
        if self.slices.slices_in_phase:
            return np.zeros_like(self.slice_middle)
        return self.slice_middle * math.tan(self.pair.base_helix_angle)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedContact:
    """Equilibrium under one force, phase by phase.

    Parameters
    ----------
    roll : (phase,) m                     pinion's roll along the line of action
    pair_index : (phase, pair)            0: its first slice enters at roll 0; 1: the next pair
    position : (phase, pair, slice) m     from A; may lie beyond the path, where corners touch
    approach : (phase,) m                 of the gears along the transverse line of action
    stiffness : (phase,) N/m              secant of the contact term, tangent of the structure
    line_load : (phase, pair, slice) N/m  along the transverse line of action per width
    """

    roll: Array
    pair_index: Integers
    position: Array
    approach: Array
    stiffness: Array
    line_load: Array


def sliced_mesh(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    slices: SliceOptions,
    *,
    deviation: Array | None = None,
    teeth: Mapping[tuple[str, int], Tooth] | None = None,
    hot_teeth: PaperGrowth | None = None,
) -> SlicedMesh:
    """Cut a pair into `n_slices` of equal width, and at the ends of faults.

    Parameters
    ----------
    deviation : (slice, node) m    of both flanks of all teeth together from perfect flanks, at
        the table's positions, in the middle of slices of equal width (`slice_middles`)
    teeth : the faulty teeth by (gear, tooth), from ``faulty_teeth``
    hot_teeth : growth of all teeth by ``mesh.heat_law=paper``; what faults add is that of cold
        teeth

    Raises
    ------
    ConfigError    for independent slices with a fault over part of the width, unless allowed
    """
    teeth = teeth or {}
    check_independent(teeth.values(), slices)
    edges = merged_edges(pair, slices.n_slices, teeth.values())
    middles = 0.5 * (edges[1:] + edges[:-1])
    position = node_positions(pair, options)
    structure, shared = _structure(pair, material, options, hot_teeth)
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    law = contact_law(pair, on_path, material, options)
    gap = np.zeros((len(middles), len(position)))
    if options.law != "paper":  # there the edge of the field of action ends contact
        gap += corner_gap_by_pinion(pair, position)
    if deviation is not None:
        even = np.broadcast_to(deviation, (slices.n_slices, len(position)))
        gap += _across(slice_middles(pair, slices), even, middles)
    sides = slices_of_gears(pair, material, options, teeth, edges, structure)
    return SlicedMesh(
        pair=pair,
        options=options,
        slices=slices,
        position=position,
        structure=structure,
        contact_factor=law.factor,
        contact_constant=np.array(np.broadcast_to(law.constant, position.shape)),
        log_weight=law.log_weight,
        gap=gap,
        shared_compliance=shared,
        deviation=deviation,
        edges=edges,
        **sides,
    )


def _across(known: Array, values: Array, middles: Array) -> Array:
    """Values (slice, node) interpolated across the face, linear beyond the outer two positions."""
    if len(middles) == len(known):
        return values
    if len(known) == 1:
        return np.repeat(values, len(middles), axis=0)
    left = np.clip(np.searchsorted(known, middles) - 1, 0, len(known) - 2)
    part = ((middles - known[left]) / (known[left + 1] - known[left]))[:, None]
    return (1.0 - part) * values[left] + part * values[left + 1]


def slice_middles(pair: GearPair, slices: SliceOptions) -> Array:
    """Middle of every slice from the end that enters first, (slice,) m."""
    edges = np.linspace(0.0, pair.face_width, slices.n_slices + 1)
    return 0.5 * (edges[1:] + edges[:-1])


@lru_cache(maxsize=16)
def _structure(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    hot_teeth: PaperGrowth | None,
) -> tuple[Array, float]:
    """Unshared compliance of healthy teeth and bodies per width (node,) m2/N, and shared, m/N."""
    clipped = np.clip(node_positions(pair, options), 0.0, pair.path_of_contact)
    on_path, inverse = np.unique(clipped, return_inverse=True)
    in_plane = material.in_plane(options.elasticity)
    whole = np.zeros_like(on_path)
    for side, gear in pair.gears.items():
        if hot_teeth is not None:
            hot = pair, side, on_path, in_plane, options, hot_teeth
            compliance = np.sum(list(paper_terms(*hot).values()), axis=0)
        else:
            tooth, curvature = healthy_tooth(gear), pair.curvature(side, on_path)
            compliance = structural_compliance(tooth, curvature, in_plane, options)
        whole += compliance * gear.face_width
    shared = coupling_compliance(pair, in_plane, options)
    left = whole - shared * pair.face_width
    if left.min() <= 0.05 * whole.min():
        raise ExtrapolationError(
            f"the gear bodies share {shared:.3g} m/N of the stiffest pair's "
            f"{whole.min() / pair.face_width:.3g} m/N; use a larger bore_radius_mm or "
            "mesh.pair_coupling=sum"
        )
    return left[inverse], shared


def pair_positions(mesh: SlicedMesh, roll: Array) -> tuple[Array, Integers]:
    """Positions s of every pair's slices, (phase, pair, slice) m, and pair numbers, (phase, pair).

    The pair that enters at roll 0 has number 0. Pairs are in order of entry, newest first.
    """
    pitch = mesh.pair.base_pitch
    newest = np.floor(roll / pitch).astype(np.int64) - FIRST_PITCH
    n_pairs = math.ceil(LAST_PITCH - FIRST_PITCH + float(mesh.lag[-1]) / pitch)
    index = newest[:, None] - np.arange(n_pairs)
    return (roll[:, None] - index * pitch)[:, :, None] - mesh.lag, index


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContactPhases:
    """Properties of every slice of every pair at given rolls, for any force.

    Wear changes the gaps only.

    Parameters
    ----------
    roll : (phase,) m
    pair_index : (phase, pair)    see ``LoadedContact``
    position, structure, constant, gap, width : (phase, pair, slice), m, m2/N, 1, m, m: see
        ``SlicedMesh``; ``width`` of a slice is less where the edge of the field of action cuts it
    """

    mesh: SlicedMesh
    roll: Array
    pair_index: Integers
    position: Array
    structure: Array
    constant: Array
    gap: Array
    width: Array


def contact_phases(
    mesh: SlicedMesh, roll: Array, meeting: Meeting = PERFECT
) -> ContactPhases:
    """Prepare the loaded contact at rolls, (phase,) m.

    At 0 the first slice of a pair enters at A.
    """
    position, index = pair_positions(mesh, roll)
    share = np.ones_like(position)
    if mesh.options.law == "paper":  # by the other law corner gaps end contact
        position, share = cut_by_field(mesh, position)
    structure = np.interp(position, mesh.position, mesh.structure)
    gap = _gaps(mesh, position)
    _add_teeth(mesh, position, index, meeting, structure, gap)
    return ContactPhases(
        mesh=mesh,
        roll=roll,
        pair_index=index,
        position=position,
        structure=structure,
        constant=np.interp(position, mesh.position, mesh.contact_constant),
        gap=gap,
        width=mesh.slice_width * share,
    )


def loaded_contact(
    mesh: SlicedMesh, roll: Array, force: float, meeting: Meeting = PERFECT
) -> LoadedContact:
    """Load of every slice of every pair under a total force along the transverse line of action.

    Parameters
    ----------
    roll : (phase,) m    at 0 the first slices of the start teeth enter at A
    force : N

    Raises
    ------
    ConfigError    for a force that is not positive
    GeometryError    where no slice can touch, or the bearing slices never settle
    """
    return settled_contact(contact_phases(mesh, roll, meeting), force)


def settled_contact(phases: ContactPhases, force: float) -> LoadedContact:
    """Loaded contact at prepared rolls, as ``loaded_contact``."""
    if not force > 0.0:
        raise ConfigError(
            f"the mesh force is {force:g} N and must be positive; give a torque that the pinion "
            "drives with"
        )
    mesh, roll = phases.mesh, phases.roll
    approach, stiffness = np.empty_like(roll), np.empty_like(roll)
    line_load = np.empty_like(phases.position)
    n_unsettled = solve_slices(
        phases.structure,
        mesh.contact_factor,
        phases.constant,
        mesh.log_weight,
        phases.gap,
        phases.width,
        mesh.slice_width,
        mesh.coupling_length_squared,
        mesh.shared_compliance,
        force,
        force / mesh.pair.face_width,
        approach,
        stiffness,
        line_load,
    )
    if n_unsettled or not np.isfinite(approach).all():
        raise GeometryError(
            f"no contact at {int(np.sum(~np.isfinite(approach)))} and no settled one at "
            f"{n_unsettled} of {len(roll)} phases under {force:.4g} N; reduce the modification or "
            "raise the torque"
        )
    return LoadedContact(
        roll=roll,
        pair_index=phases.pair_index,
        position=phases.position,
        approach=approach,
        stiffness=stiffness,
        line_load=line_load,
    )


def _gaps(mesh: SlicedMesh, position: Array) -> Array:
    """Gaps without errors, (phase, pair, slice) m; inf beyond the table, out of corners' reach."""
    gap = np.empty_like(position)
    for j in range(position.shape[-1]):
        gap[..., j] = np.interp(
            position[..., j], mesh.position, mesh.gap[j], left=np.inf, right=np.inf
        )
    return gap


def _add_teeth(
    mesh: SlicedMesh,
    position: Array,
    index: Integers,
    meeting: Meeting,
    structure: Array,
    gap: Array,
) -> None:
    """Add the contributions of single teeth to structure and gap, (phase, pair, slice)."""
    sides = mesh.sides.values()
    teeth = zip(sides, meeting.start_teeth, meeting.errors, meeting.tilts, strict=True)
    for side, start, error, tilt in teeth:
        tooth = (index + start) % len(side.kind)
        kinds = side.kind[tooth]
        for kind in np.unique(kinds[kinds > 0]):
            here = kinds == kind
            softening, kind_gap = _of_kind(mesh, side, int(kind), position[here])
            structure[here] += softening
            gap[here] += kind_gap
        if error is not None:
            gap += error[tooth][:, :, None]
        if tilt is not None:
            gap += tilt[tooth][:, :, None] * (position - mesh.pair.pitch_point)
        gap[~side.present[kinds]] = np.inf
    gap[gap > 0.1 * NO_FLANK] = np.inf


def _of_kind(
    mesh: SlicedMesh, side: GearSlices, kind: int, position: Array
) -> tuple[Array, Array]:
    """Softening, m2/N, and gap, m, of one kind of tooth at positions (phase, slice)."""
    softening, gap = np.empty_like(position), np.empty_like(position)
    for j, at in enumerate(position.T):
        softening[:, j] = np.interp(at, mesh.position, side.softening[kind, j])
        gap[:, j] = np.interp(at, mesh.position, side.gap[kind, j])
    return softening, gap


def cut_by_field(mesh: SlicedMesh, position: Array) -> tuple[Array, Array]:
    """Middle and share of the part of each slice on the path, both of the shape of ``position``.

    The edge of the field of action cuts the slices.
    """
    width = mesh.slice_width * (not mesh.slices.slices_in_phase)
    half = 0.5 * width * math.tan(mesh.pair.base_helix_angle)
    path = mesh.pair.path_of_contact
    if not half.any():
        return position, ((position >= 0.0) & (position <= path)).astype(np.float64)
    low, high = np.maximum(position - half, 0.0), np.minimum(position + half, path)
    share = np.clip((high - low) / (2.0 * half), 0.0, 1.0)
    return np.where(share > 0.0, 0.5 * (low + high), position), share


def single_pair_stiffness(
    mesh: SlicedMesh,
    position: Array,
    force: float,
    kinds: tuple[int, int] = (0, 0),
    closed: float = 0.1 * NO_FLANK,
) -> Array:
    """Stiffness of the slices of one tooth pair that lie on the path, (phase,) N/m.

    Parameters
    ----------
    position : (phase,) m    of the first slice, from A
    force : N                its even load per width is that of a load-dependent contact term
    kinds : of the pinion's and the wheel's tooth
    closed : m               slices with a larger gap do not count; all others touch

    Without coupling of slices: the sum over the face of 1 / (structure + contact).
    """
    middle, share = cut_by_field(mesh, position[:, None] - mesh.lag)
    constant = np.interp(middle, mesh.position, mesh.contact_constant)
    logarithm = math.log(force / mesh.pair.face_width)
    contact = mesh.contact_factor * (constant - mesh.log_weight * logarithm)
    softness = np.interp(middle, mesh.position, mesh.structure) + contact
    for side, kind in zip((mesh.pinion, mesh.wheel), kinds, strict=True):
        if kind:
            softening, gap = _of_kind(mesh, side, kind, middle)
            softness = softness + softening
            share = share * (gap < closed) * side.present[kind]
    alone = np.sum(mesh.slice_width * share / softness, axis=1)
    return alone / (1.0 + mesh.shared_compliance * alone)
