"""Loaded mesh with worn flanks: the worn depth opens the gaps, and the loads follow.

Rolls, positions and interpolations are prepared once: a life asks for the same phases some
hundred times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array, Integers
from gensig.errors import GeometryError, SimulationError
from gensig.life.wear.archard import FlankPath
from gensig.mesh.sliced.slices import (
    ContactPhases,
    LoadedContact,
    SlicedMesh,
    contact_phases,
    settled_contact,
)

# of a mesh in several slices, whose slices pass the nodes at other phases than these
PHASES_PER_PITCH = 24


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WornContact:
    """Phases of a mesh with new flanks, and position of its slices among the nodes of the path.

    Parameters
    ----------
    node, share : (phase, pair, slice)    node before the contact, and share of the way to the next
    """

    phases: ContactPhases
    node: Integers
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
        before, after = back[row, self.node], back[row, self.node + 1]
        worn = (1.0 - self.share) * before + self.share * after
        phases = replace(self.phases, gap=self.phases.gap + worn)
        try:
            return settled_contact(phases, force)
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
    nodes = path.position
    at = np.clip(phases.position, nodes[0], nodes[-1])
    node = np.searchsorted(nodes, at, side="right") - 1
    node = np.clip(node, 0, len(nodes) - 2)
    share = (at - nodes[node]) / (nodes[node + 1] - nodes[node])
    return WornContact(phases=phases, node=node, share=share)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathLoads:
    """Loads of the phases, read at the nodes of the path.

    Parameters
    ----------
    before, after : (slice, node)    indices in a flat (phase, pair, slice), in order
    share : (slice, node)            share of the way from the one to the other
    """

    contact: WornContact
    before: Integers
    after: Integers
    share: Array

    def line_load(self, depth: Array, force: float) -> Array:
        """Load of each node of the flanks as it meshes, (slice, node) N/m.

        (2, slice, node) m is worn off.
        """
        load = self.contact.settled(depth, force).line_load.ravel()
        return (1.0 - self.share) * load[self.before] + self.share * load[self.after]


def path_loads(mesh: SlicedMesh, path: FlankPath) -> PathLoads:
    """Prepare the loads along the path.

    Phases at the nodes themselves for one slice, else equally spaced.
    """
    n_slices, nodes = len(mesh.slice_middle), path.position
    roll = nodes
    if n_slices > 1:
        roll = (
            mesh.pair.base_pitch
            * (np.arange(PHASES_PER_PITCH) + 0.5)
            / PHASES_PER_PITCH
        )
    contact = worn_contact(mesh, path, roll)
    before, after = np.empty((2, n_slices, len(nodes)), dtype=np.int64)
    share = np.empty(before.shape)
    for j in range(n_slices):
        at = contact.phases.position[..., j].ravel()
        order = np.argsort(at, kind="stable")
        if mesh.options.law == "paper":  # no contact beyond the path, and a step there
            on_path = (at[order] >= 0.0) & (at[order] <= mesh.pair.path_of_contact)
            order = order[on_path]
        right = np.clip(np.searchsorted(at[order], nodes), 1, len(order) - 1)
        low, high = order[right - 1], order[right]
        width = np.maximum(at[high] - at[low], 1e-15)
        share[j] = np.clip((nodes - at[low]) / width, 0.0, 1.0)
        before[j], after[j] = low * n_slices + j, high * n_slices + j
    return PathLoads(contact=contact, before=before, after=after, share=share)
