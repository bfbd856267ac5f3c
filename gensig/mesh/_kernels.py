"""Compiled core of the contact over the face: lower envelope of two flanks, load over the slices.

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

BLOCK = 8  # nodes of a flank that are passed over together where none can touch
ROUNDING = 1e-18  # m, above that of a gap
ROUNDS = 40  # at most, of the logarithm's load: each leaves about a tenth of the error
# of the even load per width: the logarithm has no limit as a slice loses contact
LEAST_INTENSITY = 1e-3


@_compiled
def lower_envelope(standing_back, arc, center, relative_radius, gap):
    """Gap to the mating flank: the least of standing_back + x^2 / (2 rho) along the common tangent.

    Parameters
    ----------
    standing_back : (slice, profile) m    of the flank behind its nominal position, linear between
        nodes, inf where the flank is missing
    arc : (profile,) m                    length along the flank, increasing
    center : (node,) m                    nominal contact on that length; may lie beyond the ends
    relative_radius : (node,) m           relative radius of curvature there
    gap : (slice, node) m                 written
    """
    n_profile = arc.shape[0]
    slope = np.empty(n_profile - 1)
    block_low = np.empty((n_profile + BLOCK - 1) // BLOCK)
    for i in range(standing_back.shape[0]):
        back = standing_back[i]
        for j in range(n_profile - 1):
            slope[j] = (back[j + 1] - back[j]) / (arc[j + 1] - arc[j])
        lowest = _lowest_of_blocks(back, block_low)
        # NumPy's least and search would take most of this function's compile time
        for k in range(center.shape[0]):
            middle, end = 0, n_profile  # the first node from the contact on
            while middle < end:
                half = (middle + end) // 2
                if arc[half] < center[k]:
                    middle = half + 1
                else:
                    end = half
            least = np.inf
            if 0 < middle < n_profile:
                least = _between(
                    back, arc, slope, middle - 1, center[k], relative_radius[k]
                )
            for direction in (1, -1):
                j = middle if direction == 1 else middle - 1
                while 0 <= j < n_profile:
                    x = arc[j] - center[k]
                    drop = x * x / (2.0 * relative_radius[k])
                    if lowest + drop >= least:
                        break
                    behind = j - direction
                    enters = behind < 0 or behind // BLOCK != j // BLOCK
                    if enters and block_low[j // BLOCK] + drop >= least + ROUNDING:
                        j += BLOCK * direction
                        continue
                    least = min(least, back[j] + drop)
                    cell = min(j, j + direction)  # the one beyond this node
                    if 0 <= cell < n_profile - 1:
                        beyond = _between(
                            back, arc, slope, cell, center[k], relative_radius[k]
                        )
                        least = min(least, beyond)
                    j += direction
            gap[i, k] = least


@_compiled
def _lowest_of_blocks(back, block_low):
    """Least of all nodes, m; ``block_low`` (block,) m is written.

    The least of a block counts the nodes next to it too.
    """
    lowest = np.inf
    for block in range(block_low.shape[0]):
        first = max(block * BLOCK - 1, 0)
        last = min((block + 1) * BLOCK, back.shape[0] - 1)
        least = np.inf
        for j in range(first, last + 1):
            least = min(least, back[j])
        block_low[block] = least
        lowest = min(lowest, least)
    return lowest


@_compiled
def _between(back, arc, slope, j, center, radius):
    """Minimum between nodes j and j + 1; inf if it is at a node, or if a node is missing."""
    x = -radius * slope[j]
    if not np.isfinite(x) or x <= arc[j] - center or x >= arc[j + 1] - center:
        return np.inf
    return back[j] + slope[j] * (x - arc[j] + center) + x * x / (2.0 * radius)


@_compiled
def _sort_slices(gap, order):
    """Sort ``order``, indices of ``gap`` (slice,), by gap and among equal gaps by index.

    By insertion: the slices of the node before are in nearly the same order. NumPy's sort would
    take most of the compile time of the function that calls it.
    """
    for i in range(1, order.shape[0]):
        one = order[i]
        j = i
        while j > 0 and (
            gap[order[j - 1]] > gap[one]
            or (gap[order[j - 1]] == gap[one] and order[j - 1] > one)
        ):
            order[j] = order[j - 1]
            j -= 1
        order[j] = one


@_compiled
def _is_repeated(k, slice_gap, load, constant, bending):
    """True if node k has the inputs of the node before, as all have beyond the path of contact."""
    if load[k] != load[k - 1] or constant[k] != constant[k - 1]:
        return False
    if bending[k] != bending[k - 1]:
        return False
    n_same, n_slices = 0, slice_gap.shape[0]
    while n_same < n_slices and slice_gap[n_same, k] == slice_gap[n_same, k - 1]:
        n_same += 1
    return n_same == n_slices


@_compiled
def share_over_slices(
    slice_gap, width, load, factor, constant, log_weight, bending, gap, compliance
):
    """Gap of the slice that touches first, and the secant compliance from there under the load.

    Every slice carries width x (approach - its gap) / (unit compliance). The unit compliance is
    that of the contact, factor x (constant - log_weight x ln(load per width)), plus ``bending``.

    Parameters
    ----------
    slice_gap : (slice, node) m
    width : (slice,) m
    load : (node,) N
    factor : m2/N, constant : (node,), log_weight : 0 (linear) or 1 (Weber)
    bending : (node,) m2/N    of a slice alone, per unit width; not part of the result
    gap, compliance : (node,) m, m/N, written
    """
    n_slices, full = width.shape[0], width.sum()
    order, unit = np.arange(n_slices), np.empty(n_slices)
    for k in range(load.shape[0]):
        if k > 0 and _is_repeated(k, slice_gap, load, constant, bending):
            gap[k], compliance[k] = gap[k - 1], compliance[k - 1]
            continue
        _sort_slices(slice_gap[:, k], order)
        first, even = slice_gap[order[0], k], load[k] / full
        unit[:] = factor * (constant[k] - log_weight * np.log(even)) + bending[k]
        gap[k] = first
        approach = first
        for _ in range(ROUNDS):
            last = approach
            stiffness, moment, approach, n_bearing = 0.0, 0.0, first, 0
            for position in range(n_slices):
                i = order[position]
                if position > 0 and approach <= slice_gap[i, k]:
                    break
                stiffness += width[i] / unit[i]
                moment += width[i] / unit[i] * (slice_gap[i, k] - first)
                approach = first + (load[k] + moment) / stiffness
                n_bearing += 1
            if abs(approach - last) <= 1e-13 * (approach - first):
                break
            for position in range(n_bearing):
                i = order[position]
                intensity = max(
                    (approach - slice_gap[i, k]) / unit[i], LEAST_INTENSITY * even
                )
                unit[i] = (
                    factor * (constant[k] - log_weight * np.log(intensity)) + bending[k]
                )
        compliance[k] = (approach - first) / load[k] - bending[k] / full
