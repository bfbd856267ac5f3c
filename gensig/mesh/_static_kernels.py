"""Compiled core of the static mesh: the pairs of teeth in contact and their shares of the load.

Scalar code without reassociation, in the order of the arrays.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numba import njit

from gensig.compilation import watch

watch()
# of Newton's method at most; it ends exactly, as forces are linear piece by piece
ROUNDS = 100
# chords of a pair that its gap keeps apart, and of no pair
ABOVE, ABSENT = -1, -2
_compiled: Any = functools.partial(njit, nogil=True, cache=True, error_model="numpy")()


@_compiled
def locate_pairs(
    roll,
    pitch,
    first_pitch,
    nodes,
    upright,
    present,
    start,
    pinion_kind,
    wheel_kind,
    pinion_error,
    wheel_error,
    pinion_tilt,
    wheel_tilt,
    position,
    cell,
    share,
    pinion,
    wheel,
    back,
):
    """Write positions, kinds and errors of pairs of teeth at rolls of the pinion.

    Parameters
    ----------
    roll : (phase,) m
    nodes : first and last position of the table, m, and the number of its cells
    upright : m            position where tilts add nothing
    present : (pinion kind, wheel kind)
    start : teeth of pinion and wheel in pair 0
    pinion_kind, ... : (tooth,)    kinds, errors in m and tilts in m/m
    position, share, back : (phase, pair)    written: m, relative position in the cell, and m by
        which the pair stands back; inf for a missing tooth
    cell, pinion, wheel : (phase, pair)      written: cell of the table, and kinds
    """
    low, high, n_cells = nodes
    per_meter = n_cells / (high - low)
    for i in range(roll.shape[0]):
        newest = int(np.floor(roll[i] / pitch)) - first_pitch
        for j in range(position.shape[1]):
            index = newest - j
            here = roll[i] - index * pitch
            x = min(max((here - low) * per_meter, 0.0), float(n_cells))
            node = max(min(int(x), n_cells - 1), 0)
            tooth_a = (index + start[0]) % pinion_kind.shape[0]
            tooth_b = (index + start[1]) % wheel_kind.shape[0]
            tilt = pinion_tilt[tooth_a] + wheel_tilt[tooth_b]
            error = pinion_error[tooth_a] + wheel_error[tooth_b]
            position[i, j], cell[i, j], share[i, j] = here, node, x - node
            pinion[i, j], wheel[i, j] = pinion_kind[tooth_a], wheel_kind[tooth_b]
            back[i, j] = error + tilt * (here - upright)
            if not present[pinion[i, j], wheel[i, j]]:
                back[i, j] = np.inf


@_compiled
def add_part(soft, back, pinion, wheel, cell, share, compliance, gap):
    """Add a part of a table to the compliances and gaps of pairs.

    Parameters
    ----------
    soft, back : (pinion kind, wheel kind, chord, node) m/N and m
    pinion, wheel : (phase, pair)    kinds of the teeth; a part with one kind has it for all
    cell, share : (phase, pair)      cell of the table, and relative position in it
    compliance, gap : (phase, pair, chord) m/N and m, added to
    """
    last_pinion, last_wheel = soft.shape[0] - 1, soft.shape[1] - 1
    for i in range(cell.shape[0]):
        for j in range(cell.shape[1]):
            a, b = min(pinion[i, j], last_pinion), min(wheel[i, j], last_wheel)
            low, high_share = cell[i, j], share[i, j]
            low_share = 1.0 - high_share
            for chord in range(soft.shape[2]):
                compliance[i, j, chord] += (
                    low_share * soft[a, b, chord, low]
                    + high_share * soft[a, b, chord, low + 1]
                )
                gap[i, j, chord] += (
                    low_share * back[a, b, chord, low]
                    + high_share * back[a, b, chord, low + 1]
                )


@_compiled
def share_over_pairs(compliance, gap, depth, force, shared, approach, load, stiffness):
    """Equilibrium of pairs under a total force in N, each on the chord of its depth.

    The force is convex in the approach. Newton's method begins with all pairs on their last
    chords, comes from above, and ends where no pair changes its chord.

    Parameters
    ----------
    compliance, gap : (phase, pair, chord) m/N and m    without the shared compliance; inf for no
        pair
    depth : (chord,) m    beyond the first gap, from which chords hold
    shared : m/N          body compliance of all pairs together
    approach, load, stiffness : (phase,) m, (phase, pair) N, (phase,) N/m, written
    """
    n_pairs, last = gap.shape[1], len(depth) - 1
    chord = np.empty(n_pairs, np.int64)
    for i in range(gap.shape[0]):
        for j in range(n_pairs):
            chord[j] = last
            if not gap[i, j, 0] < np.inf:
                chord[j] = ABSENT
        # stiffness of the pairs that carry, its moment, approach less the shared deflection
        stiff, local = 0.0, -np.inf
        for _ in range(ROUNDS):
            stiff, moment = 0.0, 0.0
            for j in range(n_pairs):
                if chord[j] >= 0:
                    stiff += 1.0 / compliance[i, j, chord[j]]
                    moment += gap[i, j, chord[j]] / compliance[i, j, chord[j]]
            if stiff == 0.0:
                break
            local, changed = (force + moment) / stiff, False
            for j in range(n_pairs):
                if chord[j] == ABSENT:
                    continue
                held, within = ABOVE, local - gap[i, j, 0]
                while held < last and within > depth[held + 1]:
                    held += 1
                changed |= held != chord[j]
                chord[j] = held
            if not changed:
                break
        for j in range(n_pairs):
            load[i, j] = 0.0
            if chord[j] >= 0:
                within = local - gap[i, j, chord[j]]
                load[i, j] = max(within, 0.0) / compliance[i, j, chord[j]]
        approach[i] = np.inf
        if stiff > 0.0:
            approach[i] = local + shared * force
        stiffness[i] = stiff / (1.0 + shared * stiff)
