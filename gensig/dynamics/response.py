"""A machine as nuisances meet it: shafts of its gears, and its answer to small forces.

Of a gear pair by ``linear_pair``, of a line by ``gensig.driveline.linear.linear_drive_line``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from gensig.arrays import Array, Complex
from gensig.dynamics.linear_system import LinearSystem, single_thread
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import Body, RunningPair
from gensig.units import SPEED, check_choice

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
    dofs : degrees of freedom of the gear's x, y and rotation
    """

    speed: float
    speed_ratio: float
    set_ratio: float
    torque: float
    mesh_force: float
    sense: float
    drives: bool
    body: Body
    dofs: tuple[int, int, int]


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearMachine:
    """A healthy machine whose meshes are held at their mean stiffness and damping.

    Parameters
    ----------
    system : its bodies, a spring and a damper in every mesh
    shafts : of its gears, by their names
    channels : degree of freedom of every channel, by its name; that of a toothed wheel answers with
        its speed, without the errors of its teeth
    """

    system: LinearSystem
    shafts: Mapping[str, GearShaft]
    channels: Mapping[str, int]

    def shaft(self, gear: str) -> GearShaft:
        """Shaft of a gear of the machine, by its name."""
        check_choice("gear", gear, self.shafts)
        return self.shafts[gear]

    @single_thread
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
        once, place = np.unique(frequency, return_inverse=True)
        unit = np.zeros((len(once), len(self.system.mass)), dtype=np.complex128)
        answer = np.zeros((len(frequency), len(channels)), dtype=np.complex128)
        rows = [self.channels[name] for name in channels]
        is_speed = np.array([name.endswith(SPEED) for name in channels])
        for axis, dof in enumerate(self.shaft(gear).dofs):
            unit[:] = 0.0
            unit[:, dof] = 1.0
            motion = self.system.response(unit, once)[:, rows]
            rate = 1j * once[:, None] * motion
            seen = np.where(is_speed, rate, 1j * once[:, None] * rate)
            answer += force[:, axis, None] * seen[place]
        return answer


def linear_pair(running: RunningPair) -> LinearMachine:
    """A gear pair with its mesh at its mean stiffness and damping."""
    operating, dofs = running.operating, running.dofs
    bodies = {"pinion": running.pinion, "wheel": running.wheel}
    ratios = {"pinion": 1.0, "wheel": 1.0 / running.table.pair.ratio}
    shafts = {}
    for gear, body in bodies.items():
        x, y, rotation = (dofs.index(f"{gear}_{axis}") for axis in GEAR_AXES)
        shafts[gear] = GearShaft(
            speed=ratios[gear] * operating.speed,
            speed_ratio=ratios[gear],
            set_ratio=ratios[gear],
            torque=operating.torque / ratios[gear],
            mesh_force=running.mesh_force,
            sense=SENSE[gear],
            drives=gear == "pinion",
            body=body,
            dofs=(x, y, rotation),
        )
    return LinearMachine(
        system=closed_system(running.dynamics),
        shafts=shafts,
        channels={name: dof for dof, name in enumerate(dofs)},
    )


def closed_system(dynamics: Dynamics) -> LinearSystem:
    """A machine with a spring and a damper of their mean sizes in its meshes."""
    stiffness, damping = dynamics.equations.closed(
        dynamics.mesh_stiffness, dynamics.mesh_damping
    )
    return LinearSystem(
        mass=np.diag(dynamics.equations.mass),
        stiffness=stiffness,
        loss=np.zeros_like(stiffness),
        damping=damping,
    )


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
    displacement = closed_system(dynamics).response(force, frequency)
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
