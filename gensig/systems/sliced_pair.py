"""A spur or helical pair at rest: loaded flanks over one mesh period, slice by slice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.load_distribution import Meeting
from gensig.mesh.modification import PairModification
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import node_positions
from gensig.mesh.sliced.component_sum import (
    component_compliances,
    component_mesh_stiffness,
    component_pair_stiffness,
)
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.sliced_table import sliced_table
from gensig.mesh.sliced.slices import (
    LoadedContact,
    SlicedMesh,
    loaded_contact,
    single_pair_stiffness,
    slice_middles,
    sliced_mesh,
)
from gensig.mesh.thermal.paper_growth import PaperGrowth
from gensig.mesh.thermal.thermal_growth import PairGrowth
from gensig.mesh.tooth_table import ToothTable

N_PHASES = 64  # per mesh period
N_HARMONICS = 10
SOUND_PERIODS = 2  # shown on either side of a fault


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransmissionError:
    """Static transmission error under load, loads and pressures.

    Over one mesh period, or over all periods in which a fault is in contact.

    Parameters
    ----------
    contact : LoadedContact          64 phases a period, equally spaced; the first faulty teeth
        enter at roll 0
    n_periods : mesh periods
    odd_pairs : numbers of the first and the last pair with a tooth unlike the others, or None
    slice_edges : (slice + 1,) m     from the end that enters first
    slice_middle : (slice,) m
    error : (phase,) m               approach along the transverse line of action
    harmonics : (order,) m           amplitudes of mesh orders 1, 2, ...
    pressure : (phase, pair, slice) Pa
    load_share : (phase, pair)
    bearing : share of the field of action that carries load, mean over the phases
    """

    contact: LoadedContact
    n_periods: int
    odd_pairs: tuple[int, int] | None
    slice_edges: Array
    slice_middle: Array
    error: Array
    harmonics: Array
    pressure: Array
    load_share: Array
    bearing: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SlicedPair:
    """A gear pair with healthy teeth, its flank modification, and the pinion's torque in N m.

    ``growth`` is the deviation of flanks by heat, beyond the growth of the pair as a whole, see
    ``gensig.systems.hot_pair``. ``hot_teeth`` is the growth of teeth by ``mesh.heat_law=paper``.
    """

    pair: GearPair
    material: Material
    mesh: MeshOptions
    slices: SliceOptions
    modification: PairModification
    torque: float
    growth: PairGrowth | None = None
    hot_teeth: PaperGrowth | None = None

    @property
    def mesh_force(self) -> float:
        """Total force along the transverse line of action, N."""
        return self.torque / self.pair.pinion.base_radius

    def sliced_mesh(self, faults: Sequence[Fault] = ()) -> SlicedMesh:
        """The pair cut into slices, modified flanks and faulty teeth included."""
        options = self.material, self.mesh, self.slices
        deviation, teeth = self.deviation(), faulty_teeth(self.pair, faults)
        return sliced_mesh(
            self.pair,
            *options,
            deviation=deviation,
            teeth=teeth,
            hot_teeth=self.hot_teeth,
        )

    def deviation(self) -> Array | None:
        """Recess of all flanks at the table's positions, (slice, node) m; None for perfect ones."""
        if not self.modification.is_any and self.growth is None:
            return None
        position = node_positions(self.pair, self.mesh)
        middles = slice_middles(self.pair, self.slices)
        back = np.zeros((len(middles), len(position)))
        if self.modification.is_any:
            back = back + self.modification.deviation(self.pair, position, middles)
        if self.growth is not None:
            back = back + self.growth.deviation(self.pair, position)
        return back

    def mesh_table(self, faults: Sequence[Fault] = ()) -> ToothTable:
        """Chord table of the mesh with the given faults."""
        return _mesh_table(self, tuple(faults))

    def phases(
        self, n_phases: int = N_PHASES, *, first_period: int = 0, n_periods: int = 1
    ) -> Array:
        """Rolls of equally spaced phases of mesh periods, (phase,) m; ``n_phases`` to each."""
        shares = (np.arange(n_periods * n_phases) + 0.5) / n_phases
        return self.pair.base_pitch * (first_period + shares)

    def transmission_error(
        self, faults: Sequence[Fault] = (), *, n_phases: int = N_PHASES
    ) -> TransmissionError:
        """Loaded contact over one mesh period.

        With faults, over all periods in which one is in contact, and two healthy ones on either
        side. The first faulty tooth of either gear meets that of the other, or a healthy one.

        Raises
        ------
        ConfigError, GeometryError    for a torque that does not drive, or flanks out of contact
        """
        mesh = self.sliced_mesh(faults)
        first_period, n_periods, meeting, odd_pairs = _seen(mesh)
        roll = self.phases(n_phases, first_period=first_period, n_periods=n_periods)
        contact = loaded_contact(mesh, roll, self.mesh_force, meeting)
        load = (contact.line_load * mesh.slice_width).sum(axis=2)
        position = contact.position
        on_path = (position >= 0.0) & (position <= self.pair.path_of_contact)
        loaded = on_path & (contact.line_load > 0.0)
        bearing = (mesh.slice_width * loaded).sum() / (mesh.slice_width * on_path).sum()
        spectrum = 2.0 * np.abs(np.fft.rfft(contact.approach)) / len(roll)
        return TransmissionError(
            contact=contact,
            n_periods=n_periods,
            odd_pairs=odd_pairs,
            slice_edges=mesh.edges,
            slice_middle=mesh.slice_middle,
            error=contact.approach,
            harmonics=spectrum[n_periods::n_periods][:N_HARMONICS],
            pressure=contact_pressure(mesh, contact, self.material),
            load_share=load / load.sum(axis=1, keepdims=True),
            bearing=float(bearing),
        )

    def pressure_error(self, result: TransmissionError) -> float:
        """Estimated relative error of the largest pressure of healthy flanks by the slices' width.

        Twice the change from half as many slices. On unmodified flanks the largest pressure is at
        the corners of the face, where it grows with about the power 0.75 of the number of slices;
        the rest of the way is then 1.5 times that change. NaN for a single slice.
        """
        half = self.slices.n_slices // 2
        if half < 1:
            return float("nan")
        coarse = replace(self, slices=replace(self.slices, n_slices=half))
        pressure = float(result.pressure.max())
        other = float(coarse.transmission_error().pressure.max())
        return 2.0 * abs(pressure - other) / pressure

    def single_pair(self, n_positions: int = 401) -> tuple[Array, Array]:
        """Positions s of the first slice in m, and stiffness of one pair there, N/m.

        From the first touch of the pair to its last.
        """
        mesh = self.sliced_mesh()
        last = self.pair.path_of_contact + float(mesh.lag.max())
        position = np.linspace(0.0, last, n_positions)
        return position, single_pair_stiffness(mesh, position, self.mesh_force)

    def component_sums(self, n_positions: int = 401) -> tuple[Array, Array]:
        """Stiffness by the literal eq. (14) of the thermal paper, pairs added up.

        Returns
        -------
        (phase,), (position,) N/m    of the mesh, 64 phases a period, and of one pair at the
            positions of ``single_pair``
        """
        mesh = self.sliced_mesh()
        components = component_compliances(mesh, self.material, self.hot_teeth)
        at = mesh, components
        last = self.pair.path_of_contact + float(mesh.lag.max())
        position = np.linspace(0.0, last, n_positions)
        return (
            component_mesh_stiffness(*at, self.phases(), self.mesh_force),
            component_pair_stiffness(*at, position, self.mesh_force),
        )

    def faulty_pair(self, faults: Sequence[Fault], position: Array) -> Array:
        """Stiffness of the pair of the first faulty teeth at given positions, (phase,) N/m.

        Of the slices that the set torque brings into contact.
        """
        mesh, force = self.sliced_mesh(faults), self.mesh_force
        sound = loaded_contact(self.sliced_mesh(), self.phases(), force)
        pinion, wheel = (
            int(next((kind for kind in side.kind if kind > 0), 0))
            for side in (mesh.pinion, mesh.wheel)
        )
        closed = float(sound.approach.mean()) - mesh.shared_compliance * force
        return single_pair_stiffness(mesh, position, force, (pinion, wheel), closed)


