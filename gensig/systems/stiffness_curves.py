"""Quasi-static stiffness curves of one mesh of spur teeth, of a pair or a drive line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gensig.arrays import Array
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import Tooth
from gensig.material import Material
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import (
    flank_sides,
    slice_bending,
    structural_terms,
)
from gensig.mesh.tooth_table import ToothTable


class LoadedMesh(Protocol):
    """A mesh under a set torque: geometry, material, mesh options and normal force in N."""

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
    """Quasi-static mesh of one pair. SI units, angles in rad.

    By contact position (from A, base pitches): stiffness of a single pair under the whole load,
    healthy and (with faults) faulty, gap of the faulty pair, and the compliance terms by gear. The
    faulty pair is that of the first faulty tooth of either gear. By roll angle of the faulty gear
    (pinion when healthy): mesh stiffness as the tangent dF/d(approach) under the set torque.
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

    Compliance terms by gear in m/N, gap in m, ``touches`` 1 where both teeth have flanks.
    """

    terms: dict[str, dict[str, Array]]
    gap: Array
    touches: Array

    @property
    def stiffness(self) -> Array:
        """Force over deflection from first touch, 0 where nothing touches, (phase,) N/m."""
        terms = [values for gear in self.terms.values() for values in gear.values()]
        return self.touches / np.sum(terms, axis=0)


def stiffness_curves(
    machine: LoadedMesh,
    table: ToothTable,
    faults: Sequence[Fault],
    whole: Mapping[str, Tooth],
    *,
    n_positions: int,
    points_per_tooth: int,
) -> StiffnessCurves:
    """Single-pair and mesh stiffness with their parts; contact ratios below 1 are allowed.

    ``whole`` are the healthy teeth by gear, as designed.
    """
    pair = machine.pair
    position = np.linspace(0.0, pair.path_of_contact, n_positions)
    sound = single_pair(machine, position, (), whole)
    gear, faulty = pair.pinion, sound
    faulty_stiffness = faulty_gap = None
    if faults:
        gear = pair.gears[faults[0].gear]
        faulty = single_pair(machine, position, faults, whole)
        faulty_stiffness, faulty_gap = faulty.stiffness, faulty.gap
    points = np.arange(gear.n_teeth * points_per_tooth) + 0.5
    roll = pair.base_pitch * points / points_per_tooth
    static = static_mesh(table, pair_states(table, roll), machine.mesh_force)
    total = np.maximum(static.load.sum(axis=1, keepdims=True), 1e-30)
    return StiffnessCurves(
        contact_position=position / pair.base_pitch,
        single_pair_stiffness=sound.stiffness,
        faulty_pair_stiffness=faulty_stiffness,
        faulty_pair_gap=faulty_gap,
        compliance=faulty.terms,
        roll_angle=roll / gear.base_radius,
        mesh_stiffness=static.stiffness,
        load_share=static.load / total,
    )


def single_pair(
    machine: LoadedMesh,
    position: Array,
    faults: Sequence[Fault],
    whole: Mapping[str, Tooth],
) -> SinglePair:
    """The pair of each gear's first changed tooth, or of a healthy one, under the whole load.

    Half of the contact term of healthy flanks belongs to either gear. An increase by a fault
    belongs to the faulty gear.
    """
    pair, material, mesh = machine.pair, machine.material, machine.mesh
    odd = faulty_teeth(pair, faults, whole)
    structure = material.in_plane(mesh.elasticity)
    force = machine.mesh_force
    sides = flank_sides(pair, position, material, mesh, force, pinion_share=0.5)
    bending = slice_bending(pair, position, material, mesh)
    terms, gap, touches = {}, np.zeros_like(position), np.ones_like(position)
    for name, side in sides.items():
        mine = {
            number: tooth
            for (gear, number), tooth in odd.items()
            if gear == name and tooth is not whole[name]
        }
        firsts = [fault.first_tooth for fault in faults if fault.gear == name]
        named = [number for number in firsts if number in mine]
        tooth = whole[name]
        if mine:
            tooth = mine[(named or sorted(mine))[0]]
        tip = tooth.tip_curvature_radius
        tooth_gap, contact = side.contact(tooth, bending, mesh)
        curvature = np.minimum(side.curvature, tip)
        structural = structural_terms(tooth, curvature, structure, mesh)
        terms[name] = {**structural, "contact": contact}
        gap += tooth_gap
        touches[(side.curvature > tip + 1e-12) | (not tooth.present)] = 0.0
    return SinglePair(terms=terms, gap=gap, touches=touches)
