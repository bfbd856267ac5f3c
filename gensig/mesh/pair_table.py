"""Table of spur teeth: what every distinct tooth of a gear adds, by contact position."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Integers
from gensig.errors import ExtrapolationError
from gensig.geometry.contact import SIDES, GearPair, corner_gap_by_pinion
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material
from gensig.mesh.body import body_compliance, check_rim
from gensig.mesh.body_coupling import shared_body_compliance
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.face import (
    FlankContacts,
    bearing_width,
    face_contact,
    flank_contacts,
    is_nominal,
)
from gensig.mesh.local_contact import ContactLaw, contact_law, relative_radius
from gensig.mesh.modification import PLAIN, PairModification, sound_teeth
from gensig.mesh.options import MeshOptions
from gensig.mesh.root_crack import crack_compliance
from gensig.mesh.smooth_table import smooth
from gensig.mesh.tooth_table import GearTeeth, TablePart, ToothTable

# tooth pairs at once: positions u - 1, u, u + 1, u + 2 base pitches, u in 0..1
N_PAIRS = 4
FIRST_PITCH, LAST_PITCH = -1, 3
# larger second differences of compliances, as a share, and of gaps in m are steps and kinks of
# the flank
SMOOTHED_SHARE, SMOOTHED_GAP = 0.01, 1e-7
# (kind, node) of one gear as (pinion kind, wheel kind, chord, node)
_KINDS = {
    "pinion": (slice(None), None, None, slice(None)),
    "wheel": (None, slice(None), None, slice(None)),
}


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
) -> ToothTable:
    """Tabulate the spur teeth of a gear pair on the positions of -1 to 3 base pitches.

    The contact term of healthy flanks is on the pinion's side. Each side adds what its faults cost
    against a sound mate.

    Parameters
    ----------
    teeth : the faulty teeth by (gear, tooth), from ``faulty_teeth``
    modification : of the flanks of all other teeth
    load : (node,) N    load of a tooth pair by position, for a load-dependent contact term
    """
    sound = _sound_mesh(pair, material, options)
    sound_tooth = sound_teeth(pair, modification)
    (pinion, of_pinion), (wheel, of_wheel) = (
        _gear_table(sound, side, sound_tooth[side], teeth or {}, load) for side in SIDES
    )
    shared = sound.shared_compliance
    stiffest = float(of_pinion.compliance.min() + of_wheel.compliance.min())
    if shared >= 0.95 * stiffest:
        raise ExtrapolationError(
            f"the gear bodies share {shared:.3g} m/N of the stiffest pair's {stiffest:.3g} m/N, "
            f"more than one pair has; use a larger bore_radius_mm or mesh.pair_coupling=sum"
        )
    return ToothTable(
        pair=pair,
        options=options,
        position=sound.position,
        first_pitch=FIRST_PITCH,
        last_pitch=LAST_PITCH,
        depth=np.zeros(1),
        pinion=pinion,
        wheel=wheel,
        parts=(of_pinion, of_wheel),
        shared_compliance=shared,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _SoundMesh:
    """Quantities at the nodes that neither load nor faults change.

    ``flanks``, ``corner`` (node,) m and ``structure`` (node,) m/N are by side; ``bending`` (node,)
    m/N as from ``slice_bending``.
    """

    options: MeshOptions
    in_plane: Material
    position: Array
    flanks: dict[str, FlankSide]
    corner: dict[str, Array]
    structure: dict[str, Array]
    bending: Array
    shared_compliance: float


@lru_cache(maxsize=16)
def _sound_mesh(pair: GearPair, material: Material, options: MeshOptions) -> _SoundMesh:
    position = node_positions(pair, options)
    in_plane = material.in_plane(options.elasticity)
    flanks = flank_sides(pair, position, material, options, 1.0)
    corner = corner_gap_by_pinion(pair, position)
    return _SoundMesh(
        options=options,
        in_plane=in_plane,
        position=position,
        flanks=flanks,
        corner={"pinion": corner, "wheel": np.zeros_like(corner)},
        structure={
            side: _structure_at_nodes(
                healthy_tooth(gear), flanks[side].curvature, in_plane, options
            )
            for side, gear in pair.gears.items()
        },
        bending=slice_bending(pair, position, material, options),
        shared_compliance=coupling_compliance(pair, in_plane, options),
    )


def coupling_compliance(
    pair: GearPair, in_plane: Material, options: MeshOptions
) -> float:
    """Body compliance that tooth pairs in contact share, m/N; 0 with ``pair_coupling=sum``."""
    if options.pair_coupling == "sum":
        return 0.0
    return shared_body_compliance(pair, in_plane)


def _structure_at_nodes(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """Structural compliance (node,) m/N, computed once per distinct curvature radius.

    Most nodes are held at A or E.
    """
    different, inverse = np.unique(curvature, return_inverse=True)
    return structural_compliance(tooth, different, material, options)[inverse]


def structural_compliance(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> Array:
    """Tooth and body compliance of one loaded tooth, (phase,) m/N.

    The material is that of ``Material.in_plane``.
    """
    terms = structural_terms(tooth, curvature, material, options)
    return np.sum(list(terms.values()), axis=0)


def check_teeth(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    teeth: Mapping[tuple[str, int], Tooth],
) -> None:
    """Raise what ``pair_table`` would raise about faulty teeth, at one contact point per tooth.

    Raises
    ------
    FaultError, ExtrapolationError    for a tooth outside the range of the chosen conventions
    """
    in_plane = material.in_plane(options.elasticity)
    distinct = {id(tooth): (side, tooth) for (side, _), tooth in teeth.items()}
    for side, tooth in distinct.values():
        if not tooth.present:
            continue
        curvature = np.array([pair.curvature(side, pair.pitch_point)])
        reached = np.minimum(curvature, tooth.tip_curvature_radius)
        tooth_terms(tooth, reached, in_plane, options)
        if options.body == "sainsot":
            angle = load_angle(tooth.gear, reached)
            body_compliance(tooth.gear, angle, in_plane, options)
        else:
            check_rim(tooth.gear, options)
        if options.law == "paper" and not is_nominal(tooth):
            bearing_width(tooth, curvature)


def structural_terms(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> dict[str, Array]:
    """Terms of the structural compliance: those of the tooth, and that of the body."""
    terms = tooth_terms(tooth, curvature, material, options)
    opened = terms.pop(
        "crack"
    )  # last: the order of the terms decides the bits of their sum
    angle = load_angle(tooth.gear, curvature)
    body = body_compliance(tooth.gear, angle, material, options)
    return {**terms, "foundation": body, "crack": opened}


def tooth_terms(
    tooth: Tooth, curvature: Array, material: Material, options: MeshOptions
) -> dict[str, Array]:
    """Terms of the tooth's own compliance: bending, shear, axial, crack.

    The last is 0 where cracks cut sections (``mesh.crack=paper``).
    """
    papers_crack = options.crack == "paper"
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
        "crack": opened,
    }


def slice_bending(
    pair: GearPair, position: Array, material: Material, options: MeshOptions
) -> Array:
    """Compliance of both healthy teeth that every slice has for itself, (phase,) m/N.

    0 with ``bending=whole``.

    Three-dimensional finite elements of a pinion loaded over part of its face give it 0.8
    (middle, or both ends) to 1.4 times (one end) the teeth's own bending, shear and axial
    compliance; the body behind them is shared (``tests/reference``).
    """
    if options.bending == "whole":
        return np.zeros_like(position)
    clipped = np.clip(position, 0.0, pair.path_of_contact)
    on_path, inverse = np.unique(clipped, return_inverse=True)
    in_plane = material.in_plane(options.elasticity)
    both = np.zeros_like(on_path)
    for side, gear in pair.gears.items():
        tooth, curvature = healthy_tooth(gear), pair.curvature(side, on_path)
        both += tooth_compliance(tooth, curvature, in_plane, reach=options.tooth).total
    return both[inverse]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankSide:
    """One gear's flank at contact positions.

    ``contacts`` go on beyond its tip, ``curvature`` is held at A and E. ``sound`` is the contact
    compliance of healthy flanks, ``base`` the ``share`` of it that is counted on the mate's side.
    """

    gear: Gear
    curvature: Array
    contacts: FlankContacts
    law: ContactLaw
    share: float
    load: Array
    sound: Array
    base: Array

    def with_load(self, load: Array | float) -> FlankSide:
        """This flank under another load of a tooth pair in N, (phase,) or one number."""
        loads = np.empty_like(self.curvature)
        loads[:] = load
        sound = self.law.compliance(self.gear.face_width, loads)
        return replace(self, load=loads, sound=sound, base=self.share * sound)

    def contact(
        self, tooth: Tooth, bending: Array, options: MeshOptions
    ) -> tuple[Array, Array]:
        """Gap and contact compliance less ``base`` against a sound mate, (phase,) m and m/N.

        ``bending`` (phase,) m/N as from ``slice_bending``.
        """
        gap, compliance = np.zeros_like(self.load), self.sound
        if tooth.present and not is_nominal(tooth):
            if options.law == "paper":
                width = bearing_width(tooth, self.curvature)
                compliance = self.law.compliance(width, self.load)
            else:
                gap, compliance = face_contact(
                    tooth, self.contacts, self.law, self.load, bending
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
    """Both gears' flanks at positions s, (phase,) m, under the load of a tooth pair in N.

    ``pinion_share`` of the contact compliance of healthy flanks is counted on the pinion's side.
    """
    path = pair.path_of_contact
    on_path = np.clip(position, 0.0, path)
    beyond_tip = np.maximum(position, 0.0), np.minimum(position, path)
    shares = 1.0 - pinion_share, pinion_share
    radius = relative_radius(pair, on_path)
    return {
        side: FlankSide(
            gear=pair.gears[side],
            curvature=pair.curvature(side, on_path),
            contacts=flank_contacts(
                pair.gears[side], pair.curvature(side, reach), radius
            ),
            law=contact_law(pair, on_path, material, options),
            share=share,
            load=np.empty(0),
            sound=np.empty(0),
            base=np.empty(0),
        ).with_load(load)
        for side, reach, share in zip(SIDES, beyond_tip, shares, strict=True)
    }


def _gear_table(
    sound: _SoundMesh,
    side: str,
    sound_tooth: Tooth,
    teeth: Mapping[tuple[str, int], Tooth],
    load: Array | float,
) -> tuple[GearTeeth, TablePart]:
    """Kinds of one gear's teeth, and what they add to a pair with any mate.

    Teeth that are one object are one kind, equal structures are computed once.
    """
    flank, options = sound.flanks[side].with_load(load), sound.options
    distinct, kind = distinct_teeth(sound_tooth, teeth)
    structures = {_structure_key(sound_tooth): sound.structure[side]}
    compliance: Array = np.empty((len(distinct), len(sound.position)))
    gap: Array = np.empty_like(compliance)
    for row, tooth in enumerate(distinct):
        key = _structure_key(tooth)
        if key not in structures:
            reached = np.minimum(flank.curvature, tooth.tip_curvature_radius)
            structures[key] = _structure_at_nodes(
                tooth, reached, sound.in_plane, options
            )
        flank_gap, contact = flank.contact(tooth, sound.bending, options)
        compliance[row] = structures[key] + contact
        gap[row] = flank_gap + sound.corner[side]
    distance = float(sound.position[1] - sound.position[0])
    limit = SMOOTHED_SHARE * float(compliance[0].min())
    compliance, compliance_slope = smooth(compliance, distance, limit)
    gap, gap_slope = smooth(gap, distance, SMOOTHED_GAP)
    kinds = _KINDS[side]
    part = TablePart(
        compliance=compliance[kinds],
        compliance_slope=compliance_slope[kinds],
        gap=gap[kinds],
        gap_slope=gap_slope[kinds],
    )
    present = np.array([tooth.present for tooth in distinct])
    return GearTeeth(kind=kind, present=present), part


def distinct_teeth(
    sound: Tooth, teeth: Mapping[tuple[str, int], Tooth]
) -> tuple[list[Tooth], Integers]:
    """Distinct objects among one gear's teeth, and the index of each tooth's object, (tooth,).

    The first is the healthy tooth; ``teeth`` are the others by (gear, tooth).
    """
    distinct, index = [sound], {id(sound): 0}
    kind = np.zeros(sound.gear.n_teeth, dtype=np.int64)
    for gear, number in sorted(teeth):
        if gear == sound.gear.name:
            tooth = teeth[gear, number]
            if id(tooth) not in index:
                index[id(tooth)] = len(distinct)
                distinct.append(tooth)
            kind[number] = index[id(tooth)]
    return distinct, kind


def _structure_key(tooth: Tooth) -> tuple[int, ...]:
    """Key of a tooth's structure: teeth whose sections are the same objects bend alike."""
    return id(tooth.material_loss), id(tooth.slice_edges), id(tooth.cracks)
