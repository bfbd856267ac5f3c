"""Static equilibrium of helical pairs from the chords of their table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.mesh.load_distribution import PERFECT, Meeting, StaticMesh, cells
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]

ROUNDS = 100  # of Newton's method at most; it ends exactly on piecewise linear forces


@dataclass(frozen=True, slots=True, kw_only=True)
class ChordStates:
    """Chords of the tooth pairs at each phase, in order of entry.

    ``compliance`` less the shared part and ``gap`` are (phase, pair, chord), ``position`` (phase,
    pair) m. An absent pair has infinite gaps.
    """

    compliance: Array
    gap: Array
    position: Array


def chord_states(
    table: SlicedTable, roll: Array, meeting: Meeting = PERFECT
) -> ChordStates:
    """Pairs at the pinion's roll, (phase,) m along the line of action.

    Errors and tilts of the teeth are those of the middle of the face.
    """
    pair, pitch = table.pair, table.pair.base_pitch
    index = np.floor(roll / pitch).astype(np.int64)[:, None] - table.first_pitch
    index = index - np.arange(table.last_pitch - table.first_pitch)
    position = roll[:, None] - index * pitch
    cell, part = cells(table.position, position)
    part = part[:, :, None]
    middle_lag = 0.5 * pair.face_width * math.tan(pair.base_helix_angle)
    beyond = position - pair.pitch_point - middle_lag
    pinion = (index + meeting.start_teeth[0]) % pair.pinion.n_teeth
    wheel = (index + meeting.start_teeth[1]) % pair.wheel.n_teeth
    kinds = table.pinion_kind[pinion], table.wheel_kind[wheel]
    back = np.zeros(position.shape)
    gears = zip((pinion, wheel), meeting.errors, meeting.tilts, strict=True)
    for teeth, error, tilt in gears:
        if error is not None:
            back += error[teeth]
        if tilt is not None:
            back += tilt[teeth] * beyond
    back[~(table.pinion_present[kinds[0]] & table.wheel_present[kinds[1]])] = np.inf

    def at_position(values: Array) -> Array:
        low, high = (values[kinds[0], kinds[1], :, node] for node in (cell, cell + 1))
        return np.asarray((1.0 - part) * low + part * high)

    return ChordStates(
        compliance=at_position(table.compliance) - table.shared_compliance,
        gap=at_position(table.gap) + back[:, :, None],
        position=position,
    )


def chord_equilibrium(
    table: SlicedTable, states: ChordStates, force: float
) -> StaticMesh:
    """Load sharing, approach and tangent stiffness dF/d(approach) under a total mesh force in N.

    Every pair is on the chord of its depth at the approach less the shared deflection. Forces are
    convex in that depth, so that Newton's method converges from above. ``mesh.law=paper`` as in
    ``static_mesh``.
    """
    gap = states.gap
    if table.options.law == "paper":
        pair = table.pair
        reach = pair.path_of_contact + pair.face_width * math.tan(pair.base_helix_angle)
        on_path = (states.position >= 0.0) & (states.position <= reach)
        on_path &= np.isfinite(gap[:, :, 0])
        gap = np.where(on_path[:, :, None], 0.0, np.inf)
    touch = gap[:, :, 0]
    lost = np.asarray(np.isinf(touch).all(axis=1))
    touch = np.where(lost[:, None], 0.0, touch)

    def carried(local: Array) -> tuple[Array, Array]:
        """Loads and stiffnesses, (phase, pair), at the approach less the shared deflection."""
        depth = local[:, None] - touch
        chord = np.maximum(np.searchsorted(table.depth, depth) - 1, 0)[:, :, None]
        compliance = np.take_along_axis(states.compliance, chord, axis=2)[:, :, 0]
        start = np.take_along_axis(gap, chord, axis=2)[:, :, 0]
        bears = (depth > 0.0) & np.isfinite(start)
        deflection = np.maximum(local[:, None] - np.where(bears, start, 0.0), 0.0)
        load = np.where(bears, deflection / compliance, 0.0)
        return load, np.where(load > 0.0, 1.0 / compliance, 0.0)

    softest = force * states.compliance.min(axis=(1, 2))
    local = np.min(touch, axis=1) + table.depth[-1] + softest
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
    """Energy that every chord's spring omits, J, and its slope, N.

    Both are (pinion kind, wheel kind, chord, node). At the depth D_l where chord l begins, a pair
    holds the work of its force up to there. The springs of the two chords that meet there hold
    0.5 F (D - gap) of it with their own gaps; F is their common force. The difference to the
    chord before is therefore 0.5 F (gap_l - gap_(l - 1)).
    """
    compliance, gap = table.compliance - table.shared_compliance, table.gap
    value, slope = np.zeros_like(gap), np.zeros_like(gap)
    for chord in range(1, len(table.depth)):
        here, before = np.s_[:, :, chord], np.s_[:, :, chord - 1]
        deflection = gap[:, :, 0] + table.depth[chord] - gap[here]
        deflection_slope = table.gap_slope[:, :, 0] - table.gap_slope[here]
        force = deflection / compliance[here]
        change = deflection_slope - force * table.compliance_slope[here]
        force_slope = change / compliance[here]
        step = gap[here] - gap[before]
        step_slope = table.gap_slope[here] - table.gap_slope[before]
        value[here] = value[before] + 0.5 * force * step
        work_slope = force_slope * step + force * step_slope
        slope[here] = slope[before] + 0.5 * work_slope
    return value, slope
