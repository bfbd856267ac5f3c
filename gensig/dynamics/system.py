"""Lumped linear system around its meshes: M q'' + C q' + K q = f + mesh forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.errors import SimulationError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LumpedSystem:
    """Masses, springs, dampers and forces; rotations are deviations from the nominal rotation.

    ``mass`` (dof,) kg or kg m2, ``stiffness`` and ``damping`` (dof, dof); ``force`` (dof,) at the
    set torque, all of it follows a torque profile. ``rotation`` (dof,) says how far each turns
    with the nominal rotation of the pinion, 0 for a translation: under its acceleration the
    equations get the inertia force -mass * rotation * acceleration. ``names`` name the degrees of
    freedom, as channels call them.
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
        for matrix, what in ((self.stiffness, "stiffness"), (self.damping, "damping")):
            if not np.allclose(matrix, matrix.T, rtol=1e-12, atol=0.0):
                raise SimulationError(f"the {what} matrix is not symmetric")
            if np.linalg.eigvalsh(matrix).min() < -1e-9 * max(
                1.0, float(np.abs(matrix).max())
            ):
                raise SimulationError(
                    f"the {what} matrix would feed energy in; check the signs of the supports"
                )


def eigenvalues(
    system: LumpedSystem, direction: Array, mesh_stiffness: float
) -> NDArray[np.complex128]:
    """Eigenvalues in 1/s of the system with its mesh held at one stiffness.

    ``direction`` (dof,) is the gradient of the approach.
    """
    n = len(system.mass)
    k = (
        system.stiffness + mesh_stiffness * np.outer(direction, direction)
    ) / system.mass[:, None]
    c = system.damping / system.mass[:, None]
    return np.linalg.eigvals(
        np.block([[np.zeros((n, n)), np.eye(n)], [-k, -c]])
    ).astype(np.complex128)


def slowest_decay(
    system: LumpedSystem, direction: Array, mesh_stiffness: float
) -> float:
    """Slowest decay rate in 1/s of the system with its mesh held at a mean stiffness.

    ``direction`` (dof,) is the gradient of the approach. Rigid-body motion without restoring
    force is left out.
    """
    rates = -np.real(eigenvalues(system, direction, mesh_stiffness))
    moving = rates[rates > 1e-3]
    return float(moving.min()) if len(moving) else np.inf
