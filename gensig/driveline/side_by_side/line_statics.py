"""Deflection of a line of toothed meshes at rest under steady forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.geared_line import GearedLine
from gensig.dynamics.pair import PairDynamics

Array = NDArray[np.float64]

ROUNDS = 20
SAME = 1e-12  # share of the deflection by which it changes in the last round
LEAST = 1e-6  # share of the mean force of its teeth that a mesh carries at least
FREE = 1e-12  # share of the springs that hold a line which turns freely


def line_at_rest(
    line: GearedLine, pairs: Sequence[PairDynamics], angle: float, force: Array
) -> Array:
    """Deflection under forces (dof,) at a nominal angle of the reference in rad, (dof,).

    With the approach d of every mesh under its force F by ``PairDynamics.static``,

        K q + D^T F = force,   D q = d(F)

    is solved by Newton's method from the mean force of every mesh on. A mesh that the forces would
    open stands at the touch of its drive flanks. What the springs and meshes of a free line do not
    balance accelerates it as a rigid body, and it is at rest in that motion.
    """
    stiffness, force = _held(line, force)
    reach = np.stack([mesh.direction for mesh in line.meshes])
    mean = np.array([pair.mesh_force for pair in pairs])
    scale = np.array([pair.mean_mesh_stiffness for pair in pairs])
    carried, q = mean.copy(), np.zeros(len(force))
    for _ in range(ROUNDS):
        turned = line.rotation * angle + q
        states = [
            _static(pair, float(turned[mesh.roll_dof]), load)
            for pair, mesh, load in zip(pairs, line.meshes, carried, strict=True)
        ]
        approach, tangent = np.array(states).T
        # mesh forces as deflections of the mean stiffness, so that all rows are of one size
        pushed = scale[:, None] * reach
        matrix = np.block(
            [[stiffness, pushed.T], [pushed, -np.diag(scale**2 / tangent)]]
        )
        right = np.concatenate([force, scale * (approach - carried / tangent)])
        solution = np.linalg.solve(matrix, right)
        before, q = q, solution[: len(q)]
        carried = np.maximum(scale * solution[len(q) :], LEAST * mean)
        if np.abs(q - before).max() <= SAME * np.abs(q).max():
            break
    return np.asarray(q)


def _held(line: GearedLine, force: Array) -> tuple[Array, Array]:
    """Stiffness and forces of a line that does not turn as a whole."""
    rotation = line.rotation
    size = np.abs(rotation)
    free = rotation @ line.stiffness @ rotation
    if free > FREE * float(size @ np.abs(line.stiffness) @ size):
        return line.stiffness, force
    momentum = line.mass @ rotation
    inertia = float(rotation @ momentum)
    held = line.stiffness + np.outer(momentum, momentum) * (
        np.abs(line.stiffness).max() / np.abs(momentum).max() ** 2
    )
    return held, force - momentum * (float(force @ rotation) / inertia)


def _static(pair: PairDynamics, turned: float, load: float) -> tuple[float, float]:
    """Approach in m and tangent stiffness in N/m of a mesh whose driving gear has turned."""
    roll = pair.start_roll + pair.table.pair.pinion.base_radius * turned
    static = pair.static(pair.states(np.array([roll])), load)
    approach, stiffness = float(static.approach[0]), float(static.stiffness[0])
    if not (np.isfinite(approach) and stiffness > 0.0):  # no tooth is there
        return 0.0, pair.mean_mesh_stiffness
    return approach, stiffness
