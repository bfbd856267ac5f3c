"""Harmonic motion of a linear machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from gensig.arrays import Array, Complex
from gensig.errors import SimulationError

ASYMMETRIC = 1e-9

# More threads of the linear algebra sum in another order; a line that rattles makes another
# motion of the last digit.
single_thread = threadpool_limits.wrap(limits=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearSystem:
    """M q'' + C q' + (K + i H) q = f: four matrices (dof, dof), in kg m2, N m s/rad and N m/rad
    for rotations.

    ``loss`` H is the sum of loss factor times stiffness of the elements; it is meant for harmonic
    motion only.
    """

    mass: Array
    stiffness: Array
    loss: Array
    damping: Array

    def __post_init__(self) -> None:
        n_dof = len(self.mass)
        for name in ("mass", "stiffness", "loss", "damping"):
            matrix = getattr(self, name)
            if matrix.shape != (n_dof, n_dof) or not np.all(np.isfinite(matrix)):
                raise ValueError(
                    f"{name} {matrix.shape} must be a finite matrix ({n_dof}, {n_dof})"
                )
            if np.max(np.abs(matrix - matrix.T)) > ASYMMETRIC * np.max(np.abs(matrix)):
                raise ValueError(f"{name} must be symmetric")

    def dynamic_stiffness(self, frequency: Array) -> Complex:
        """K + i H + i w C - w^2 M, (frequency, dof, dof), at angular frequencies (frequency,)
        rad/s.
        """
        w = np.asarray(frequency, dtype=float)[:, None, None]
        return (
            self.stiffness
            + 1j * (self.loss + w * self.damping)
            - np.square(w) * self.mass
        )

    def response(self, force: Complex, frequency: Array) -> Complex:
        """Complex amplitudes, (frequency, dof), of forces (frequency, dof) at frequencies in
        rad/s, none of them 0.

        Raises
        ------
        SimulationError    where an undamped line is excited at its own frequency
        """
        dynamic = self.dynamic_stiffness(frequency)
        try:
            return np.asarray(np.linalg.solve(dynamic, force[..., None])[..., 0])
        except np.linalg.LinAlgError:
            raise SimulationError(
                "an undamped line is excited at its natural frequency; give it damping"
            ) from None
