"""A mesh of a shaft line from the tables of its teeth, as the implicit method takes it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.line_mesh import LineMesh
from gensig.driveline.time.mesh_friction import MeshFriction
from gensig.dynamics.helical import pitches
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.mesh.pair_table import PairTable
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]


class _Springs(NamedTuple):
    """Pairs of teeth of every kind of pinion and wheel tooth.

    ``stiffness`` (kind, kind, spring, node) N/m, ``gap`` (kind, kind, node) m, ``depth`` (spring,)
    m at which each spring begins to bear; ``kinds`` (tooth,) and ``present`` (kind,) of both gears.
    """

    stiffness: Array
    gap: Array
    depth: Array
    kinds: tuple[NDArray[np.int64], NDArray[np.int64]]
    present: tuple[NDArray[np.bool_], NDArray[np.bool_]]


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
    middle = pair.pitch_point
    if isinstance(table, SlicedTable):
        springs = _chords(table)
        middle = pair.pitch_point + table.middle_lag
    else:
        springs = _single_springs(table)
    first_pitch, last_pitch = pitches(table)
    n_nodes = len(table.position)
    n_kinds = springs.gap.shape[:2]
    rows = np.arange(n_kinds[0] * n_kinds[1]).reshape(n_kinds)
    present = springs.present[0][:, None] & springs.present[1][None, :]
    return LineMesh(
        name=name,
        direction=direction,
        roll_dof=roll_dof,
        stiffness=springs.stiffness.reshape(-1, n_nodes),
        gap=springs.gap.reshape(-1, n_nodes),
        depth=springs.depth,
        rows=np.where(present, rows, -1),
        coast_rows=np.where(present, 0, -1),
        kinds=springs.kinds,
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


def _single_springs(table: PairTable) -> _Springs:
    """One spring for every pair of spur teeth."""
    pinion, wheel = table.pinion, table.wheel
    compliance = _summed(pinion.compliance, wheel.compliance) - table.shared_compliance
    return _Springs(
        stiffness=(1.0 / compliance)[:, :, None],
        gap=_summed(pinion.gap, wheel.gap),
        depth=np.zeros(1),
        kinds=(pinion.kind, wheel.kind),
        present=(pinion.present, wheel.present),
    )


def _chords(table: SlicedTable) -> _Springs:
    """Springs side by side for the chords of sliced teeth.

    The force of a pair is made of chords between fixed depths of bite D_l and is convex, so that
    springs side by side that begin to bear at D_l, each as stiff as its chord is above the one
    before, are the same force. Force, energy and the torque of the passing teeth then come from
    one potential, whatever the depth.
    """
    chords = 1.0 / (table.compliance - table.shared_compliance)
    return _Springs(
        stiffness=np.diff(np.maximum.accumulate(chords, axis=2), axis=2, prepend=0.0),
        gap=table.gap[:, :, 0],
        depth=table.depth,
        kinds=(table.pinion_kind, table.wheel_kind),
        present=(table.pinion_present, table.wheel_present),
    )


def _summed(pinion: Array, wheel: Array) -> Array:
    """(kind, kind, node) of what both gears add."""
    return pinion[:, None, :] + wheel[None, :, :]
