"""Lumped linear system around its meshes: M q'' + C q' + K q = f + mesh forces."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.errors import SimulationError

Array = NDArray[np.float64]

LONGEST_SETTLING = 0.45  # s
SETTLED = 1e-4  # share of the start's transient that is left


@dataclass(frozen=True, slots=True, kw_only=True)
class LumpedSystem:
    """Masses, springs, dampers and forces; rotations are deviations from the nominal rotation.

    ``mass`` (dof,) kg or kg m2, ``stiffness`` and ``damping`` (dof, dof); ``force`` (dof,) at the
    set torque, all of it follows a torque profile. ``rotation`` (dof,) is the rotation of each
    with the nominal rotation of the pinion, 0 for a translation: under its acceleration the
    equations get the inertia force -mass * rotation * acceleration. ``names`` are the degrees of
    freedom, and the names of channels.
    """

    names: tuple[str, ...]
    mass: Array
    stiffness: Array
    damping: Array
    force: Array
    rotation: Array

    def __post_init__(self) -> None:
        if np.any(self.mass <= 0.0):
            worst = self.names[int(np.argmin(self.mass))]
            raise SimulationError(f"the mass or inertia of '{worst}' must be positive")
        for name, matrix in (("stiffness", self.stiffness), ("damping", self.damping)):
            if not np.allclose(matrix, matrix.T, rtol=1e-12, atol=0.0):
                raise SimulationError(f"the {name} matrix is not symmetric")
            scale = max(1.0, float(np.abs(matrix).max()))
            if np.linalg.eigvalsh(matrix).min() < -1e-9 * scale:
                raise SimulationError(
                    f"the {name} matrix would feed energy in; check the signs of the supports"
                )


def eigenvalues(
    system: LumpedSystem, direction: Array, mesh_stiffness: float
) -> NDArray[np.complex128]:
    """Eigenvalues in 1/s of the system with its mesh held at one stiffness.

    ``direction`` (dof,) is the gradient of the approach.
    """
    n, mesh = len(system.mass), np.outer(direction, direction)
    k = (system.stiffness + mesh_stiffness * mesh) / system.mass[:, None]
    c = system.damping / system.mass[:, None]
    state = np.zeros((2 * n, 2 * n))
    state[:n, n:] = np.eye(n)
    state[n:, :n], state[n:, n:] = -k, -c
    return np.linalg.eigvals(state).astype(np.complex128)


def slowest_decay(
    system: LumpedSystem, direction: Array, mesh_stiffness: float
) -> float:
    """Slowest decay rate in 1/s of the system with its mesh held at a mean stiffness.

    ``direction`` (dof,) is the gradient of the approach. Rigid-body motion without restoring
    force is left out.
    """
    rates = -np.real(eigenvalues(system, direction, mesh_stiffness))
    return float(rates[rates > 1e-3].min(initial=np.inf))


def settling_time(slowest: float) -> float:
    """Time in which motion of the slowest decay rate in 1/s falls to 1e-4 (longest 0.45 s), s."""
    return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / slowest)


def stiffest_motion(
    system: LumpedSystem, direction: Array, mesh_stiffness: float
) -> str:
    """Degree of freedom that springs, dampers and the mesh hold hardest for its mass.

    ``direction`` (dof,) is the gradient of the approach.
    """
    held = np.diag(system.stiffness) + mesh_stiffness * direction**2
    damped = np.diag(system.damping) / system.mass
    return system.names[int(np.argmax(np.maximum(np.sqrt(held / system.mass), damped)))]