def _seen(mesh: SlicedMesh) -> tuple[int, int, Meeting, tuple[int, int] | None]:
    """First mesh period, number of periods, meeting teeth, and odd pairs."""
    start, span, turn = [0, 0], -1, 0
    for gear, side in enumerate((mesh.pinion, mesh.wheel)):
        count = np.bincount(side.kind)
        odd = np.flatnonzero(side.kind != count.argmax())
        if len(odd):
            start[gear], span = int(odd[0]), max(span, int(odd[-1] - odd[0]))
            turn = max(turn, len(side.kind))
    meeting = Meeting(start_teeth=(start[0], start[1]))
    if span < 0:
        return 0, 1, meeting, None
    n_periods = math.ceil(mesh.pair.total_contact_ratio) + span + 2 * SOUND_PERIODS
    if n_periods >= turn:
        return 0, turn, meeting, (0, span)
    return -SOUND_PERIODS, n_periods, meeting, (0, span)


@lru_cache(maxsize=32)
def _mesh_table(system: SlicedPair, faults: tuple[Fault, ...]) -> ToothTable:
    return sliced_table(
        system.pair,
        system.material,
        system.mesh,
        system.slices,
        faulty_teeth(system.pair, faults),
        force=system.mesh_force,
        deviation=system.deviation(),
        hot_teeth=system.hot_teeth,
    )
