"""What statics tell the equations of motion of a mesh, spur or helical.

Stiffness, gaps, arms of friction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.helical import half_lag
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.pair_table import PairTable
from gensig.mesh.sliced.sliced_statics import chord_equilibrium, chord_states
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]


def loss_arm(table: PairTable | SlicedTable, position: Array) -> Array:
    """Moment of unit friction on pairs at positions s, reduced to the pinion, of the shape of
    ``position``, m.

    Sliding turns at the pitch point. The contact of helical teeth spans a part of the path, and
    the mean over the face turns as gently as the compiled core has it.
    """
    pair, lag = table.pair, half_lag(table)
    middle = position - lag
    arm = pair.start_curvature_radius + np.clip(middle, 0.0, pair.path_of_contact)
    sliding = np.sign(middle - pair.pitch_point)
    if lag > 0.0:
        width = table.options.friction_transition * pair.base_pitch + 2.0 * lag
        part = np.clip(2.0 * (middle - pair.pitch_point) / width, -1.0, 1.0)
        sliding = part * (1.5 - 0.5 * part**2)
    return np.asarray(sliding * (arm - (pair.tangent_length - arm) / pair.ratio))


def least_gaps(table: PairTable | SlicedTable) -> list[Array]:
    """Two gaps by node of which no pair of teeth has less than the sum, (node,) m each."""
    if isinstance(table, SlicedTable):
        touch = table.gap[np.ix_(table.pinion_present, table.wheel_present)][
            :, :, 0
        ].min(axis=(0, 1))
        return [touch, np.zeros_like(touch)]
    return [
        np.asarray(side.gap[side.present].min(axis=0))
        for side in (table.pinion, table.wheel)
    ]


def mean_mesh_stiffness(table: PairTable | SlicedTable, force: float) -> float:
    """Mean tangent stiffness over a base pitch under a force in N, N/m.

    Over the teeth that most are, which are the sound ones; where all differ, the median over the
    teeth.
    """
    if isinstance(table, SlicedTable):
        kinds = table.pinion_kind, table.wheel_kind
    else:
        kinds = table.pinion.kind, table.wheel.kind
    pinion, wheel = (_commonest(kind) for kind in kinds)
    n_pitches = table.pair.pinion.n_teeth if pinion is None or wheel is None else 1
    roll = table.pair.base_pitch * (np.arange(n_pitches * 32) + 0.5) / 32
    if isinstance(table, SlicedTable):
        chords = table
        if pinion is not None and wheel is not None:
            chords = replace(table, pinion_kind=pinion, wheel_kind=wheel)
        stiffness = chord_equilibrium(
            chords, chord_states(chords, roll), force
        ).stiffness
    else:
        mesh = table
        if pinion is not None and wheel is not None:
            mesh = replace(
                table,
                pinion=replace(table.pinion, kind=pinion),
                wheel=replace(table.wheel, kind=wheel),
            )
        stiffness = static_mesh(mesh, pair_states(mesh, roll), force).stiffness
    return float(np.median(stiffness.reshape(-1, 32), axis=0).mean())


def _commonest(kind: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Kinds of a gear whose teeth are all what most of them are, (tooth,).

    None where there is no such kind.
    """
    counts = np.bincount(kind)
    if counts.max() <= len(kind) // 2:
        return None
    return np.full_like(kind, counts.argmax())
