"""A mesh of a shaft line from the chords of sliced teeth.

Each pair as springs side by side that bear one by one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.line_mesh import LineMesh, tilts_a_pitch
from gensig.driveline.time.mesh_friction import MeshFriction
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]


def sliced_pair_mesh(
    name: str,
    table: SlicedTable,
    *,
    direction: Array,
    roll_dof: int,
    damping: float,
    errors: tuple[Array, Array] | None = None,
    tilts: tuple[Array, Array] | None = None,
    start_teeth: tuple[int, int] = (0, 0),
    start_phase: float = 0.0,
    friction: MeshFriction | None = None,
) -> LineMesh:
    """A helical mesh, or a spur one in slices; gear a is the pinion, ``direction`` that of the
    transverse force.

    ``start_phase`` is that of the slice that enters first, and ``tilts`` (tooth,) m/m are 0 where
    the middle of the face is at the pitch point. What the teeth of a pair have in
    common is that of ``pair_mesh``; the back flanks are those of healthy teeth, whose slices enter
    from the other end.

    The force of a pair is made of chords between fixed depths of bite D_l and is convex, so that
    springs side by side that begin to bear at D_l, each as stiff as its chord is above the one
    before, are the same force. Force, energy and the torque of the passing teeth then come from
    one potential, whatever the depth.
    """
    pair, pitch = table.pair, table.pair.base_pitch
    n_nodes = len(table.position)
    perfect = np.zeros(pair.pinion.n_teeth), np.zeros(pair.wheel.n_teeth)
    chords = 1.0 / (table.compliance - table.shared_compliance)
    springs = np.diff(np.maximum.accumulate(chords, axis=2), axis=2, prepend=0.0)
    rows = np.arange(springs.shape[0] * springs.shape[1]).reshape(springs.shape[:2])
    present = table.pinion_present[:, None] & table.wheel_present[None, :]
    return LineMesh(
        name=name,
        direction=direction,
        roll_dof=roll_dof,
        stiffness=springs.reshape(-1, n_nodes),
        gap=table.gap[:, :, 0].reshape(-1, n_nodes),
        depth=table.depth,
        rows=np.where(present, rows, -1),
        coast_rows=np.where(present, 0, -1),
        kinds=(table.pinion_kind, table.wheel_kind),
        errors=errors or perfect,
        tilts=tilts_a_pitch(tilts or perfect, pitch),
        upright=(pair.pitch_point + table.middle_lag) / pitch,
        n_pairs=table.last_pitch - table.first_pitch,
        first_pitch=table.first_pitch,
        start_teeth=start_teeth,
        start_phase=start_phase,
        mirror=2.0 * (pair.pitch_point + table.middle_lag) / pitch + 0.5,
        backlash=pair.backlash,
        damping=damping,
        shared_compliance=table.shared_compliance,
        friction=friction,
    )
