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
_compiled: Any = functools.partial(njit, nogil=True, cache=True, error_model="numpy")()


@_compiled
def add_teeth(
    index, cell, part, beyond, kind, present, soft, back, error, tilt, compliance, gap
):
    """Add what the teeth of one gear contribute to the compliance and the gap of pairs.

    Parameters
    ----------
    index : (phase, pair)    of the tooth, counted on over the turns of the gear
    cell, part, beyond : (phase, pair)    cell of the table, relative position in it, and position
        beyond the pitch point in m
    kind, error, tilt : (tooth,)    row of the tables; m and m/m as in ``pair_states``
    present : (row,)
    soft, back : (row, node)    compliance and gap, m/N and m
    compliance, gap : (phase, pair) m/N and m, added to; the gap of a missing tooth is inf
    """
    n_teeth = kind.shape[0]
    for i in range(index.shape[0]):
        for j in range(index.shape[1]):
            tooth = index[i, j] % n_teeth
            row, low, high_share = kind[tooth], cell[i, j], part[i, j]
            low_share = 1.0 - high_share
            compliance[i, j] += (
                low_share * soft[row, low] + high_share * soft[row, low + 1]
            )
            opened = gap[i, j] + error[tooth] + tilt[tooth] * beyond[i, j]
            gap[i, j] = opened + (
                low_share * back[row, low] + high_share * back[row, low + 1]
            )
            if not present[row]:
                gap[i, j] = np.inf


@_compiled
def share_over_pairs(compliance, gap, force, shared, approach, load, stiffness):
    """Equilibrium of pairs under a total force in N: those with the least gaps carry.

    Parameters
    ----------
    compliance, gap : (phase, pair) m/N and m    without the shared compliance; inf for no pair
    shared : m/N    body compliance of all pairs together
    approach, load, stiffness : (phase,) m, (phase, pair) N, (phase,) N/m, written
    """
    n_pairs = gap.shape[1]
    order = np.empty(n_pairs, np.int64)
    for i in range(gap.shape[0]):
        for j in range(n_pairs):
            position = j
            while position > 0 and gap[i, order[position - 1]] > gap[i, j]:
                order[position] = order[position - 1]
                position -= 1
            order[position] = j
        # if the pairs so far carry: stiffness, its moment, approach less the shared deflection
        stiff, moment, local = 0.0, 0.0, 0.0
        own, carrying = -np.inf, 0.0
        for position in range(n_pairs):
            j = order[position]
            if gap[i, j] < np.inf:
                stiff += 1.0 / compliance[i, j]
                moment += gap[i, j] / compliance[i, j]
                local = (force + moment) / stiff
                if local > gap[i, j]:
                    own, carrying = local, stiff
        for j in range(n_pairs):
            load[i, j] = max(own - gap[i, j], 0.0) / compliance[i, j]
        approach[i] = np.inf
        if carrying > 0.0:
            approach[i] = own + shared * force
        stiffness[i] = carrying / (1.0 + shared * carrying)
