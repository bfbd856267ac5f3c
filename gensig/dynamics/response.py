"""A machine as nuisances meet it: shafts of its gears, and its answer to small forces.

Here are the interface and the gear pair; ``gensig.driveline.linear.linear_drive_line`` is a line.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.linear_system import LinearSystem
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import Body, RunningPair
from gensig.units import check_choice

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# motions of a gear that forces act on, in the order of every (..., 3) force
GEAR_AXES = ("x", "y", "rotation")
# From x to y is +1. The pinion turns the other way: its friction moment is -rho F_f for a force
# +F_f along its x.
SENSE = {"pinion": -1.0, "wheel": 1.0}
# Of the greatest eigenvalue. Below it is rounding of motion that does not oscillate.
LEAST_SWING = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class GearShaft:
    """Shaft of one gear at the set-point.

    Parameters
    ----------
    speed : rad/s
    speed_ratio : its speed over that of the pinion, the driving gear of the followed mesh
    set_ratio : its speed over that which the configuration gives
    torque : N m    largest mean torque that a mesh of the gear puts on it
    mesh_force : N    largest mean normal force of the gear's meshes
    sense : +1 where the gear turns from its x to its y, -1 where it turns from y to x
    drives : True for a gear that drives its mesh, False for a driven one
    body : mass, inertia and support of the gear
    """

    speed: float
    speed_ratio: float
    set_ratio: float
    torque: float
    mesh_force: float
    sense: float
    drives: bool
    body: Body


class LinearMachine(ABC):
    """A healthy machine whose meshes are held at their mean stiffness and damping."""

    @abstractmethod
    def shaft(self, gear: str) -> GearShaft:
        """Shaft of a gear of the machine, by its name."""

    @abstractmethod
    def accelerations(
        self, gear: str, frequency: Array, force: Complex, channels: Sequence[str]
    ) -> Complex:
        """Steady answers of channels to harmonic forces on one gear.

        Parameters
        ----------
        frequency : (line,) rad/s    not 0; below 0 against the shaft's sense
        force : (line, 3)    on x and y in N, on the rotation in N m; a force is Re(F e^(i w t))

        Returns
        -------
        (line, channel) in the unit of each channel, complex
        """


def accelerations(dynamics: Dynamics, frequency: Array, force: Complex) -> Complex:
    """Accelerations under harmonic forces, each mesh held at its mean stiffness and damping.

    Parameters
    ----------
    frequency : (line,) rad/s    above 0
    force : (line, dof) N or N m    a force is Re(force e^(i w t))

    Returns
    -------
    (line, dof) m/s2 or rad/s2, complex

    Source: -w^2 (K + i w C - w^2 M)^-1 F of the linear system, K and C with k h h^T and c h h^T of
    every mesh. Assumes forces so small that teeth stay in contact at the same positions.
    """
    stiffness, damping = dynamics.equations.closed(
        dynamics.mesh_stiffness, dynamics.mesh_damping
    )
    line = LinearSystem(
        mass=np.diag(dynamics.equations.mass),
        stiffness=stiffness,
        loss=np.zeros_like(stiffness),
        damping=damping,
    )
    displacement = line.response(force, frequency)
    return np.asarray(-(frequency[:, None] ** 2) * displacement)


def natural_frequencies(dynamics: Dynamics) -> tuple[Array, Array]:
    """Natural frequencies of a machine with its meshes held at their mean stiffness and damping.

    Returns
    -------
    frequency : (mode,) Hz    abs(lambda) / (2 pi) of the motions that oscillate, lowest first
    damping_ratio : (mode,)    -Re(lambda) / abs(lambda), below 1

    Source: eigenvalues lambda of M q'' + C q' + K q = 0, K and C as in ``accelerations``.
    """
    roots = dynamics.equations.rates(dynamics.mesh_stiffness, dynamics.mesh_damping)
    swing = roots[roots.imag > LEAST_SWING * np.abs(roots).max()]
    swing = swing[np.argsort(np.abs(swing), kind="stable")]
    rate = np.abs(swing)
    return rate / (2.0 * np.pi), -swing.real / rate


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LinearPair(LinearMachine):
    """A gear pair whose mesh is held at its mean stiffness and damping."""

    running: RunningPair

    def shaft(self, gear: str) -> GearShaft:
        """As ``LinearMachine.shaft``, of the pinion or the wheel."""
        check_choice("gear", gear, SENSE)
        running, operating, ratio = self.running, self.running.operating, 1.0
        if gear != "pinion":
            ratio = 1.0 / running.table.pair.ratio
        return GearShaft(
            speed=ratio * operating.speed,
            speed_ratio=ratio,
            set_ratio=ratio,
            torque=operating.torque / ratio,
            mesh_force=running.mesh_force,
            sense=SENSE[gear],
            drives=gear == "pinion",
            body={"pinion": running.pinion, "wheel": running.wheel}[gear],
        )

    def accelerations(
        self, gear: str, frequency: Array, force: Complex, channels: Sequence[str]
    ) -> Complex:
        """As ``LinearMachine.accelerations``, by ``accelerations``."""
        dofs = self.running.dofs
        on_dofs = np.zeros((len(frequency), len(dofs)), dtype=np.complex128)
        on_dofs[:, [dofs.index(f"{gear}_{axis}") for axis in GEAR_AXES]] = force
        answer = accelerations(self.running.dynamics, frequency, on_dofs)
        return answer[:, [dofs.index(name) for name in channels]]
