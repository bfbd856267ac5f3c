"""Compliance and gap of every distinct tooth along the line of action.

All that statics and dynamics ask.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ExtrapolationError
from gensig.geometry.contact import GearPair, corner_gap_by_pinion
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material
from gensig.mesh.body import body_compliance
from gensig.mesh.body_coupling import shared_body_compliance
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.face import bearing_width, face_contact, is_nominal
from gensig.mesh.local_contact import ContactLaw, contact_law, relative_radius
from gensig.mesh.modification import PLAIN, PairModification, sound_teeth
from gensig.mesh.options import MeshOptions
from gensig.mesh.root_crack import crack_compliance
from gensig.mesh.smooth_table import smooth

Array = NDArray[np.float64]

# pairs followed at once: positions u - 1, u, u + 1, u + 2 base pitches, u in 0..1
N_PAIRS = 4
FIRST_PITCH, LAST_PITCH = -1, 3
# larger second differences of compliances, as a share, and of gaps in m are steps and kinks of
# the flank
SMOOTHED_SHARE, SMOOTHED_GAP = 0.01, 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class GearTable:
    """One gear's side of the mesh: one row per distinct tooth, ``kind`` says which row a tooth has.

    ``compliance`` and ``gap`` are (distinct, node), m/N and m, each with its slope over position;
    between nodes slopes go straight and values follow their integral.
    """

    compliance: Array
    compliance_slope: Array
    gap: Array
    gap_slope: Array
    present: NDArray[np.bool_]
    kind: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairTable:
    """Both gears' tables on the node positions s of -1 to 3 base pitches, and what the pairs share.

    The contact term stands on the pinion's side for sound flanks; each side adds what its own
    faults cost against a sound mate. ``shared_compliance`` is the body compliance that all pairs
    in contact share.
    """

    pair: GearPair
    options: MeshOptions
    position: Array
    pinion: GearTable
    wheel: GearTable
    shared_compliance: float


def node_positions(pair: GearPair, options: MeshOptions) -> Array:
    """Positions s of the table's nodes, (node,) m; their distance divides the base pitch."""
    n_nodes = (LAST_PITCH - FIRST_PITCH) * options.points_per_pitch + 1
    return pair.base_pitch * np.linspace(FIRST_PITCH, LAST_PITCH, n_nodes)


def pair_table(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    teeth: Mapping[tuple[str, int], Tooth] | None = None,
    *,
    load: Array | float,
    modification: PairModification = PLAIN,
) -> PairTable:
    """Tabulate the mesh of a gear pair.

    Parameters
    ----------
    teeth : the teeth that are not sound, by (gear, tooth), as ``faulty_teeth`` gives them
    modification : of the flanks of all others
    load : (node,) N    load of a pair by position, at which a load-dependent contact term is taken
    """
    odd = dict(teeth or {})
    position = node_positions(pair, options)
    sound = _sound_structure(pair, material, options)
    whole = sound_teeth(pair, modification)
    tables = {}
    for name, side in _node_sides(pair, material, options).items():
        mine = {tooth: odd[gear, tooth] for gear, tooth in sorted(odd) if gear == name}
        tables[name] = _gear_table(
            side.under(load),
            position,
            whole[name],
            mine,
            sound[name],
            sound["bending"],
            material.in_plane(options.elasticity),
            options,
        )
    stiffest = float(sum(table.compliance.min() for table in tables.values()))
    if sound["shared"] >= 0.95 * stiffest:
        raise ExtrapolationError(
            f"the gear bodies share {sound['shared']:.3g} m/N of the stiffest pair's {stiffest:.3g} m/N, more than one "
            f"pair has; use a larger bore_radius_mm or mesh.pair_coupling=sum"
        )
    return PairTable(
        pair=pair,
        options=options,
        position=position,
        **tables,
        shared_compliance=sound["shared"],
    )


@lru_cache(maxsize=16)
def _node_sides(
    pair: GearPair, material: Material, options: MeshOptions
) -> dict[str, FlankSide]:
    """The flanks at the nodes, under no load that matters."""
    return flank_sides(pair, node_positions(pair, options), material, options, 1.0)


