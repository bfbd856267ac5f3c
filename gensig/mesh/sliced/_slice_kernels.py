"""Compiled core of the loaded contact in slices: bearing slices of all pairs and their loads.

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

ROUNDS = 100  # at most, of the bearing slices and the logarithm's load
SETTLED = 1e-12  # relative change of the approach that ends the rounds
SETTLED_FORCE = 1e-4  # and of a force that goes into a table
# of the even load per width: the logarithm has no limit as a slice loses contact
LEAST_INTENSITY = 1e-3


@_compiled
def solve_slices(
    structure,
    factor,
    constant,
    log_weight,
    gap,
    width,
    breadth,
    length_squared,
    shared,
    force,
    even,
    approach,
    stiffness,
    line_load,
):
    """Loads of all slices of all pairs at one force, phase by phase.

    Slice j of pair i has the gap gap[i, j] and the compliance structure[i, j] + contact. The
    structure's deflection w along the face obeys k w - (k length^2 w')' = p for the load per
    width p, k = 1 / structure, with free ends; without length every slice bends by itself. Source
    of the differential form: Pasternak (1954), a foundation with shear.

    Parameters
    ----------
    structure : (phase, pair, slice) m2/N     of both gears per width, unshared part
    factor, constant (phase, pair, slice), log_weight : contact compliance
        factor (constant - log_weight ln p), m2/N
    gap : (phase, pair, slice) m              inf where there is no flank
    width : (phase, pair, slice) m            of each slice; less at the edge of the field of action
    breadth : (slice,) m                      of each slice, whole
    length_squared : m2                       of the length over which slices couple
    shared : m/N                              body compliance that all pairs share
    force, even : N, N/m                      total, and load per width that scales the logarithm
    approach, stiffness : (phase,) m, N/m     written; inf and 0 where nothing can touch
    line_load : (phase, pair, slice) N/m      written

    Returns
    -------
    number of phases whose bearing slices were still changing after `ROUNDS`
    """
    n_phases, n_pairs, n_slices = gap.shape
    contact, bearing = (
        np.empty((n_pairs, n_slices)),
        np.zeros((n_pairs, n_slices), np.bool_),
    )
    lift, rest = np.empty((n_pairs, n_slices)), np.empty((n_pairs, n_slices))
    support, between = np.empty((n_pairs, n_slices)), np.empty((n_pairs, n_slices))
    per_pivot = np.empty(n_slices)
    n_unsettled = 0
    for k in range(n_phases):
        first = np.inf
        for i in range(n_pairs):
            _stiffen(structure[k, i], breadth, length_squared, support[i], between[i])
            for j in range(n_slices):
                contact[i, j] = factor * (constant[k, i, j] - log_weight * np.log(even))
                bearing[i, j] = width[k, i, j] > 0.0 and gap[k, i, j] < np.inf
                if bearing[i, j]:
                    first = min(first, gap[k, i, j])
        line_load[k] = 0.0
        if first == np.inf:
            approach[k], stiffness[k] = np.inf, 0.0
            continue
        last, total, settled = np.inf, 0.0, False
        for _ in range(ROUNDS):
            total, moment = 0.0, 0.0
            for i in range(n_pairs):
                if not bearing[i].any():
                    continue
                _deflections(
                    support[i],
                    between[i],
                    breadth,
                    contact[i],
                    gap[k, i],
                    first,
                    bearing[i],
                    per_pivot,
                    lift[i],
                    rest[i],
                )
                for j in range(n_slices):
                    if bearing[i, j]:
                        total += width[k, i, j] * (1.0 - lift[i, j]) / contact[i, j]
                        moment += (
                            width[k, i, j]
                            * (gap[k, i, j] - first - rest[i, j])
                            / contact[i, j]
                        )
            local = (force + moment) / total  # above the first gap
            changed = False
            for i in range(n_pairs):
                none = not bearing[i].any()
                for j in range(n_slices):
                    if width[k, i, j] <= 0.0 or gap[k, i, j] == np.inf:
                        continue
                    moved = 0.0 if none else lift[i, j] * local - rest[i, j]
                    bite = local - (gap[k, i, j] - first) - moved
                    touches = bite > 0.0
                    if touches != bearing[i, j]:
                        bearing[i, j] = touches
                        changed = True
                    if touches:
                        load = bite / contact[i, j]
                        line_load[k, i, j] = load
                        contact[i, j] = factor * (
                            constant[k, i, j]
                            - log_weight * np.log(max(load, LEAST_INTENSITY * even))
                        )
                    else:
                        line_load[k, i, j] = 0.0
            settled = not changed and abs(local - last) <= SETTLED * local
            last = local
            if settled:
                break
        n_unsettled += not settled
        approach[k] = first + last + shared * force
        stiffness[k] = total / (1.0 + shared * total)
    return n_unsettled


@_compiled
def bite_forces(
    structure,
    factor,
    constant,
    log_weight,
    gap,
    width,
    breadth,
    length_squared,
    even,
    depth,
    reach,
    first,
    force,
):
    """Force of one tooth pair at prescribed depths, position by position.

    Parameters
    ----------
    structure, gap : (node, slice)            see `solve_slices`
    factor, constant (node, slice), log_weight, breadth, length_squared, even :
        see `solve_slices`
    width : (node, slice) m
    depth : (knot,) m                         beyond the first gap, increasing and positive
    reach : m                                 positions whose first gap lies beyond are left out
    first : (node,) m                         first gap, written
    force : (node, knot) N                    written; 0 where left out

    Returns
    -------
    number of positions and depths whose bearing slices were still changing after `ROUNDS`
    """
    n_nodes, n_slices = gap.shape
    contact, bearing = np.empty(n_slices), np.zeros(n_slices, np.bool_)
    lift, rest = np.empty(n_slices), np.empty(n_slices)
    support, between, per_pivot = (
        np.empty(n_slices),
        np.empty(n_slices),
        np.empty(n_slices),
    )
    light = np.log(LEAST_INTENSITY * even)
    n_unsettled = 0
    for k in range(n_nodes):
        first[k] = np.inf
        for j in range(n_slices):
            if width[k, j] > 0.0:
                first[k] = min(first[k], gap[k, j])
        force[k] = 0.0
        if not first[k] <= reach:
            continue
        bearing[:] = False
        _stiffen(structure[k], breadth, length_squared, support, between)
        for knot in range(depth.shape[0]):
            for j in range(n_slices):
                if not bearing[j]:
                    contact[j] = factor * (constant[k, j] - log_weight * light)
                    bearing[j] = (
                        width[k, j] > 0.0 and gap[k, j] - first[k] < depth[knot]
                    )
            last, settled = 0.0, False
            for _ in range(ROUNDS):
                _deflections(
                    support,
                    between,
                    breadth,
                    contact,
                    gap[k],
                    first[k],
                    bearing,
                    per_pivot,
                    lift,
                    rest,
                )
                total, changed = 0.0, False
                for j in range(n_slices):
                    if width[k, j] <= 0.0 or gap[k, j] == np.inf:
                        continue
                    bite = (
                        depth[knot]
                        - (gap[k, j] - first[k])
                        - (lift[j] * depth[knot] - rest[j])
                    )
                    touches = bite > 0.0
                    changed = changed or touches != bearing[j]
                    bearing[j] = touches
                    if touches:
                        load = bite / contact[j]
                        total += width[k, j] * load
                        if log_weight != 0.0:
                            heavy = np.log(max(load, LEAST_INTENSITY * even))
                            contact[j] = factor * (constant[k, j] - log_weight * heavy)
                settled = not changed and abs(total - last) <= SETTLED_FORCE * total
                last = total
                if settled:
                    break
            n_unsettled += not settled
            force[k, knot] = last
    return n_unsettled


@_compiled
def _stiffen(structure, breadth, length_squared, support, between):
    """Writes the stiffness of every slice's structure and of its tie to the next, (slice,) N/m."""
    n_slices = structure.shape[0]
    for j in range(n_slices):
        support[j] = breadth[j] / structure[j]
        between[j] = 0.0
        if j < n_slices - 1:
            between[j] = (
                4.0
                * length_squared
                / ((structure[j] + structure[j + 1]) * (breadth[j] + breadth[j + 1]))
            )


@_compiled
def _deflections(
    support, between, breadth, contact, gap, first, bearing, per_pivot, lift, rest
):
    """Writes the deflection of one pair's structure: lift x (approach - first gap) - rest,
    (slice,).

    The load per width of a bearing slice is (approach - gap - w) / contact. This is one
    tridiagonal system, solved for the part proportional to the approach and for the rest (Thomas;
    the pivots are positive here).
    """
    n_slices = support.shape[0]
    before = 0.0
    for j in range(n_slices):
        pressed = breadth[j] / contact[j] if bearing[j] else 0.0
        pivot = support[j] + before + between[j] + pressed
        lift[j] = pressed
        rest[j] = pressed * (gap[j] - first) if bearing[j] else 0.0
        if j > 0:
            ratio = before * per_pivot[j - 1]
            pivot -= ratio * before
            lift[j] += ratio * lift[j - 1]
            rest[j] += ratio * rest[j - 1]
        per_pivot[j] = 1.0 / pivot
        before = between[j]
    for j in range(n_slices - 1, -1, -1):
        if j < n_slices - 1:
            lift[j] += between[j] * lift[j + 1]
            rest[j] += between[j] * rest[j + 1]
        lift[j] *= per_pivot[j]
        rest[j] *= per_pivot[j]
