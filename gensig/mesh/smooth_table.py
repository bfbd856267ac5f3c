"""Smooth tables: quadratic splines whose slope is exactly the derivative of the value."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array


def smooth(values: Array, distance: float, limit: float) -> tuple[Array, Array]:
    """Values and slopes at the nodes of quadratic splines close to the given values.

    Between nodes the slope is linear and the value is its integral. Values and slopes are thus
    consistent, and the energy balance holds between nodes too. The control points are the values
    less a quarter of the second difference of the first row, the healthy tooth. This makes up for
    the curvature that a spline cuts off. The correction is clipped at ``limit``, so that no step
    rings. The order of rows is kept. A step becomes as wide as three nodes.

    Parameters
    ----------
    values : (row, node)    at a constant ``distance`` in m
    """
    first = np.diff(values[0])
    bend = np.minimum(np.maximum(first[1:] - first[:-1], -limit), limit)
    points = np.empty((len(values), values.shape[1] + 2))  # one more at each end
    points[:, 1:-1] = values
    points[:, 2:-2] -= 0.25 * bend
    # linear beyond the ends; np.pad takes longer than all the rest
    points[:, 0] = 2.0 * points[:, 1] - points[:, 2]
    points[:, -1] = 2.0 * points[:, -2] - points[:, -3]
    before, here, after = points[:, :-2], points[:, 1:-1], points[:, 2:]
    return 0.25 * (before + 2.0 * here + after), (after - before) / (2.0 * distance)
