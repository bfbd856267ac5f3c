"""A spur gear pair on its bearings: from configuration to stiffness curves and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import final

import numpy as np

from gensig.dynamics.pair import PAIR_DOFS
from gensig.errors import GeometryError
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.modification import (
    PLAIN,
    FlankModification,
    PairModification,
    sound_teeth,
)
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import N_PAIRS, PairTable
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.stiffness_curves import (
    StiffnessCurves,
    single_pair,
    stiffness_curves,
)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SpurPair(GearPairMachine):
    """A spur gear pair; ``modification`` is that of all teeth, before errors and faults."""

    modification: PairModification = PLAIN

    @property
    def gear_channels(self) -> tuple[str, ...]:
        """Both gears move across and along the line of action and turn."""
        return PAIR_DOFS

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth that the table covers at once."""
        return N_PAIRS

    def require_drive(self) -> None:
        """Raise GeometryError unless at least one pair of teeth is always in contact."""
        self.pair.require_continuous_drive()

    def mesh_table(self, faults: Sequence[Fault] = ()) -> PairTable:
        """Compliance and gap tables with the given faults."""
        return _mesh_table(
            self.pair,
            self.material,
            self.mesh,
            tuple(faults),
            self.mesh_force,
            self.modification,
        )

    def stiffness_curves(
        self,
        faults: Sequence[Fault] = (),
        *,
        n_positions: int = 201,
        points_per_tooth: int = 100,
    ) -> StiffnessCurves:
        """Single-pair and mesh stiffness with their parts.

        Contact ratios below 1 are allowed, nothing need turn.
        """
        table, whole = (
            self.mesh_table(faults),
            sound_teeth(self.pair, self.modification),
        )
        return stiffness_curves(
            self,
            table,
            faults,
            whole,
            n_positions=n_positions,
            points_per_tooth=points_per_tooth,
        )

    def long_relief(self) -> PairModification:
        """Linear tip reliefs that make up for the deflection under the set torque, of teeth as cut.

        From the tips down to where a pair begins to carry alone (point B of the wheel, D of the
        pinion), as deep as the pair deflects there less the body's part, which the next pair
        shares.

        Raises
        ------
        GeometryError    for a contact ratio outside 1..2: no pair, or none but one, ever carries alone

        Source: Welbourn's rule as in Lin, Oswald & Townsend (1989), see
        ``docs/theory/spur_mesh.md``; the shared part is ours.
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
        sound = single_pair(plain, alone, (), sound_teeth(pair, PLAIN))
        depth = self.mesh_force * (1.0 / sound.stiffness - shared)
        starts = (
            (pair.pinion, pair.pinion_curvature(alone[0])),
            (pair.wheel, pair.wheel_curvature(alone[1])),
        )
        pinion, wheel = (
            FlankModification(
                tip_relief=float(back),
                tip_relief_height=gear.tip_radius
                - float(np.hypot(gear.base_radius, curvature)),
            )
            for (gear, curvature), back in zip(starts, depth, strict=True)
        )
        return PairModification(pinion=pinion, wheel=wheel)


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
    return loaded_pair_table(
        pair, material, mesh, teeth, force=force, modification=modification
    )
