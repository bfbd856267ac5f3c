"""A spur gear pair on its bearings: from configuration to stiffness curves and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import PairTable
from gensig.systems.pair_machine import PairMachine
from gensig.systems.stiffness_curves import StiffnessCurves, stiffness_curves


@dataclass(frozen=True, slots=True, kw_only=True)
class SpurPair(PairMachine):
    """One machine under one set of conventions."""

    def mesh_table(self, faults: Sequence[Fault] = ()) -> PairTable:
        """Compliance and gap tables with the given faults."""
        return _mesh_table(self.pair, self.material, self.mesh, tuple(faults), self.mesh_force)

    def stiffness_curves(
        self, faults: Sequence[Fault] = (), *, n_positions: int = 201, points_per_tooth: int = 100
    ) -> StiffnessCurves:
        """Single-pair and mesh stiffness with their parts; contact ratios below 1 are allowed, nothing need turn."""
        return stiffness_curves(
            self, self.mesh_table(faults), faults, n_positions=n_positions, points_per_tooth=points_per_tooth
        )


@lru_cache(maxsize=32)
def _mesh_table(
    pair: GearPair, material: Material, mesh: MeshOptions, faults: tuple[Fault, ...], force: float
) -> PairTable:
    return loaded_pair_table(pair, material, mesh, faulty_teeth(pair, faults), force=force)
