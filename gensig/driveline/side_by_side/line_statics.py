"""Deflection of a line of toothed meshes at rest under steady forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.geared_line import GearedLine
from gensig.dynamics.mesh_teeth import MeshTeeth

Array = NDArray[np.float64]

ROUNDS = 20
SAME = 1e-12  # share of the deflection by which it changes in the last round
LEAST = 1e-6  # share of the mean force of its teeth that a mesh carries at least
FREE = 1e-12  # share of the springs that hold a line which turns freely


def line_at_rest(
    line: GearedLine,
    teeth: Sequence[MeshTeeth],
    mean: Array,
    scale: Array,
    angle: float,
    force: Array,
) -> Array:
    """Deflection under forces (dof,) at a nominal angle of the reference in rad, (dof,).

    ``mean`` (mesh,) N and ``scale`` (mesh,) N/m are forces and stiffnesses of the meshes at work.
    With the approach d of every mesh under its force F by ``MeshTeeth.static``,

        K q + D^T F = force,   D q = d(F)

    is solved by Newton's method from the mean force of every mesh on. A mesh that the forces would
    open stands at the touch of its drive flanks. What the springs and meshes of a free line do not
    balance accelerates it as a rigid body, and it is at rest in that motion.
    """
    stiffness, force = _held(line, force)
    reach = np.stack([mesh.direction for mesh in line.meshes])
    carried, q = mean.copy(), np.zeros(len(force))
    for _ in range(ROUNDS):
        turned = line.rotation * angle + q
        states = [
            _static(of_mesh, float(turned[mesh.roll_dof]), load, stiffness)
            for of_mesh, mesh, load, stiffness in zip(
                teeth, line.meshes, carried, scale, strict=True
            )
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


def _static(
    teeth: MeshTeeth, turned: float, load: float, at_work: float
) -> tuple[float, float]:
    """Approach in m and tangent stiffness in N/m of a mesh whose driving gear has turned.

    Where no tooth is there the stiffness is that ``at_work``.
    """
    roll = teeth.start_roll + teeth.pair.pinion.base_radius * turned
    static = teeth.static(teeth.states(np.array([roll])), load)
    approach, stiffness = float(static.approach[0]), float(static.stiffness[0])
    if not (np.isfinite(approach) and stiffness > 0.0):
        return 0.0, at_work
    return approach, stiffness
