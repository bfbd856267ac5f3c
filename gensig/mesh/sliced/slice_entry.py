"""Gradual entry of slices over their width: the sum over slices becomes the integral."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array


def over_slice(
    first: Array, force: Array, depth: Array, n_looks: int, farthest: float
) -> tuple[Array, Array]:
    """First gap and force of a tooth pair, averaged over the entry of one slice.

    A slice represented by its middle enters at once, with a jolt. The jolts of all slices excite
    the mesh at ``n_slices`` / overlap ratio times the tooth frequency. Averaged over the width of
    a slice, the sum over slices is the integral over the face. Means are taken at one approach;
    the first touch is that of the edge that enters first.

    Parameters
    ----------
    first : (position,) m               infinite gaps become ``farthest``
    force : (position, knot) N          at the depths (knot,) m beyond the first gap
    n_looks : positions from one slice to the next; even

    Returns
    -------
    both at all positions but ``n_looks`` / 2 at either end
    """
    n_left, knots = len(first) - n_looks, np.append(0.0, depth)
    weight = np.ones(n_looks + 1)
    weight[[0, -1]] = 0.5
    begun = np.column_stack([np.zeros(len(first)), force])
    first = np.where(np.isfinite(first), first, farthest)
    least = np.lib.stride_tricks.sliding_window_view(first, n_looks + 1).min(axis=1)
    mean = np.zeros((n_left, len(depth)))
    for j in range(n_looks + 1):
        forces = begun[j : j + n_left]
        bite = np.clip((least - first[j : j + n_left])[:, None] + depth, 0.0, depth[-1])
        chord = np.clip(
            np.searchsorted(knots, bite, side="right") - 1, 0, len(depth) - 1
        )
        low, high = (
            np.take_along_axis(forces, chord + more, axis=1) for more in (0, 1)
        )
        share = (bite - knots[chord]) / np.diff(knots)[chord]
        mean += weight[j] / n_looks * (low + share * (high - low))
    return least, mean
