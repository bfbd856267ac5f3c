"""Static properties of a mesh in its equations of motion: stiffness and arms of friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.tooth_table import GearTeeth, ToothTable

Array = NDArray[np.float64]

PER_PITCH = 32  # phases of a base pitch over which the stiffness is averaged


def loss_arm(table: ToothTable, position: Array) -> Array:
    """Moment of unit friction on pairs at positions s, reduced to the pinion, m.

    The shape is that of ``position``. Sliding turns at the pitch point. The contact of helical
    teeth spans a part of the path, and the mean over the face turns as gently as in the compiled
    core.
    """
    pair, lag = table.pair, table.half_lag
    middle = position - lag
    arm = pair.start_curvature_radius + np.clip(middle, 0.0, pair.path_of_contact)
    sliding = np.sign(middle - pair.pitch_point)
    if lag > 0.0:
        width = table.options.friction_transition * pair.base_pitch + 2.0 * lag
        part = np.clip(2.0 * (middle - pair.pitch_point) / width, -1.0, 1.0)
        sliding = part * (1.5 - 0.5 * part**2)
    return np.asarray(sliding * (arm - (pair.tangent_length - arm) / pair.ratio))


def mean_mesh_stiffness(table: ToothTable, force: float) -> float:
    """Mean tangent stiffness over a base pitch under a force in N, N/m.

    Of the kind of most teeth, the healthy ones. Where no kind has a majority, the median over the
    teeth.
    """
    pinion, wheel = _of_one_kind(table.pinion), _of_one_kind(table.wheel)
    n_pitches = table.pair.pinion.n_teeth
    if pinion is not None and wheel is not None:
        n_pitches = 1
        table = replace(table, pinion=pinion, wheel=wheel)
    roll = table.pair.base_pitch * (np.arange(n_pitches * PER_PITCH) + 0.5) / PER_PITCH
    static = static_mesh(table, pair_states(table, roll), force)
    by_pitch = static.stiffness.reshape(-1, PER_PITCH)
    return float(np.median(by_pitch, axis=0).mean())


def _of_one_kind(teeth: GearTeeth) -> GearTeeth | None:
    """A gear all of whose teeth are of the kind of most; None without a majority."""
    if np.count_nonzero(teeth.kind == teeth.commonest) <= len(teeth.kind) // 2:
        return None
    return replace(teeth, kind=np.full_like(teeth.kind, teeth.commonest))
