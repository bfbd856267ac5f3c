"""Checks of a machine's numbers: its motion must be one that a machine can have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gensig.dynamics.equations import A_TURN, NONE, Equations, Mesh
from gensig.dynamics.motion.course import ShaftTorque
from gensig.errors import ConfigError, SimulationError

# of its terms, by which nominal rotation may close a mesh: radii come rounded
CLOSING = 1e-6
SYMMETRIC = 1e-9


def check_system(names: tuple[str, ...], system: Equations) -> None:
    """Raise for matrices that feed energy in, and for meshes that the rotation closes.

    Raises
    ------
    ConfigError        for shapes, and for meshes that contradict the speed ratios
    SimulationError    for masses, dampers and springs of the wrong sign
    """
    n = len(names)
    for what in ("damping", "stiffness"):
        matrix = getattr(system, what)
        if matrix.shape != (n, n) or not np.isfinite(matrix).all():
            raise ConfigError(
                f"line: the {what} matrix {matrix.shape} must be ({n}, {n}), all finite"
            )
        if np.any(np.abs(matrix - matrix.T) > SYMMETRIC * np.abs(matrix)):
            raise SimulationError(f"line: the {what} matrix is not symmetric")
        least = float(np.linalg.eigvalsh(matrix).min())
        if least < -SYMMETRIC * float(np.abs(matrix).max()):
            raise SimulationError(
                f"line: the {what} matrix would feed energy in; check the signs of its entries"
            )
    for what in ("mass", "rotation"):
        values = getattr(system, what)
        if values.shape != (n,) or not np.isfinite(values).all():
            raise ConfigError(
                f"line: {what} {values.shape} must be ({n},), one a degree of freedom"
            )
    lightest = int(np.argmin(system.mass))
    if not system.mass[lightest] > 0.0:
        raise SimulationError(
            f"line: the mass or inertia of '{names[lightest]}' must be positive"
        )
    for mesh in system.meshes:
        _check_mesh(mesh, system)


def check_torques(
    names: tuple[str, ...],
    system: Equations,
    torques: Sequence[ShaftTorque],
    n_knots: int,
) -> None:
    """Raise ConfigError for torques that a line of so many knots of its course cannot have."""
    n = len(names)
    for number, torque in enumerate(torques):
        for dof in (torque.dof, torque.turning):
            if not 0 <= dof < n:
                raise ConfigError(
                    f"torque {number}: degree of freedom {dof} must lie in 0..{n - 1}"
                )
        name = f"torque on '{names[torque.dof]}'"
        if len(torque.table) > 1 and system.rotation[torque.turning] == 0.0:
            raise ConfigError(
                f"{name}: a table over the angle of '{names[torque.turning]}' needs a degree of "
                "freedom that turns; give one number, or turned_by"
            )
        if torque.factor is not None and torque.factor.shape != (n_knots,):
            raise ConfigError(
                f"{name}: factor {torque.factor.shape} must be ({n_knots},), the course's knots"
            )


def _check_mesh(mesh: Mesh, system: Equations) -> None:
    n = len(system.rotation)
    touched = mesh.touched[mesh.touched != NONE]
    if not np.isin(touched, np.arange(n)).all():
        raise ConfigError(
            f"mesh '{mesh.name}': it acts on degrees of freedom {touched.tolist()}, which "
            f"must lie in 0..{n - 1}"
        )
    if mesh.turn == NONE or system.rotation[mesh.turn] * mesh.reach[A_TURN] == 0.0:
        raise ConfigError(
            f"mesh '{mesh.name}': its gear a must turn, and come closer as it does"
        )
    closing = mesh.push(n) * system.rotation
    if abs(closing.sum()) > CLOSING * np.abs(closing).sum():
        raise ConfigError(
            f"mesh '{mesh.name}': nominal rotation closes it by {closing.sum():g} m/rad; its base "
            "radii contradict the speed ratios"
        )
