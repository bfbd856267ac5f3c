"""A spur or helical pair at rest: what its loaded flanks do over one mesh period, slice by slice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.modification import PairModification
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import node_positions
from gensig.mesh.slices import (
    LoadedContact,
    SlicedMesh,
    contact_pressure,
    loaded_contact,
    single_pair_stiffness,
    slice_places,
    sliced_mesh,
)
from gensig.mesh.thermal_growth import PairGrowth

Array = NDArray[np.float64]

N_PHASES = 64
N_HARMONICS = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransmissionError:
    """Static transmission error under load and what goes with it, over one mesh period.

    Parameters
    ----------
    contact : LoadedContact          64 phases, equally spaced
    slice_place : (slice,) m         from the end that enters first
    error : (phase,) m               approach along the transverse line of action
    harmonics : (order,) m           amplitudes of mesh orders 1, 2, ...
    pressure : (phase, pair, slice) Pa
    load_share : (phase, pair)
    bearing : share of the field of action that carries load, mean over the phases
    """

    contact: LoadedContact
    slice_place: Array
    error: Array
    harmonics: Array
    pressure: Array
    load_share: Array
    bearing: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SlicedPair:
    """A gear pair with sound teeth, its flank modification, and the pinion's torque in N m.

    ``growth`` is what heat does to flanks beyond growing the pair as a whole, see ``gensig.systems.hot_pair``.
    """

    pair: GearPair
    material: Material
    mesh: MeshOptions
    slices: SliceOptions
    modification: PairModification
    torque: float
    growth: PairGrowth | None = None

    @property
    def mesh_force(self) -> float:
        """Total force along the transverse line of action, N."""
        return self.torque / self.pair.pinion.base_radius

    def sliced_mesh(self) -> SlicedMesh:
        """The pair cut into slices, modified flanks included."""
        deviation = None
        if self.modification.is_any:
            position, place = node_positions(self.pair, self.mesh), slice_places(self.pair, self.slices)
            deviation = self.modification.deviation(self.pair, position, place)
        if self.growth is not None:
            proud = self.growth.deviation(self.pair, node_positions(self.pair, self.mesh))
            deviation = proud + (0.0 if deviation is None else deviation) + np.zeros((self.slices.n_slices, 1))
        return sliced_mesh(self.pair, self.material, self.mesh, self.slices, deviation=deviation)

    def phases(self, n_phases: int = N_PHASES) -> Array:
        """Rolls of equally spaced phases of one mesh period, (phase,) m."""
        return self.pair.base_pitch * (np.arange(n_phases) + 0.5) / n_phases

    def transmission_error(self, *, n_phases: int = N_PHASES) -> TransmissionError:
        """Loaded contact over one mesh period.

        Raises
        ------
        ConfigError, GeometryError    for a torque that does not drive, or flanks that nothing brings into contact
        """
        mesh = self.sliced_mesh()
        contact = loaded_contact(mesh, self.phases(n_phases), self.mesh_force)
        load = contact.line_load.sum(axis=2)
        on_path = (contact.position >= 0.0) & (contact.position <= self.pair.path_of_contact)
        return TransmissionError(
            contact=contact,
            slice_place=mesh.slice_place,
            error=contact.approach,
            harmonics=2.0 * np.abs(np.fft.rfft(contact.approach))[1 : N_HARMONICS + 1] / n_phases,
            pressure=contact_pressure(mesh, contact, self.material),
            load_share=load / load.sum(axis=1, keepdims=True),
            bearing=float((on_path & (contact.line_load > 0.0)).sum() / on_path.sum()),
        )

    def single_pair(self, n_positions: int = 401) -> tuple[Array, Array]:
        """Stiffness of one pair from its first touch to its last: positions s of the first slice in m, and N/m."""
        mesh = self.sliced_mesh()
        position = np.linspace(0.0, self.pair.path_of_contact + float(mesh.lag.max()), n_positions)
        return position, single_pair_stiffness(mesh, position, self.mesh_force)
