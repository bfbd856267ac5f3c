"""A helical gear pair on its bearings: slices of its flanks, and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import final

from gensig.dynamics.backends.base import MOST_PAIRS
from gensig.dynamics.helical import AXIAL_DOFS
from gensig.dynamics.pair import PAIR_DOFS
from gensig.errors import ConfigError, GeometryError
from gensig.faults.base import Fault
from gensig.mesh.tooth_table import ToothTable
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.sliced_pair import SlicedPair
from gensig.systems.stiffness_curves import StiffnessCurves


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class HelicalPair(GearPairMachine):
    """A machine whose teeth are cut into slices.

    Without a helix it is a spur pair that also moves along its axes. ``flanks`` is the same pair
    at rest, for transmission error, load over the flanks and stiffness.
    """

    flanks: SlicedPair = field()

    @property
    def has_whole_teeth(self) -> bool:
        """False, without a helix too."""
        return False

    @property
    def gear_channels(self) -> tuple[str, ...]:
        """Motions of both gears, also along their axes, and tilts."""
        return (*PAIR_DOFS, *AXIAL_DOFS)

    def mesh_table(self, faults: Sequence[Fault] = ()) -> ToothTable:
        """Force over phase and approach of every distinct pair of teeth, with the given faults."""
        return self.flanks.mesh_table(faults)

    def stiffness_curves(
        self,
        faults: Sequence[Fault] = (),
        *,
        n_positions: int = 201,
        points_per_tooth: int = 100,
    ) -> StiffnessCurves:
        """Raise ConfigError: these curves are of whole teeth, and a helical pair has slices."""
        raise ConfigError(
            "stiffness_curves are those of system=spur_pair; a helical pair has its stiffness "
            "slice by slice: flanks.transmission_error(), or gensig stiffness system=helical_pair"
        )

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth that may be followed at once."""
        return MOST_PAIRS

    def require_drive(self) -> None:
        """Raise unless at least one pair is always in contact, by the overlap of the face too."""
        if self.flanks.slices.slices_in_phase:
            raise ConfigError(
                "mesh.slices_in_phase = true is for comparing statics; records have the helix in: "
                "take false"
            )
        if self.pair.total_contact_ratio < 1.0:
            raise GeometryError(
                f"the total contact ratio {self.pair.total_contact_ratio:.4f} is below 1, so the "
                "drive is interrupted at every tooth; use more teeth, a wider face, a larger helix "
                "angle or a larger addendum_coefficient"
            )
