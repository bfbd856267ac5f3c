"""Loads of the teeth as signals of a shard."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.mesh_state import NO_TOOTH, MeshState
from gensig.errors import ConfigError


def mesh_signals(
    mesh: MeshState | None, n_samples: int, n_pairs: int
) -> dict[str, NDArray[Any]]:
    """Signals of a mesh state with ``n_pairs`` rows of pairs; without values for a failed record.

    Raises
    ------
    ConfigError    for a machine without loads of its teeth: no pairs
    """
    if n_pairs == 0:
        raise ConfigError(
            "dataset.store_mesh_state: a drive line does not know the loads of its teeth; "
            "take dataset.store_mesh_state=false"
        )
    if mesh is None:
        teeth = np.full((n_pairs, n_samples), NO_TOOTH, dtype=np.int16)
        unknown, no = np.full(n_samples, np.nan), np.zeros(n_samples, dtype=np.bool_)
        mesh = MeshState(
            pinion_tooth=teeth,
            wheel_tooth=teeth,
            load_share=np.full((n_pairs, n_samples), np.nan),
            force=unknown,
            contact_lost=no,
            fault_engaged=no,
        )
    free = ((0, n_pairs - len(mesh.load_share)), (0, 0))
    return {
        "mesh_pinion_tooth": np.pad(mesh.pinion_tooth, free, constant_values=NO_TOOTH),
        "mesh_wheel_tooth": np.pad(mesh.wheel_tooth, free, constant_values=NO_TOOTH),
        "mesh_load_share": np.pad(mesh.load_share.astype(np.float32), free),
        "mesh_force": mesh.force.astype(np.float32),
        "contact_lost": mesh.contact_lost.astype(np.int8),
        "fault_engaged": mesh.fault_engaged.astype(np.int8),
    }
