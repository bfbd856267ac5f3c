"""Deflection of a machine at rest under steady forces."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.equations import Equations
from gensig.dynamics.mesh_teeth import MeshTeeth

ROUNDS = 20
SAME = 1e-12  # share of the deflection by which it changes in the last round
LEAST = 1e-6  # share of the mean force of its teeth that a mesh carries at least
STILL = (2.0 * np.pi * 1e-4) ** 2  # 1/s2, far below any drive that holds a mean speed
OUT_OF_BOUNDS = 1e6  # m, rad, m/s or rad/s
FREE = 1e-12  # share of the springs that hold a line which turns freely


def at_rest(
    system: Equations, mean: Array, scale: Array, angle: float, force: Array
) -> Array:
    """Deflection under forces (dof,) at a nominal angle of the reference in rad, (dof,).

    ``mean`` (mesh,) N and ``scale`` (mesh,) N/m are sizes of the forces and stiffnesses of the
    meshes at work. With the approach d of every mesh under its force F by ``MeshTeeth.static``,

        K q + D^T F = force,   D q = d(F)

    is solved by Newton's method. A mesh stands on the flanks that its mean force presses together.
    One that the forces would open stands at their touch. What the springs and meshes of a free line
    do not balance accelerates it as a rigid body, and it is at rest in that motion. Forces on what
    nothing holds deflect it by more than ``OUT_OF_BOUNDS``.
    """
    stiffness, force = _held(system, force)
    n = len(force)
    if not system.meshes:
        return np.asarray(np.linalg.solve(stiffness, force))
    reach = np.stack([mesh.push(n) for mesh in system.meshes])
    sense = np.where([mesh.mean_force < 0.0 for mesh in system.meshes], -1.0, 1.0)
    carried, q = sense * mean, np.zeros(n)
    # mesh forces as deflections of the mean stiffness, so that all rows are of one size
    matrix = np.zeros((n + len(reach), n + len(reach)))
    matrix[:n, :n], matrix[n:, :n] = stiffness, scale[:, None] * reach
    matrix[:n, n:] = matrix[n:, :n].T
    yielding = np.arange(n, len(matrix))
    for _ in range(ROUNDS):
        turned = system.rotation * angle + q
        meshes = zip(system.meshes, carried, scale, strict=True)
        states = [
            _static(mesh.teeth, float(turned[mesh.turn]), load, at_work)
            for mesh, load, at_work in meshes
        ]
        approach, tangent = np.array(states).T
        matrix[yielding, yielding] = -(scale**2) / tangent
        right = np.concatenate([force, scale * (approach - carried / tangent)])
        solution = np.linalg.solve(matrix, right)
        before, q = q, solution[:n]
        carried = sense * np.maximum(sense * scale * solution[n:], LEAST * mean)
        if np.abs(q - before).max() <= SAME * np.abs(q).max():
            break
    return np.asarray(q)


def _is_free(system: Equations) -> bool:
    """True for a line whose rotation as a whole no spring holds."""
    rotation, stiffness = system.rotation, system.governed_stiffness
    size = np.abs(rotation)
    held = float(rotation @ stiffness @ rotation)
    return held <= FREE * float(size @ np.abs(stiffness) @ size)


def _balanced(system: Equations, force: Array) -> Array:
    """Forces (dof,) less those that accelerate the line as a rigid body."""
    momentum = system.mass * system.rotation
    inertia = float(momentum @ system.rotation)
    return np.asarray(force - momentum * (float(force @ system.rotation) / inertia))


def _held(system: Equations, force: Array) -> tuple[Array, Array]:
    """Stiffness and forces of a line that does not turn as a whole.

    What dampers alone hold, as the ring of a damper, stands still on next to no spring.
    """
    stiffness = system.governed_stiffness + STILL * np.diag(system.mass)
    if not _is_free(system):
        return stiffness, force
    momentum = system.mass * system.rotation
    # of the size of the springs, or any where meshes are all that is elastic
    size = float(np.abs(system.governed_stiffness).max()) or 1.0
    share = momentum / np.abs(momentum).max()
    held = stiffness + size * np.outer(share, share)
    return held, _balanced(system, force)


def _static(
    teeth: MeshTeeth, turned: float, load: float, at_work: float
) -> tuple[float, float]:
    """Approach in m and tangent stiffness in N/m of a mesh whose driving gear has turned.

    Its back flanks touch under a negative load. Where no tooth is there the stiffness is that
    ``at_work``.
    """
    rolls = np.array([teeth.start_roll + teeth.pair.pinion.base_radius * turned])
    sense, offset = 1.0, 0.0
    if load < 0.0:
        sense, offset = -1.0, -teeth.pair.backlash
        rolls, teeth = teeth.mirrored(rolls), teeth.healthy
    static = teeth.static(teeth.states(rolls), abs(load))
    approach, stiffness = float(static.approach[0]), float(static.stiffness[0])
    if not (np.isfinite(approach) and stiffness > 0.0):
        return offset, at_work
    return offset + sense * approach, stiffness
