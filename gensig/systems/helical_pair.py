"""A helical gear pair on its bearings: the slices of its flanks, its records, and both from one configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gensig.dynamics._layout import MOST_PAIRS
from gensig.errors import ConfigError, GeometryError
from gensig.faults.base import Fault
from gensig.mesh.sliced.sliced_table import SlicedTable
from gensig.systems.pair_machine import PairMachine
from gensig.systems.sliced_pair import SlicedPair


@dataclass(frozen=True, slots=True, kw_only=True)
class HelicalPair(PairMachine):
    """One machine whose teeth are cut into slices; with no helix it is a spur pair that also moves along its axes.

    ``flanks`` is the same pair at rest, for its transmission error, load over the flanks and stiffness.
    """

    flanks: SlicedPair

    def mesh_table(self, faults: Sequence[Fault] = ()) -> SlicedTable:
        """Force over phase and approach of every distinct pair of teeth, with the given faults."""
        return self.flanks.mesh_table(faults)

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth that may be followed at once; how many are depends on the load."""
        return MOST_PAIRS

    def require_drive(self) -> None:
        """Raise unless at least one pair is always in contact, by the overlap of the face too."""
        if self.flanks.slices.slices_in_phase:
            raise ConfigError(
                "mesh.slices_in_phase = true is for comparing statics; records have the helix in: take false"
            )
        if self.pair.total_contact_ratio < 1.0:
            raise GeometryError(
                f"the total contact ratio {self.pair.total_contact_ratio:.4f} is below 1, so the drive is interrupted "
                f"at every tooth; use more teeth, a wider face, a larger helix angle or a larger addendum_coefficient"
            )
