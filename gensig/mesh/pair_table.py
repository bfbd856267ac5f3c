"""Compliance and gap of every distinct tooth along the line of action: all that statics and dynamics ask."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

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
from gensig.mesh.local_contact import contact_compliance
from gensig.mesh.options import MeshOptions

Array = NDArray[np.float64]

# pairs followed at once: positions u - 1, u, u + 1, u + 2 base pitches, u in 0..1
N_PAIRS = 4
FIRST_PITCH, LAST_PITCH = -1, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class GearTable:
    """One gear's side of the mesh: one row per distinct tooth, ``kind`` says which row a tooth has.

    ``compliance`` and ``gap`` are (distinct, node), m/N and m, each with its slope over position.
    """

    compliance: Array
    compliance_slope: Array
    gap: Array
    gap_slope: Array
    present: NDArray[np.bool_]
    kind: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PairTable:
    """Both gears' tables on the node positions s of -1 to 3 base pitches, and what the pairs share.

    The contact term stands on the pinion's side for sound flanks; each side adds what its faults take off the
    contact width. ``shared_compliance`` is the body compliance that all pairs in contact share.
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
) -> PairTable:
    """Tabulate the mesh of a gear pair.

    Parameters
    ----------
    teeth : the teeth that are not sound, by (gear, tooth), as ``faulty_teeth`` gives them
    load : (node,) N    load of a pair by position, at which a load-dependent contact term is taken
    """
    odd = dict(teeth or {})
    position = node_positions(pair, options)
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    corner = corner_gap_by_pinion(pair, position)

    def contact(width: Array) -> Array:
        return contact_compliance(pair, on_path, width, np.asarray(load), material, options)

    sound = contact(np.full_like(position, pair.pinion.face_width))
    structure = material.in_plane(options.elasticity)
    sides = {}
    for gear, curvature, base, gap in (
        (pair.pinion, pair.pinion_curvature(on_path), np.zeros_like(sound), corner),
        (pair.wheel, pair.wheel_curvature(on_path), -sound, np.zeros_like(corner)),
    ):
        sides[gear.name] = _gear_table(
            gear, np.asarray(curvature), position, contact, base, gap, structure, options, odd
        )
    shared = shared_body_compliance(pair, structure) if options.pair_coupling == "coupled" else 0.0
    stiffest = float(sides["pinion"].compliance.min() + sides["wheel"].compliance.min())
    if shared >= 0.95 * stiffest:
        raise ExtrapolationError(
            f"the gear bodies share {shared:.3g} m/N of the stiffest pair's {stiffest:.3g} m/N, more than one pair "
            f"has; use a larger bore_radius_mm or mesh.pair_coupling=sum"
        )
    return PairTable(
        pair=pair,
        options=options,
        position=position,
        pinion=sides["pinion"],
        wheel=sides["wheel"],
        shared_compliance=shared,
    )


def structural_compliance(tooth: Tooth, curvature: Array, material: Material, options: MeshOptions) -> Array:
    """Tooth and body compliance of one loaded tooth, (phase,) m/N; the material as ``Material.in_plane`` gives it."""
    gear = tooth.gear
    own = tooth_compliance(tooth, curvature, material, reach=options.tooth).total
    return own + body_compliance(gear, load_angle(gear, curvature), material, options)


def _gear_table(
    gear: Gear,
    curvature: Array,
    position: Array,
    contact: Callable[[Array], Array],
    base: Array,
    gap: Array,
    material: Material,
    options: MeshOptions,
    odd: Mapping[tuple[str, int], Tooth],
) -> GearTable:
    mine = {tooth: odd[name, tooth] for name, tooth in sorted(odd) if name == gear.name}
    distinct = [healthy_tooth(gear), *mine.values()]
    kind = np.zeros(gear.n_teeth, dtype=np.int64)
    for row, tooth_index in enumerate(mine, start=1):
        kind[tooth_index] = row
    widths = [np.interp(curvature, tooth.profile.curvature_radius, tooth.contact_width) for tooth in distinct]
    compliance = np.stack(
        [
            structural_compliance(tooth, curvature, material, options) + contact(width) + base
            for tooth, width in zip(distinct, widths, strict=True)
        ]
    )
    deviation = np.stack(
        [np.interp(curvature, tooth.profile.curvature_radius, tooth.flank_deviation.mean(axis=0)) for tooth in distinct]
    )
    total_gap = deviation + gap
    return GearTable(
        compliance=compliance,
        compliance_slope=np.gradient(compliance, position, axis=1),
        gap=total_gap,
        gap_slope=np.gradient(total_gap, position, axis=1),
        present=np.array([tooth.present for tooth in distinct]),
        kind=kind,
    )


def pair_compliance(table: PairTable, position: Array, pinion_kind: int = 0, wheel_kind: int = 0) -> Array:
    """Compliance of a single pair under the table's load, (phase,) m/N."""
    return np.interp(position, table.position, table.pinion.compliance[pinion_kind]) + np.interp(
        position, table.position, table.wheel.compliance[wheel_kind]
    )
