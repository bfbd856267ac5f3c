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
