"""The loads of the teeth as a shard takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.mesh_state import NO_TOOTH, MeshState
from gensig.errors import ConfigError


def mesh_signals(
    mesh: MeshState | None, n_samples: int, n_pairs: int
) -> dict[str, NDArray[Any]]:
    """The mesh state as a shard takes it, ``n_pairs`` rows of pairs; of a failed record nothing
    is known.

    Raises
    ------
    ConfigError    for a machine that does not know the loads of its teeth: no pairs
    """
    if n_pairs == 0:
        raise ConfigError(
            "dataset.store_mesh_state: a drive line does not know the loads of its teeth; "
            "take dataset.store_mesh_state=false"
        )
    if mesh is None:
        nobody = np.full((n_pairs, n_samples), NO_TOOTH, dtype=np.int16)
        return {
            "mesh_pinion_tooth": nobody,
            "mesh_wheel_tooth": nobody,
            "mesh_load_share": np.full((n_pairs, n_samples), np.nan, dtype=np.float32),
            "mesh_force": np.full(n_samples, np.nan, dtype=np.float32),
            "contact_lost": np.zeros(n_samples, dtype=np.int8),
            "fault_engaged": np.zeros(n_samples, dtype=np.int8),
        }
    free = ((0, n_pairs - len(mesh.load_share)), (0, 0))
    return {
        "mesh_pinion_tooth": np.pad(mesh.pinion_tooth, free, constant_values=NO_TOOTH),
        "mesh_wheel_tooth": np.pad(mesh.wheel_tooth, free, constant_values=NO_TOOTH),
        "mesh_load_share": np.pad(mesh.load_share.astype(np.float32), free),
        "mesh_force": mesh.force.astype(np.float32),
        "contact_lost": mesh.contact_lost.astype(np.int8),
        "fault_engaged": mesh.fault_engaged.astype(np.int8),
    }
