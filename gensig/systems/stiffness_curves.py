"""Quasi-static curves of one mesh of spur teeth.

Of a pair, or of the mesh of a drive line that records follow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import Tooth
from gensig.material import Material
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import (
    PairTable,
    flank_sides,
    slice_bending,
    structural_terms,
)

Array = NDArray[np.float64]


class LoadedMesh(Protocol):
    """A mesh under a set torque.

    Geometry, material, mesh options, and the force along the line of action in N.
    """

    @property
    def pair(self) -> GearPair:
        """Geometry of the two gears."""

    @property
    def material(self) -> Material:
        """Elasticity of both gears."""

    @property
    def mesh(self) -> MeshOptions:
        """Conventions of the mesh."""

    @property
    def mesh_force(self) -> float:
        """Normal force, N."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StiffnessCurves:
    """Quasi-static mesh of one pair.

    Per contact position (from A, base pitches): stiffness of a single pair that carries the whole
    load, sound and (where a tooth is faulty) faulty, how much later the faulty one touches, and
    the compliance terms by gear. The faulty pair is that of the first faulty tooth of either
    gear. Per roll angle of the faulted gear (pinion when sound): mesh stiffness as the tangent
    dF/d(approach) under the set torque. SI units, angles in rad.
    """

    contact_position: Array
    single_pair_stiffness: Array
    faulty_pair_stiffness: Array | None
    faulty_pair_gap: Array | None
    compliance: dict[str, dict[str, Array]]
    roll_angle: Array
    mesh_stiffness: Array
    load_share: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class SinglePair:
    """One pair under the whole load.

    Compliance terms by gear in m/N, gap in m, 1 where it has flank to touch.
    """

    terms: dict[str, dict[str, Array]]
    gap: Array
    touches: Array

    @property
    def stiffness(self) -> Array:
        """Force over deflection from first touch, 0 where nothing touches, (phase,) N/m."""
        return self.touches / np.sum(
            [values for gear in self.terms.values() for values in gear.values()], axis=0
        )


def stiffness_curves(
    machine: LoadedMesh,
    table: PairTable,
    faults: Sequence[Fault],
    whole: Mapping[str, Tooth],
    *,
    n_positions: int,
    points_per_tooth: int,
) -> StiffnessCurves:
    """Single-pair and mesh stiffness with their parts; contact ratios below 1 are allowed,
    nothing need turn.

    ``whole`` are the sound teeth by gear, as designed.
    """
    pair = machine.pair
    position = np.linspace(0.0, pair.path_of_contact, n_positions)
    sound, faulty = (
        single_pair(machine, position, some, whole) for some in ((), faults)
    )
    gear = pair.gears[faults[0].gear] if faults else pair.pinion
    roll = (
        pair.base_pitch
        * (np.arange(gear.n_teeth * points_per_tooth) + 0.5)
        / points_per_tooth
    )
    static = static_mesh(table, pair_states(table, roll), machine.mesh_force)
    return StiffnessCurves(
        contact_position=position / pair.base_pitch,
        single_pair_stiffness=sound.stiffness,
        faulty_pair_stiffness=faulty.stiffness if faults else None,
        faulty_pair_gap=faulty.gap if faults else None,
        compliance=faulty.terms,
        roll_angle=roll / gear.base_radius,
        mesh_stiffness=static.stiffness,
        load_share=static.load
        / np.maximum(static.load.sum(axis=1, keepdims=True), 1e-30),
    )


def single_pair(
    machine: LoadedMesh,
    position: Array,
    faults: Sequence[Fault],
    whole: Mapping[str, Tooth],
) -> SinglePair:
    """The pair of each gear's first faulty tooth, sound where there is none, under the whole load.

    Half of the contact term of sound flanks belongs to either gear, what a fault adds to it to
    the faulty one.
    """
    odd = faulty_teeth(machine.pair, faults, whole)
    structure = machine.material.in_plane(machine.mesh.elasticity)
    sides = flank_sides(
        machine.pair,
        position,
        machine.material,
        machine.mesh,
        machine.mesh_force,
        pinion_share=0.5,
    )
    bending = slice_bending(machine.pair, position, machine.material, machine.mesh)
    terms, gap, touches = {}, np.zeros_like(position), np.ones_like(position)
    for name, side in sides.items():
        mine = {number: tooth for (gear, number), tooth in odd.items() if gear == name}
        named = [
            fault.first_tooth
            for fault in faults
            if fault.gear == name and fault.first_tooth in mine
        ]
        tooth = mine[named[0] if named else min(mine)] if mine else whole[name]
        tip = tooth.tip_curvature_radius
        own_gap, contact = side.contact(tooth, bending, machine.mesh)
        curvature = np.minimum(side.curvature, tip)
        terms[name] = {
            **structural_terms(tooth, curvature, structure, machine.mesh),
            "contact": contact,
        }
        gap += own_gap
        touches[(side.curvature > tip + 1e-12) | (not tooth.present)] = 0.0
    return SinglePair(terms=terms, gap=gap, touches=touches)
