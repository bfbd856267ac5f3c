"""Structure of teeth in slices that bend their neighbours: deflection and strain energy."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array


def structure_deflection(
    structure: Array, load: Array, width: Array, length_squared: float
) -> Array:
    """Deflection of one pair's structure under given loads, (..., slice) m.

    Parameters
    ----------
    structure : (..., slice) m2/N    compliance per width
    load : (..., slice) N
    width : (slice,) m
    length_squared : m2              of the length over which slices couple

    The deflection w obeys k w - (k l^2 w')' = p with k = 1 / structure and free ends, in the
    finite volumes of ``solve_slices``; Thomas' method, all phases at once. Its pivots are positive.
    """
    n_slices = len(width)
    between = np.zeros_like(structure)
    between[..., :-1] = (
        4.0
        * length_squared
        / ((structure[..., 1:] + structure[..., :-1]) * (width[1:] + width[:-1]))
    )
    # the last ties to nothing, so the first does not either
    before = np.roll(between, 1, axis=-1)
    pivot, moved = width / structure + before + between, load.copy()
    for j in range(1, n_slices):
        ratio = before[..., j] / pivot[..., j - 1]
        pivot[..., j] -= ratio * before[..., j]
        moved[..., j] += ratio * moved[..., j - 1]
    moved[..., -1] /= pivot[..., -1]
    for j in range(n_slices - 2, -1, -1):
        moved[..., j] += between[..., j] * moved[..., j + 1]
        moved[..., j] /= pivot[..., j]
    return moved


def structure_energy(
    structure: Array, line_load: Array, width: Array, length_squared: float
) -> Array:
    """Half the work of the loads on the deflection of one pair's structure, (phase,) J.

    ``line_load`` (phase, slice) N/m, the others as in ``structure_deflection``.
    """
    load = width * line_load
    moved = structure_deflection(structure, load, width, length_squared)
    return np.asarray(0.5 * (load * moved).sum(axis=1))
