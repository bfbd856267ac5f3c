"""Meshes of a line whose stiffness over the phase is given, to judge the law of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.line_mesh import LineMesh
from gensig.errors import ConfigError

Array = NDArray[np.float64]


def phase_mesh(
    name: str,
    *,
    direction: Array,
    roll_dof: int,
    n_teeth: tuple[int, int],
    stiffness: Array,
    gap: Array | None = None,
    backlash: float = 0.0,
    damping: float = 0.0,
    start_teeth: tuple[int, int] = (0, 0),
    start_phase: float = 0.0,
    mirror: float = 0.0,
) -> LineMesh:
    """A mesh whose whole stiffness is known over its phase: one spring k(u) behind one gap e(u).

    Parameters
    ----------
    n_teeth : of gears a and b; gear a is the irregular one where there is one
    stiffness : (1, node) or (n_teeth of gear a, node) N/m    over one pitch, or pitch after
        pitch over a turn of gear a, irregular teeth among them; the node that closes a pitch is
        the first of the next
    gap : the same shape, m    static transmission error and pitch errors, by which the teeth
        stand back; default 0
    """
    gaps = np.zeros_like(stiffness)
    if gap is not None:
        gaps = np.broadcast_to(gap, stiffness.shape)
    if stiffness.ndim != 2 or len(stiffness) not in (1, n_teeth[0]):
        raise ConfigError(
            f"mesh '{name}': stiffness {stiffness.shape} must be (1, node) or "
            f"({n_teeth[0]}, node), one row a tooth"
        )
    n_rows = len(stiffness)
    # the mesh has rolled u = i + s where row i is at s, and the next row begins where it ends
    closed, closed_gap = (
        np.hstack([part, np.roll(part[:, :1], -1, axis=0)])
        for part in (stiffness, gaps)
    )
    rows = np.arange(n_rows)[:, None]
    # the mirrored roll reads every row backwards, one tooth further on
    backwards = (rows - 1) % n_rows + n_rows
    return LineMesh(
        name=name,
        direction=direction,
        roll_dof=roll_dof,
        stiffness=np.vstack([closed, closed[:, ::-1]]),
        gap=np.vstack([closed_gap, np.zeros_like(closed_gap)]),
        rows=rows,
        coast_rows=backwards,
        kinds=(np.arange(n_teeth[0]) % n_rows, np.zeros(n_teeth[1], dtype=np.int64)),
        errors=(np.zeros(n_teeth[0]), np.zeros(n_teeth[1])),
        tilts=(np.zeros(n_teeth[0]), np.zeros(n_teeth[1])),
        upright=0.0,
        n_pairs=1,
        first_pitch=0,
        start_teeth=start_teeth,
        start_phase=start_phase,
        mirror=mirror,
        backlash=backlash,
        damping=damping,
    )


def loaded_gap(approach: Array, stiffness: Array, force: float) -> Array:
    """Gap e(u) of a ``phase_mesh`` that statics at one load describe, (phase,) m.

    ``approach`` and tangent ``stiffness`` (phase,) in m and N/m under a ``force`` in N, as
    ``mesh.slices`` gives them for a helical pair: e = approach - F / k, so that the mesh is where
    statics put it under that force.
    """
    return approach - force / stiffness