@lru_cache(maxsize=16)
def _sound_structure(
    pair: GearPair, material: Material, options: MeshOptions
) -> dict[str, Any]:
    """What neither load nor faults change: (corner gap, structural compliance) of either gear at
    the nodes, (node,) each, what bends slice by slice (node,), and the shared body compliance."""
    position = node_positions(pair, options)
    structure = material.in_plane(options.elasticity)
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    corner = (corner_gap_by_pinion(pair, position), np.zeros_like(position))
    by_side: dict[str, Any] = {}
    for (side, gear), gap in zip(pair.gears.items(), corner, strict=True):
        curvature = np.asarray(pair.curvature(side, on_path))
        by_side[side] = (
            gap,
            _structure_at_nodes(healthy_tooth(gear), curvature, structure, options),
        )
    shared = (
        shared_body_compliance(pair, structure)
        if options.pair_coupling == "coupled"
        else 0.0
    )
    return {
        **by_side,
        "bending": slice_bending(pair, position, material, options),
        "shared": shared,
    }


def _structure_at_nodes(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """Structural compliance at each different curvature radius once, most nodes being held at A
    or E, (node,).
    """
    different, place = np.unique(curvature, return_inverse=True)
    return structural_compliance(tooth, different, material, options)[place]


def structural_compliance(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """Tooth and body compliance of one loaded tooth, (phase,) m/N.

    The material as ``Material.in_plane`` gives it.
    """
    return np.sum(
        list(structural_terms(tooth, curvature, material, options).values()), axis=0
    )


def check_teeth(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    teeth: Mapping[tuple[str, int], Tooth],
) -> None:
    """Raise what ``pair_table`` would raise about faulty teeth, at the cost of one contact point
    a tooth.

    Raises
    ------
    FaultError, ExtrapolationError    for what the chosen conventions cannot take
    """
    structure, known = material.in_plane(options.elasticity), set()
    sides = (
        flank_sides(pair, np.array([pair.pitch_point]), material, options, 1.0)
        if teeth
        else {}
    )
    for (name, _), tooth in teeth.items():
        if id(tooth) in known or not tooth.present:
            continue
        known.add(id(tooth))
        side = sides[name]
        structural_terms(
            tooth,
            np.minimum(side.curvature, tooth.tip_curvature_radius),
            structure,
            options,
        )
        if options.law == "paper" and not is_nominal(tooth):
            bearing_width(tooth, side.curvature)


def structural_terms(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> dict[str, Array]:
    """The same by its parts.

    Bending, shear, axial, foundation, and what cracks add where they do not cut sections.
    """
    gear, papers_crack = tooth.gear, options.crack == "paper"
    parts = tooth_compliance(
        tooth, curvature, material, reach=options.tooth, papers_crack=papers_crack
    )
    opened = np.zeros_like(curvature)
    if tooth.cracks and not papers_crack:
        opened = crack_compliance(
            tooth, curvature, material, allow_extrapolation=options.allow_extrapolation
        )
    return {
        "bending": parts.bending,
        "shear": parts.shear,
        "axial": parts.axial,
        "foundation": body_compliance(
            gear, load_angle(gear, curvature), material, options
        ),
        "crack": opened,
    }


def slice_bending(
    pair: GearPair, position: Array, material: Material, options: MeshOptions
) -> Array:
    """Compliance of both sound teeth that belongs to the slices of the face, (phase,) m/N; 0 with
    ``bending=whole``.

    Three-dimensional finite elements of a pinion loaded over part of its face give it 0.8
    (middle, or both ends) to 1.4 times (one end) the teeth's own bending, shear and axial
    compliance; the body behind them is shared (``tests/reference``).
    """
    if options.bending == "whole":
        return np.zeros_like(position)
    on_path, place = np.unique(
        np.clip(position, 0.0, pair.path_of_contact), return_inverse=True
    )
    structure = material.in_plane(options.elasticity)
    own = np.zeros_like(on_path)
    for gear, curvature in (
        (pair.pinion, pair.pinion_curvature),
        (pair.wheel, pair.wheel_curvature),
    ):
        radius = np.asarray(curvature(on_path))
        own += tooth_compliance(
            healthy_tooth(gear), radius, structure, reach=options.tooth
        ).total
    return own[place]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankSide:
    """One gear's flank at contact positions: ``flank_curvature`` goes on beyond its tip,
    ``curvature`` is held at A and E. ``base`` is the ``share`` of a sound pair's contact
    compliance that the mate's side carries already."""

    gear: Gear
    curvature: Array
    flank_curvature: Array
    relative_radius: Array
    law: ContactLaw
    share: float
    load: Array
    base: Array

    def under(self, load: Array | float) -> FlankSide:
        """The same under another load of a pair in N, (phase,) or one for all."""
        loads = np.array(
            np.broadcast_to(np.asarray(load, dtype=np.float64), self.curvature.shape)
        )
        return replace(
            self,
            load=loads,
            base=self.share * self.law.compliance(self.gear.face_width, loads),
        )

    def contact(
        self, tooth: Tooth, bending: Array, options: MeshOptions
    ) -> tuple[Array, Array]:
        """Gap and contact compliance of one tooth against a sound mate, (phase,) m and m/N, less
        ``base``.

        ``bending`` (phase,) m/N is what bends slice by slice, see ``slice_bending``.
        """
        if is_nominal(tooth) or not tooth.present:
            return np.zeros_like(self.load), self.law.compliance(
                self.gear.face_width, self.load
            ) - self.base
        if options.law == "paper":
            width = bearing_width(tooth, self.curvature)
            return np.zeros_like(self.load), self.law.compliance(
                width, self.load
            ) - self.base
        gap, compliance = face_contact(
            tooth,
            self.flank_curvature,
            self.relative_radius,
            self.law,
            self.load,
            bending,
        )
        return gap, compliance - self.base


def flank_sides(
    pair: GearPair,
    position: Array,
    material: Material,
    options: MeshOptions,
    load: Array | float,
    *,
    pinion_share: float = 1.0,
) -> dict[str, FlankSide]:
    """Both gears' flanks at positions s, (phase,) m, under the load of a pair in N.

    ``pinion_share`` of the contact compliance of sound flanks is counted on the pinion's side.
    """
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    law = contact_law(pair, on_path, material, options)
    relative = relative_radius(pair, on_path)
    return {
        gear.name: FlankSide(
            gear=gear,
            curvature=np.asarray(curvature(on_path)),
            flank_curvature=np.asarray(curvature(beyond_tip)),
            relative_radius=relative,
            law=law,
            share=share,
            load=np.empty(0),
            base=np.empty(0),
        ).under(load)
        for gear, curvature, beyond_tip, share in (
            (
                pair.pinion,
                pair.pinion_curvature,
                np.maximum(position, 0.0),
                1.0 - pinion_share,
            ),
            (
                pair.wheel,
                pair.wheel_curvature,
                np.minimum(position, pair.path_of_contact),
                pinion_share,
            ),
        )
    }


def _gear_table(
    side: FlankSide,
    position: Array,
    whole: Tooth,
    odd: Mapping[int, Tooth],
    sound: tuple[Array, Array],
    bending: Array,
    material: Material,
    options: MeshOptions,
) -> GearTable:
    """Rows of the distinct teeth.

    Teeth that are one object share a row, equal structures are computed once.
    """
    distinct, kind = distinct_teeth(whole, odd)
    corner, sound_row = sound
    structures = {_structure_key(distinct[0]): sound_row}
    compliance: Array = np.empty((len(distinct), len(position)))
    gap: Array = np.empty_like(compliance)
    for row, tooth in enumerate(distinct):
        key = _structure_key(tooth)
        if key not in structures:
            reached = np.minimum(side.curvature, tooth.tip_curvature_radius)
            structures[key] = _structure_at_nodes(tooth, reached, material, options)
        own_gap, contact = side.contact(tooth, bending, options)
        compliance[row] = structures[key] + contact
        gap[row] = own_gap + corner
    distance = float(position[1] - position[0])
    compliance, compliance_slope = smooth(
        compliance, distance, SMOOTHED_SHARE * float(compliance[0].min())
    )
    gap, gap_slope = smooth(gap, distance, SMOOTHED_GAP)
    return GearTable(
        compliance=compliance,
        compliance_slope=compliance_slope,
        gap=gap,
        gap_slope=gap_slope,
        present=np.array([tooth.present for tooth in distinct]),
        kind=kind,
    )


def distinct_teeth(
    sound: Tooth, odd: Mapping[int, Tooth]
) -> tuple[list[Tooth], NDArray[np.int64]]:
    """The sound tooth and those that differ, by object, and which of them each tooth of the gear
    is, (tooth,).
    """
    distinct = [sound]
    kind = np.zeros(sound.gear.n_teeth, dtype=np.int64)
    for number, tooth in odd.items():
        row = next(
            (row for row, known in enumerate(distinct) if known is tooth), len(distinct)
        )
        if row == len(distinct):
            distinct.append(tooth)
        kind[number] = row
    return distinct, kind


def _structure_key(tooth: Tooth) -> tuple[int, ...]:
    """Teeth whose sections are the same objects bend alike, wherever their flanks stand."""
    return id(tooth.material_loss), id(tooth.slice_edges), id(tooth.cracks)


def pair_compliance(
    table: PairTable, position: Array, pinion_kind: int = 0, wheel_kind: int = 0
) -> Array:
    """Compliance of a single pair under the table's load, (phase,) m/N."""
    return np.interp(
        position, table.position, table.pinion.compliance[pinion_kind]
    ) + np.interp(position, table.position, table.wheel.compliance[wheel_kind])
