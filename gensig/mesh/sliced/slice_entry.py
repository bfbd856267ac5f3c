"""Slices that enter over their width.

What makes the sum over a few slices the integral over the face.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def over_slice(
    first: Array, force: Array, depth: Array, n_looks: int, farthest: float
) -> tuple[Array, Array]:
    """First gap and force of a pair over the way that a slice takes to enter, which is its own
    width.

    A slice that stands for its middle enters whole, with a jolt, and the jolts of all slices
    sound like a mesh of ``n_slices`` over the overlap ratio times the teeth. Over its width the
    sum over slices is the integral over the face. Means at one approach; the first touch is that
    of the edge that enters first.

    Parameters
    ----------
    first : (position,) m               ``farthest`` stands for what nothing touches
    force : (position, knot) N          at the depths (knot,) m beyond the first gap
    n_looks : of the positions' distances make the way from one slice to the next; even

    Returns
    -------
    both at all positions but ``n_looks`` / 2 at either end
    """
    n_left, knots = len(first) - n_looks, np.append(0.0, depth)
    begun = np.column_stack([np.zeros(len(first)), force])
    first = np.where(np.isfinite(first), first, farthest)
    least = np.lib.stride_tricks.sliding_window_view(first, n_looks + 1).min(axis=1)
    mean = np.zeros((n_left, len(depth)))
    for j in range(n_looks + 1):
        own = begun[j : j + n_left]
        bite = np.clip((least - first[j : j + n_left])[:, None] + depth, 0.0, depth[-1])
        chord = np.clip(
            np.searchsorted(knots, bite, side="right") - 1, 0, len(depth) - 1
        )
        low, high = (np.take_along_axis(own, chord + more, axis=1) for more in (0, 1))
        share = (bite - knots[chord]) / np.diff(knots)[chord]
        mean += (
            (0.5 if j in (0, n_looks) else 1.0) / n_looks * (low + share * (high - low))
        )
    return least, mean
