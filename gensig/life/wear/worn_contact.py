"""The loaded mesh with worn flanks: what is worn off opens the gaps, and the load of each place
of the flanks follows.

Rolls, positions and interpolations are prepared once: a life asks for the same phases some
hundred times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import GeometryError, SimulationError
from gensig.life.wear.archard import FlankPath
from gensig.mesh.sliced.slices import (
    ContactPhases,
    LoadedContact,
    SlicedMesh,
    contact_phases,
    settled_contact,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# of a mesh in several slices, whose slices pass the nodes at other phases than these
PHASES_PER_PITCH = 24


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WornContact:
    """Phases of a mesh with new flanks, and where each of its slices lies among the nodes of the
    path.

    Parameters
    ----------
    node, share : (phase, pair, slice)    node before the contact, and how far on to the next
    """

    phases: ContactPhases
    node: Indices
    share: Array

    def settled(self, depth: Array, force: float) -> LoadedContact:
        """Loaded contact when (2, slice, node) m is worn off, under a force in N.

        Along the transverse line of action the gap is the depth normal to the flank over
        cos(beta_b). Beyond A and E, where a tip's corner bears, the nearest end counts.

        Raises
        ------
        SimulationError    where no contact settles on worn flanks
        """
        if not depth.any():
            return settled_contact(self.phases, force)
        back = depth.sum(axis=0) / math.cos(self.phases.mesh.pair.base_helix_angle)
        row = np.arange(len(back))
        worn = (1.0 - self.share) * back[row, self.node] + self.share * back[
            row, self.node + 1
        ]
        try:
            return settled_contact(
                replace(self.phases, gap=self.phases.gap + worn), force
            )
        except GeometryError:
            raise SimulationError(
                f"worn {depth.max() * 1e6:.3g} um deep, the flanks find no settled contact: what "
                "is left at the pitch "
                "point carries all of the load; give a smaller wear.threshold_um or fewer "
                "mesh.n_slices"
            ) from None


def worn_contact(mesh: SlicedMesh, path: FlankPath, roll: Array) -> WornContact:
    """Prepare a mesh with new flanks at rolls, (phase,) m."""
    phases = contact_phases(mesh, roll)
    place = np.clip(phases.position, path.position[0], path.position[-1])
    node = np.clip(
        np.searchsorted(path.position, place, side="right") - 1,
        0,
        len(path.position) - 2,
    )
    share = (place - path.position[node]) / (
        path.position[node + 1] - path.position[node]
    )
    return WornContact(phases=phases, node=node, share=share)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathLoads:
    """Loads of the phases, read at the nodes of the path: at ``before`` and ``after`` of all of
    them, in order.

    Parameters
    ----------
    before, after : (slice, node)    places in a flat (phase, pair, slice)
    share : (slice, node)            how far on from the one to the other
    """

    contact: WornContact
    before: Indices
    after: Indices
    share: Array

    def line_load(self, depth: Array, force: float) -> Array:
        """Load of each place of the flanks as it meshes, (slice, node) N/m, when (2, slice, node)
        m is worn off.
        """
        load = self.contact.settled(depth, force).line_load.ravel()
        return (1.0 - self.share) * load[self.before] + self.share * load[self.after]


def path_loads(mesh: SlicedMesh, path: FlankPath) -> PathLoads:
    """Prepare the loads along the path.

    Phases at the nodes themselves for one slice, else equally spaced.
    """
    n_slices, pitch = len(mesh.slice_place), mesh.pair.base_pitch
    one = n_slices == 1
    roll = (
        path.position
        if one
        else pitch * (np.arange(PHASES_PER_PITCH) + 0.5) / PHASES_PER_PITCH
    )
    contact = worn_contact(mesh, path, roll)
    before, after = np.empty((2, n_slices, len(path.position)), dtype=np.int64)
    share = np.empty(before.shape)
    for j in range(n_slices):
        place = contact.phases.position[..., j].ravel()
        order = np.argsort(place, kind="stable")
        if mesh.options.law == "paper":  # no contact beyond the path, and a step there
            order = order[
                (place[order] >= 0.0) & (place[order] <= mesh.pair.path_of_contact)
            ]
        right = np.clip(np.searchsorted(place[order], path.position), 1, len(order) - 1)
        low, high = order[right - 1], order[right]
        share[j] = np.clip(
            (path.position - place[low]) / np.maximum(place[high] - place[low], 1e-15),
            0.0,
            1.0,
        )
        before[j], after[j] = low * n_slices + j, high * n_slices + j
    return PathLoads(contact=contact, before=before, after=after, share=share)
