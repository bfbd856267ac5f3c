"""Loaded tooth contact of a spur or helical pair: slices of the face, each a spur pair at its own place of the mesh.

Theory, limits and choices: ``docs/theory/helical_mesh.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, ExtrapolationError, GeometryError
from gensig.geometry.contact import GearPair, corner_gap_by_pinion
from gensig.geometry.tooth import healthy_tooth
from gensig.material import Material
from gensig.mesh._slice_kernels import solve_slices
from gensig.mesh.body_coupling import shared_body_compliance
from gensig.mesh.local_contact import contact_law, relative_radius
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import FIRST_PITCH, LAST_PITCH, node_positions, structural_compliance

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlicedMesh:
    """A gear pair cut into slices: what each is made of, by position s along the path.

    Parameters
    ----------
    position : (node,) m             from A, as ``node_positions``
    structure : (node,) m2/N         compliance of both teeth and bodies per width, less what pairs share
    contact_factor : m2/N, contact_constant : (node,), log_weight : see ``ContactLaw``
    gap : (slice, node) m            corner gap and what the flanks stand back
    shared_compliance : m/N
    slice_place : (slice,) m         middle of each slice from the end that enters first
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
    slice_place: Array

    @property
    def slice_width(self) -> float:
        """Width of a slice, m."""
        return self.pair.face_width / self.slices.n_slices

    @property
    def lag(self) -> Array:
        """How much later each slice meets the same phase, (slice,) m along the path."""
        if self.slices.slices_in_phase:
            return np.zeros_like(self.slice_place)
        return self.slice_place * math.tan(self.pair.base_helix_angle)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedContact:
    """Equilibrium under one force, phase by phase.

    Parameters
    ----------
    roll : (phase,) m                     pinion's roll along the line of action
    position : (phase, pair, slice) m     from A; may lie beyond the path, where corners touch
    approach : (phase,) m                 of the gears along the transverse line of action
    stiffness : (phase,) N/m              secant of the contact term, tangent of everything else
    line_load : (phase, pair, slice) N/m  along the transverse line of action per width
    """

    roll: Array
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
) -> SlicedMesh:
    """Cut a pair with sound teeth into slices.

    Parameters
    ----------
    deviation : (slice, node) m    how far both flanks together stand back of perfect ones at the table's positions
    """
    position = node_positions(pair, options)
    place = slice_places(pair, slices)
    structure, shared = _structure(pair, material, options)
    law = contact_law(pair, np.clip(position, 0.0, pair.path_of_contact), material, options)
    corner = corner_gap_by_pinion(pair, position)
    if options.law == "paper":
        corner = np.where((position >= 0.0) & (position <= pair.path_of_contact), 0.0, np.inf)
    gap = np.repeat(corner[None], slices.n_slices, axis=0)
    if deviation is not None:
        gap = gap + deviation
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
        slice_place=place,
    )


def slice_places(pair: GearPair, slices: SliceOptions) -> Array:
    """Middle of every slice from the end that enters first, (slice,) m."""
    edges = np.linspace(0.0, pair.face_width, slices.n_slices + 1)
    return 0.5 * (edges[1:] + edges[:-1])


@lru_cache(maxsize=16)
def _structure(pair: GearPair, material: Material, options: MeshOptions) -> tuple[Array, float]:
    """Compliance of both sound teeth and bodies per width (node,) m2/N, and what pairs share, m/N."""
    on_path, place = np.unique(np.clip(node_positions(pair, options), 0.0, pair.path_of_contact), return_inverse=True)
    in_plane = material.in_plane(options.elasticity)
    whole = np.zeros_like(on_path)
    for gear, curvature in ((pair.pinion, pair.pinion_curvature), (pair.wheel, pair.wheel_curvature)):
        own = structural_compliance(healthy_tooth(gear), np.asarray(curvature(on_path)), in_plane, options)
        whole += own * gear.face_width
    shared = 0.0
    if options.pair_coupling == "coupled":
        shared = shared_body_compliance(pair, in_plane)
    left = whole - shared * pair.face_width
    if left.min() <= 0.05 * whole.min():
        raise ExtrapolationError(
            f"the gear bodies share {shared:.3g} m/N of the stiffest pair's {whole.min() / pair.face_width:.3g} m/N; "
            f"use a larger bore_radius_mm or mesh.pair_coupling=sum"
        )
    return left[place], shared


def pair_positions(mesh: SlicedMesh, roll: Array) -> Array:
    """Positions s of every pair's slices, (phase, pair, slice) m; pairs in order of entry, newest first."""
    pitch = mesh.pair.base_pitch
    newest = np.floor(roll / pitch) - FIRST_PITCH
    n_pairs = math.ceil(LAST_PITCH - FIRST_PITCH + float(mesh.lag[-1]) / pitch)
    index = newest[:, None] - np.arange(n_pairs)
    return (roll[:, None] - index * pitch)[:, :, None] - mesh.lag


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContactPhases:
    """What every slice of every pair is at given rolls, whatever the force; new gaps are all that wear changes.

    Parameters
    ----------
    roll : (phase,) m
    position, structure, constant, gap, width : (phase, pair, slice), m, m2/N, 1, m, m: see ``SlicedMesh``; ``width`` is
        that of the slice, less where the field of action cuts it
    """

    mesh: SlicedMesh
    roll: Array
    position: Array
    structure: Array
    constant: Array
    gap: Array
    width: Array


