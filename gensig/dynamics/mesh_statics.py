"""Static properties of a mesh, spur or helical, in its equations of motion.

Stiffness, gaps, arms of friction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.helical import half_lag
from gensig.mesh.load_distribution import (
    PERFECT,
    Meeting,
    PairStates,
    StaticMesh,
    pair_states,
    static_mesh,
)
from gensig.mesh.pair_table import PairTable
from gensig.mesh.sliced.sliced_statics import (
    ChordStates,
    chord_equilibrium,
    chord_states,
)
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]

PER_PITCH = 32  # phases of a base pitch over which the stiffness is averaged


def tooth_states(
    table: PairTable | SlicedTable, roll: Array, meeting: Meeting = PERFECT
) -> PairStates | ChordStates:
    """Pairs of teeth at rolls of the pinion in m, (phase,)."""
    if isinstance(table, SlicedTable):
        return chord_states(table, roll, meeting)
    return pair_states(table, roll, meeting)


def static_load(
    table: PairTable | SlicedTable, states: PairStates | ChordStates, force: float
) -> StaticMesh:
    """Equilibrium of pairs of teeth under a normal force in N."""
    if isinstance(table, SlicedTable):
        assert isinstance(states, ChordStates)
        return chord_equilibrium(table, states, force)
    assert isinstance(states, PairStates)
    return static_mesh(table, states, force)


def loss_arm(table: PairTable | SlicedTable, position: Array) -> Array:
    """Moment of unit friction on pairs at positions s, reduced to the pinion, m.

    The shape is that of ``position``. Sliding turns at the pitch point. The contact of helical
    teeth spans a part of the path, and the mean over the face turns as gently as in the compiled
    core.
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
    """Two gaps by node whose sum is the least of all pairs of teeth, (node,) m each."""
    if isinstance(table, SlicedTable):
        present = np.ix_(table.pinion_present, table.wheel_present)
        touch = table.gap[present][:, :, 0].min(axis=(0, 1))
        return [touch, np.zeros_like(touch)]
    sides = table.pinion, table.wheel
    return [np.asarray(side.gap[side.present].min(axis=0)) for side in sides]


def mean_mesh_stiffness(table: PairTable | SlicedTable, force: float) -> float:
    """Mean tangent stiffness over a base pitch under a force in N, N/m.

    Of the kind of most teeth, the healthy ones. Where no kind has a majority, the median over the
    teeth.
    """
    if isinstance(table, SlicedTable):
        kinds = table.pinion_kind, table.wheel_kind
    else:
        kinds = table.pinion.kind, table.wheel.kind
    pinion, wheel = (_commonest(kind) for kind in kinds)
    n_pitches = table.pair.pinion.n_teeth
    if pinion is not None and wheel is not None:
        n_pitches = 1
        if isinstance(table, SlicedTable):
            table = replace(table, pinion_kind=pinion, wheel_kind=wheel)
        else:
            table = replace(
                table,
                pinion=replace(table.pinion, kind=pinion),
                wheel=replace(table.wheel, kind=wheel),
            )
    roll = table.pair.base_pitch * (np.arange(n_pitches * PER_PITCH) + 0.5) / PER_PITCH
    static = static_load(table, tooth_states(table, roll), force)
    by_pitch = static.stiffness.reshape(-1, PER_PITCH)
    return float(np.median(by_pitch, axis=0).mean())


def _commonest(kind: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """The kind of most teeth, for all teeth of a gear, (tooth,); None without a majority."""
    counts = np.bincount(kind)
    if counts.max() <= len(kind) // 2:
        return None
    return np.full_like(kind, counts.argmax())
