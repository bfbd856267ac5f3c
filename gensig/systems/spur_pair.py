"""A spur gear pair on its bearings: from configuration to stiffness curves and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import final

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.pair import PAIR_DOFS
from gensig.errors import GeometryError
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.modification import (
    PLAIN,
    FlankModification,
    PairModification,
    sound_teeth,
)
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import N_PAIRS
from gensig.mesh.tooth_table import ToothTable
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.sliced_pair import SlicedPair
from gensig.systems.stiffness_curves import (
    StiffnessCurves,
    single_pair,
    stiffness_curves,
)

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SpurPair(GearPairMachine):
    """A spur gear pair; ``modification`` is that of all teeth, before errors and faults.

    ``slices`` are those of ``flanks``.
    """

    slices: SliceOptions
    modification: PairModification = PLAIN

    @property
    def flanks(self) -> SlicedPair:
        """As ``Machine.flanks``."""
        return SlicedPair(
            pair=self.pair,
            material=self.material,
            mesh=self.mesh,
            slices=self.slices,
            modification=replace(self.modification, growth=None),
            torque=self.operating.torque,
            growth=self.modification.growth,
        )

    @property
    def has_whole_teeth(self) -> bool:
        """True."""
        return True

    @property
    def gear_channels(self) -> tuple[str, ...]:
        """Motions of both gears across and along the line of action, and rotations."""
        return PAIR_DOFS

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth that are followed at once."""
        return N_PAIRS

    def require_drive(self) -> None:
        """Raise GeometryError unless at least one pair of teeth is always in contact."""
        self.pair.require_continuous_drive()

    def mesh_table(self, faults: Sequence[Fault] = ()) -> ToothTable:
        """Compliance and gap tables with the given faults."""
        machine = self.pair, self.material, self.mesh
        return _mesh_table(*machine, tuple(faults), self.mesh_force, self.modification)

    def stiffness_curves(
        self,
        faults: Sequence[Fault] = (),
        *,
        n_positions: int = 201,
        points_per_tooth: int = 100,
    ) -> StiffnessCurves:
        """Single-pair and mesh stiffness with their parts; contact ratios below 1 are allowed."""
        return stiffness_curves(
            self,
            self.mesh_table(faults),
            faults,
            sound_teeth(self.pair, self.modification),
            n_positions=n_positions,
            points_per_tooth=points_per_tooth,
        )

    def long_relief(self) -> PairModification:
        """Linear tip reliefs that compensate the deflection of unmodified teeth at the set torque.

        From the tips down to the begin of single-pair contact (point B of the wheel, D of the
        pinion), as deep as the deflection of the pair there less the body's part, which the next
        pair shares.

        Raises
        ------
        GeometryError    for a contact ratio outside 1..2: without single-pair contact

        Source: Welbourn's rule as in Lin, Oswald & Townsend (1989), see
        ``docs/theory/spur_mesh.md``; the shared part is ours.
        """
        pair = self.pair
        if not 1.0 <= pair.transverse_contact_ratio < 2.0:
            raise GeometryError(
                f"the transverse contact ratio {pair.transverse_contact_ratio:.4f} lies outside "
                "1..2, where a pair carries alone for a while: that is where these reliefs begin"
            )
        alone = np.array([pair.base_pitch, pair.path_of_contact - pair.base_pitch])
        plain = replace(self, modification=PLAIN)
        shared = plain.mesh_table().shared_compliance
        sound = single_pair(plain, alone, (), sound_teeth(pair, PLAIN))
        depth = self.mesh_force * (1.0 / sound.stiffness - shared)
        pinion_start = pair.pinion_curvature(alone[0])
        wheel_start = pair.wheel_curvature(alone[1])
        return PairModification(
            pinion=_tip_relief(pair.pinion, depth[0], pinion_start),
            wheel=_tip_relief(pair.wheel, depth[1], wheel_start),
        )


def _tip_relief(
    gear: Gear, depth: float, curvature: Array | float
) -> FlankModification:
    """Tip relief from a curvature radius in m up."""
    start_radius = float(np.hypot(gear.base_radius, curvature))
    height = gear.tip_radius - start_radius
    return FlankModification(tip_relief=float(depth), tip_relief_height=height)


@lru_cache(maxsize=32)
def _mesh_table(
    pair: GearPair,
    material: Material,
    mesh: MeshOptions,
    faults: tuple[Fault, ...],
    force: float,
    modification: PairModification,
) -> ToothTable:
    teeth = faulty_teeth(pair, faults, sound_teeth(pair, modification))
    return loaded_pair_table(
        pair, material, mesh, teeth, force=force, modification=modification
    )
