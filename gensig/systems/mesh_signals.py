"""The loads of the teeth as a shard takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.mesh_state import NO_TOOTH, MeshState
from gensig.mesh.pair_table import N_PAIRS


def mesh_signals(mesh: MeshState | None, n_samples: int) -> dict[str, NDArray[Any]]:
    """The mesh state as a shard takes it; of a failed record nothing is known."""
    if mesh is None:
        nobody = np.full((N_PAIRS, n_samples), NO_TOOTH, dtype=np.int16)
        return {
            "mesh_pinion_tooth": nobody,
            "mesh_wheel_tooth": nobody,
            "mesh_load_share": np.full((N_PAIRS, n_samples), np.nan, dtype=np.float32),
            "mesh_force": np.full(n_samples, np.nan, dtype=np.float32),
            "contact_lost": np.zeros(n_samples, dtype=np.int8),
            "fault_engaged": np.zeros(n_samples, dtype=np.int8),
        }
    return {
        "mesh_pinion_tooth": mesh.pinion_tooth,
        "mesh_wheel_tooth": mesh.wheel_tooth,
        "mesh_load_share": mesh.load_share.astype(np.float32),
        "mesh_force": mesh.force.astype(np.float32),
        "contact_lost": mesh.contact_lost.astype(np.int8),
        "fault_engaged": mesh.fault_engaged.astype(np.int8),
    }