def contact_phases(mesh: SlicedMesh, roll: Array) -> ContactPhases:
    """Prepare the loaded contact at rolls, (phase,) m; at 0 the first slice of a pair enters at A."""
    position = pair_positions(mesh, roll)
    share = np.ones_like(position)
    if mesh.options.law == "paper":  # elsewhere the corners' gaps tell where contact ends
        position, share = _cut_by_field(mesh, position)
    return ContactPhases(
        mesh=mesh,
        roll=roll,
        position=position,
        structure=np.interp(position, mesh.position, mesh.structure),
        constant=np.interp(position, mesh.position, mesh.contact_constant),
        gap=_gaps(mesh, position),
        width=mesh.slice_width * share,
    )


def loaded_contact(mesh: SlicedMesh, roll: Array, force: float) -> LoadedContact:
    """Load of every slice of every pair under a total force along the transverse line of action.

    Parameters
    ----------
    roll : (phase,) m    at 0 the first slice of a pair enters at A
    force : N

    Raises
    ------
    ConfigError    for a force that is not positive
    GeometryError    where no slice can touch, or the bearing slices never settle
    """
    return settled_contact(contact_phases(mesh, roll), force)


def settled_contact(phases: ContactPhases, force: float) -> LoadedContact:
    """The same at rolls that are prepared already."""
    if not force > 0.0:
        raise ConfigError(
            f"the mesh force is {force:g} N and must be positive; give a torque that the pinion drives with"
        )
    mesh, roll = phases.mesh, phases.roll
    approach, stiffness = np.empty_like(roll), np.empty_like(roll)
    line_load = np.empty_like(phases.position)
    length = mesh.slices.coupling_modules * mesh.pair.pinion.normal_module
    coupling = (length / mesh.slice_width) ** 2 if mesh.slices.slice_coupling == "coupled" else 0.0
    n_unsettled = solve_slices(
        phases.structure, mesh.contact_factor, phases.constant, mesh.log_weight, phases.gap, phases.width, coupling,
        mesh.shared_compliance, force, force / mesh.pair.face_width, approach, stiffness, line_load,
    )  # fmt: skip
    if n_unsettled or not np.isfinite(approach).all():
        raise GeometryError(
            f"no contact at {int(np.sum(~np.isfinite(approach)))} and no settled one at {n_unsettled} of {len(roll)} "
            f"phases under {force:.4g} N; reduce the modification or raise the torque"
        )
    return LoadedContact(
        roll=roll, position=phases.position, approach=approach, stiffness=stiffness, line_load=line_load
    )


def _gaps(mesh: SlicedMesh, position: Array) -> Array:
    """(phase, pair, slice) m; inf beyond the table, where no corner reaches."""
    gap = np.empty_like(position)
    for j in range(mesh.slices.n_slices):
        gap[..., j] = np.interp(position[..., j], mesh.position, mesh.gap[j], left=np.inf, right=np.inf)
    return gap


def _cut_by_field(mesh: SlicedMesh, position: Array) -> tuple[Array, Array]:
    """Slices that the edge of the field of action cuts: the middle of what lies on the path and its share of the slice,
    of the shape of ``position`` both."""
    half = 0.5 * mesh.slice_width * math.tan(mesh.pair.base_helix_angle) * (not mesh.slices.slices_in_phase)
    path = mesh.pair.path_of_contact
    if half == 0.0:
        return position, ((position >= 0.0) & (position <= path)).astype(np.float64)
    low, high = np.maximum(position - half, 0.0), np.minimum(position + half, path)
    share = np.clip((high - low) / (2.0 * half), 0.0, 1.0)
    return np.where(share > 0.0, 0.5 * (low + high), position), share


def single_pair_stiffness(mesh: SlicedMesh, position: Array, force: float) -> Array:
    """Stiffness of the slices of one pair that lie on the path, flanks taken as touching, (phase,) N/m.

    Parameters
    ----------
    position : (phase,) m    of the first slice, from A
    force : N                at whose even load per width a load-dependent contact term is taken

    The slices bend by themselves here: the sum over the face of 1 / (structure + contact).
    """
    middle, share = _cut_by_field(mesh, position[:, None] - mesh.lag)
    constant = np.interp(middle, mesh.position, mesh.contact_constant)
    contact = mesh.contact_factor * (constant - mesh.log_weight * math.log(force / mesh.pair.face_width))
    softness = np.interp(middle, mesh.position, mesh.structure) + contact
    alone = mesh.slice_width * np.sum(share / softness, axis=1)
    return alone / (1.0 + mesh.shared_compliance * alone)


def contact_pressure(mesh: SlicedMesh, contact: LoadedContact, material: Material) -> Array:
    """Largest Hertzian pressure of every slice, (phase, pair, slice) Pa.

    Source: Hertz, p = sqrt(w E' / (2 pi rho)) with E' = E / (1 - nu^2) for two like flanks. Load along the normal and
    per length of the contact line are w / cos(beta_b) and times cos(beta_b), and the relative radius in the normal
    section is the transverse one over cos(beta_b): p takes the root of cos(beta_b).
    """
    on_path = np.clip(contact.position, 0.0, mesh.pair.path_of_contact)
    radius = relative_radius(mesh.pair, on_path)
    reduced = material.youngs_modulus / (1.0 - material.poisson_ratio**2)
    slant = math.cos(mesh.pair.base_helix_angle)
    return np.sqrt(contact.line_load * slant * reduced / (2.0 * math.pi * radius))
