"""A mesh of a shaft line from the tables of its teeth, as the implicit method takes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.line_mesh import LineMesh
from gensig.driveline.time.mesh_friction import MeshFriction
from gensig.dynamics.helical import pitches
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.mesh.tooth_table import ToothTable

Array = NDArray[np.float64]


def toothed_mesh(
    name: str,
    teeth: MeshTeeth,
    *,
    direction: Array,
    roll_dof: int,
    damping: float,
    friction: MeshFriction | None = None,
) -> LineMesh:
    """A mesh of a line; gear a is the pinion, ``direction`` that of the transverse force.

    The law is that of the pair dynamics. The back flanks are healthy teeth without errors, mirrored
    as the pair dynamics mirrors them, whose slices enter from the other end. A missing tooth is
    missing there too.
    """
    table, pair, pitch = teeth.table, teeth.pair, teeth.pair.base_pitch
    middle = pair.pitch_point + table.half_lag
    first_pitch, last_pitch = pitches(table)
    n_nodes, present = len(table.position), table.present
    rows = np.arange(present.size).reshape(present.shape)
    return LineMesh(
        name=name,
        direction=direction,
        roll_dof=roll_dof,
        stiffness=_springs(table).reshape(-1, n_nodes),
        gap=table.pairs.gap[:, :, 0].reshape(-1, n_nodes),
        depth=table.depth,
        rows=np.where(present, rows, -1),
        coast_rows=np.where(present, 0, -1),
        kinds=(table.pinion.kind, table.wheel.kind),
        errors=teeth.errors,
        tilts=(teeth.tilts[0] * pitch, teeth.tilts[1] * pitch),
        upright=middle / pitch,
        n_pairs=last_pitch - first_pitch,
        first_pitch=first_pitch,
        start_teeth=teeth.start_teeth,
        start_phase=teeth.start_phase,
        mirror=2.0 * middle / pitch + 0.5,
        backlash=pair.backlash,
        damping=damping,
        shared_compliance=table.shared_compliance,
        friction=friction,
    )


def _springs(table: ToothTable) -> Array:
    """Springs side by side for the chords of teeth, (pinion kind, wheel kind, spring, node) N/m.

    The force of a pair is made of chords between fixed depths of bite D_l and is convex, so that
    springs side by side that begin to bear at D_l, each as stiff as its chord is above the one
    before, are the same force. Force, energy and the torque of the passing teeth then come from
    one potential, whatever the depth.
    """
    chords = 1.0 / (table.pairs.compliance - table.shared_compliance)
    stiffest = np.maximum.accumulate(chords, axis=2)
    return np.diff(stiffest, axis=2, prepend=0.0)
