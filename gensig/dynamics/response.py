"""Linear frequency response of a gear pair to small forces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.pair import PairDynamics

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def accelerations(dynamics: PairDynamics, frequency: Array, force: Complex) -> Complex:
    """Accelerations under harmonic forces, with the mesh held at its mean stiffness and damping.

    Parameters
    ----------
    frequency : (line,) rad/s    above 0
    force : (line, dof) N or N m    a force is Re(force e^(i w t))

    Returns
    -------
    (line, dof) m/s2 or rad/s2, complex

    Source: -w^2 (K + i w C - w^2 M)^-1 F of the linear system, K and C with the mesh's k h h^T
    and c h h^T. Assumes forces so small that teeth stay in contact at the same positions.
    """
    system, direction = dynamics.system(), dynamics.approach_direction()
    mesh = np.outer(direction, direction)
    w = np.asarray(frequency, dtype=np.float64)[:, None, None]
    stiffness = system.stiffness + dynamics.mean_mesh_stiffness * mesh
    damping = system.damping + dynamics.mesh_damping * mesh
    dynamic = stiffness - w**2 * np.diag(system.mass) + 1j * w * damping
    displacement = np.linalg.solve(dynamic, force[:, :, None])[:, :, 0]
    return np.asarray(-(w[:, :, 0] ** 2) * displacement)
