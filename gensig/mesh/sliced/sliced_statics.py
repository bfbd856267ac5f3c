"""Static equilibrium of helical pairs from the chords of their table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.mesh.load_distribution import StaticMesh
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]

ROUNDS = 100  # of Newton's method at most; on forces made of straight pieces it ends by itself


@dataclass(frozen=True, slots=True, kw_only=True)
class ChordStates:
    """The chords of the pairs followed at each phase: compliance less the shared part, and gap,
    (phase, pair, chord); pairs in order of entry. An absent pair has infinite gaps. ``position``
    (phase, pair) m."""

    compliance: Array
    gap: Array
    position: Array


def chord_states(
    table: SlicedTable,
    roll: Array,
    *,
    start_tooth_pinion: int = 0,
    start_tooth_wheel: int = 0,
    pinion_error: Array | None = None,
    wheel_error: Array | None = None,
    pinion_tilt: Array | None = None,
    wheel_tilt: Array | None = None,
) -> ChordStates:
    """Pairs at the pinion's roll, (phase,) m along the line of action; at 0 the start teeth enter
    at A.

    Errors and tilts of the teeth as in ``load_distribution.pair_states``, for the middle of the
    face.
    """
    pair, pitch = table.pair, table.pair.base_pitch
    index = np.floor(roll / pitch).astype(np.int64)[:, None] - table.first_pitch
    index = index - np.arange(table.last_pitch - table.first_pitch)
    position = roll[:, None] - index * pitch
    nodes, n_cells = table.position, len(table.position) - 1
    place = np.clip(
        (position - nodes[0]) * (n_cells / (nodes[-1] - nodes[0])), 0.0, n_cells
    )
    cell = np.minimum(place.astype(np.int64), n_cells - 1)
    part = (place - cell)[:, :, None]
    beyond = (
        position
        - pair.pitch_point
        - 0.5 * pair.face_width * math.tan(pair.base_helix_angle)
    )
    pinion, wheel = (
        (index + start_tooth_pinion) % pair.pinion.n_teeth,
        (index + start_tooth_wheel) % pair.wheel.n_teeth,
    )
    kinds = table.pinion_kind[pinion], table.wheel_kind[wheel]
    back = np.zeros(position.shape)
    for teeth, error, tilt in (
        (pinion, pinion_error, pinion_tilt),
        (wheel, wheel_error, wheel_tilt),
    ):
        back += 0.0 if error is None else error[teeth]
        back += 0.0 if tilt is None else tilt[teeth] * beyond
    back[~(table.pinion_present[kinds[0]] & table.wheel_present[kinds[1]])] = np.inf

    def at_place(values: Array) -> Array:
        low, high = (values[kinds[0], kinds[1], :, node] for node in (cell, cell + 1))
        return np.asarray((1.0 - part) * low + part * high)

    return ChordStates(
        compliance=at_place(table.compliance) - table.shared_compliance,
        gap=at_place(table.gap) + back[:, :, None],
        position=position,
    )


def chord_equilibrium(
    table: SlicedTable, states: ChordStates, force: float
) -> StaticMesh:
    """Load sharing, approach and tangent stiffness dF/d(approach) under a total mesh force in N.

    Every pair is on the chord of its own depth of bite into what the others deflect. Forces of
    pairs are convex in that depth, so Newton's method comes down on it from above.
    ``mesh.law=paper`` as in ``static_mesh``.
    """
    gap = states.gap
    if table.options.law == "paper":
        pair = table.pair
        reach = pair.path_of_contact + pair.face_width * math.tan(pair.base_helix_angle)
        on_path = (
            (states.position >= 0.0)
            & (states.position <= reach)
            & np.isfinite(gap[:, :, 0])
        )
        gap = np.where(on_path[:, :, None], 0.0, np.inf)
    touch = gap[:, :, 0]
    lost = np.asarray(np.isinf(touch).all(axis=1))
    touch = np.where(lost[:, None], 0.0, touch)

    def carried(local: Array) -> tuple[Array, Array]:
        """Loads and stiffnesses of the pairs, (phase, pair), at the approach less the shared
        deflection.
        """
        depth = local[:, None] - touch
        chord = np.maximum(
            np.searchsorted(table.depth, depth.ravel()).reshape(depth.shape) - 1, 0
        )
        own, start = (
            np.take_along_axis(v, chord[:, :, None], axis=2)[:, :, 0]
            for v in (states.compliance, gap)
        )
        bears = (depth > 0.0) & np.isfinite(start)
        load = np.where(
            bears,
            np.maximum(local[:, None] - np.where(bears, start, 0.0), 0.0) / own,
            0.0,
        )
        return load, np.where(load > 0.0, 1.0 / own, 0.0)

    local = (
        np.min(touch, axis=1)
        + table.depth[-1]
        + force * states.compliance.min(axis=(1, 2))
    )
    for _ in range(ROUNDS):
        load, stiffness = carried(local)
        total = np.where(lost, 1.0, stiffness.sum(axis=1))
        step = np.where(lost, 0.0, (force - load.sum(axis=1)) / total)
        local = local + step
        if np.all(np.abs(step) <= 1e-13 * np.abs(local)):
            break
    load, stiffness = carried(local)
    total, shared = stiffness.sum(axis=1), table.shared_compliance
    return StaticMesh(
        approach=np.where(lost, np.inf, local + shared * force),
        load=np.where(lost[:, None], 0.0, load),
        stiffness=np.where(lost, 0.0, total / (1.0 + shared * total)),
    )


def left_out_energy(table: SlicedTable) -> tuple[Array, Array]:
    """Energy that every chord's spring leaves out and its slope, (pinion kind, wheel kind, chord,
    node) J and N.

    A pair that bites to the depth D_l where chord l begins holds the work of its force on the way
    there. The springs of both chords that meet there hold 0.5 F (D - gap) of it each by their own
    gaps, F their force there, so that the difference to the chord before is 0.5 F (gap_l - gap_(l
    - 1)).
    """
    compliance, gap = table.compliance - table.shared_compliance, table.gap
    value, slope = np.zeros_like(gap), np.zeros_like(gap)
    for chord in range(1, len(table.depth)):
        bite = gap[:, :, 0] + table.depth[chord] - gap[:, :, chord]
        bite_slope = table.gap_slope[:, :, 0] - table.gap_slope[:, :, chord]
        own, own_slope = compliance[:, :, chord], table.compliance_slope[:, :, chord]
        force, force_slope = bite / own, (bite_slope - bite / own * own_slope) / own
        step = gap[:, :, chord] - gap[:, :, chord - 1]
        step_slope = table.gap_slope[:, :, chord] - table.gap_slope[:, :, chord - 1]
        value[:, :, chord] = value[:, :, chord - 1] + 0.5 * force * step
        slope[:, :, chord] = slope[:, :, chord - 1] + 0.5 * (
            force_slope * step + force * step_slope
        )
    return value, slope
