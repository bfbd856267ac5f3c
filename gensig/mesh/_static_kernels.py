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
