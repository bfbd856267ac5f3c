"""A spur gear pair on its bearings: from configuration to stiffness curves and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.errors import GeometryError
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table, pair_states, static_mesh
from gensig.mesh.modification import PLAIN, FlankModification, PairModification, sound_teeth
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import PairTable, flank_sides, slice_bending, structural_terms
from gensig.systems.pair_machine import PairMachine

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class StiffnessCurves:
    """Quasi-static mesh of one pair.

    Per contact position (from A, base pitches): stiffness of a single pair that carries the whole load, sound and
    (where a tooth is faulty) faulty, how much later the faulty one touches, and the compliance terms by gear. The
    faulty pair is that of the first faulty tooth of either gear. Per roll angle of the faulted gear (pinion when
    sound): mesh stiffness as the tangent dF/d(approach) under the set torque. SI units, angles in rad.
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
class _SinglePair:
    """One pair under the whole load: compliance terms by gear in m/N, gap in m, 1 where it has flank to touch."""

    terms: dict[str, dict[str, Array]]
    gap: Array
    touches: Array

    @property
    def stiffness(self) -> Array:
        """Force over deflection from first touch, 0 where nothing touches, (phase,) N/m."""
        return self.touches / np.sum([values for gear in self.terms.values() for values in gear.values()], axis=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SpurPair(PairMachine):
    """One machine under one set of conventions; ``modification`` is of all teeth, before errors and faults."""

    modification: PairModification = PLAIN

    def mesh_table(self, faults: Sequence[Fault] = ()) -> PairTable:
        """Compliance and gap tables with the given faults."""
        return _mesh_table(self.pair, self.material, self.mesh, tuple(faults), self.mesh_force, self.modification)

    def stiffness_curves(
        self, faults: Sequence[Fault] = (), *, n_positions: int = 201, points_per_tooth: int = 100
    ) -> StiffnessCurves:
        """Single-pair and mesh stiffness with their parts; contact ratios below 1 are allowed, nothing need turn."""
        pair = self.pair
        table = self.mesh_table(faults)
        position = np.linspace(0.0, pair.path_of_contact, n_positions)
        sound, faulty = self._single_pair(position, ()), self._single_pair(position, faults)
        gear = pair.wheel if faults and faults[0].gear == "wheel" else pair.pinion
        roll = pair.base_pitch * (np.arange(gear.n_teeth * points_per_tooth) + 0.5) / points_per_tooth
        static = static_mesh(table, pair_states(table, roll), self.mesh_force)
        return StiffnessCurves(
            contact_position=position / pair.base_pitch,
            single_pair_stiffness=sound.stiffness,
            faulty_pair_stiffness=faulty.stiffness if faults else None,
            faulty_pair_gap=faulty.gap if faults else None,
            compliance=faulty.terms,
            roll_angle=roll / gear.base_radius,
            mesh_stiffness=static.stiffness,
            load_share=static.load / np.maximum(static.load.sum(axis=1, keepdims=True), 1e-30),
        )

    def long_relief(self) -> PairModification:
        """Linear tip reliefs that make up for the deflection under the set torque, of teeth as cut.

        From the tips down to where a pair begins to carry alone (point B of the wheel, D of the pinion), as deep as
        the pair deflects there less the body's part, which the next pair shares.

        Raises
        ------
        GeometryError    for a contact ratio outside 1..2: no pair, or none but one, ever carries alone

        Source: Welbourn's rule as in Lin, Oswald & Townsend (1989), see ``docs/theory/spur_mesh.md``; the shared part
        is ours.
        """
        pair = self.pair
        if not 1.0 <= pair.transverse_contact_ratio < 2.0:
            raise GeometryError(
                f"the transverse contact ratio {pair.transverse_contact_ratio:.4f} lies outside 1..2, where a pair "
                f"carries alone for a while: that is where these reliefs begin"
            )
        alone = np.array([pair.base_pitch, pair.path_of_contact - pair.base_pitch])
        plain = replace(self, modification=PLAIN)
        shared = plain.mesh_table().shared_compliance
        depth = self.mesh_force * (1.0 / plain._single_pair(alone, ()).stiffness - shared)
        starts = (pair.pinion, pair.pinion_curvature(alone[0])), (pair.wheel, pair.wheel_curvature(alone[1]))
        sides = {
            gear.name: FlankModification(
                tip_relief=float(back),
                tip_relief_height=gear.tip_radius - float(np.hypot(gear.base_radius, curvature)),
            )
            for (gear, curvature), back in zip(starts, depth, strict=True)
        }
        return PairModification(pinion=sides["pinion"], wheel=sides["wheel"])

    def _single_pair(self, position: Array, faults: Sequence[Fault]) -> _SinglePair:
        """The pair of each gear's first faulty tooth, sound where there is none, under the whole load.

        Half of the contact term of sound flanks belongs to either gear, what a fault adds to it to the faulty one.
        """
        whole = sound_teeth(self.pair, self.modification)
        odd = faulty_teeth(self.pair, faults, whole)
        structure = self.material.in_plane(self.mesh.elasticity)
        sides = flank_sides(self.pair, position, self.material, self.mesh, self.mesh_force, pinion_share=0.5)
        bending = slice_bending(self.pair, position, self.material, self.mesh)
        terms, gap, touches = {}, np.zeros_like(position), np.ones_like(position)
        for name, side in sides.items():
            mine = {number: tooth for (gear, number), tooth in odd.items() if gear == name}
            named = [fault.first_tooth for fault in faults if fault.gear == name and fault.first_tooth in mine]
            tooth = mine[named[0] if named else min(mine)] if mine else whole[name]
            tip = tooth.tip_curvature_radius
            own_gap, contact = side.contact(tooth, bending, self.mesh)
            curvature = np.minimum(side.curvature, tip)
            terms[name] = {**structural_terms(tooth, curvature, structure, self.mesh), "contact": contact}
            gap += own_gap
            touches[(side.curvature > tip + 1e-12) | (not tooth.present)] = 0.0
        return _SinglePair(terms=terms, gap=gap, touches=touches)


@lru_cache(maxsize=32)
def _mesh_table(
    pair: GearPair,
    material: Material,
    mesh: MeshOptions,
    faults: tuple[Fault, ...],
    force: float,
    modification: PairModification,
) -> PairTable:
    teeth = faulty_teeth(pair, faults, sound_teeth(pair, modification))
    return loaded_pair_table(pair, material, mesh, teeth, force=force, modification=modification)
