"""A machine in motion: its equations, nominal rotation and torques."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, final

import numpy as np

from gensig.arrays import Array, Complex
from gensig.dynamics.equations import Equations, OverAngle
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.at_rest import OUT_OF_BOUNDS, at_rest
from gensig.dynamics.motion.course import Course, ShaftTorque
from gensig.dynamics.motion.motion_checks import check_system, check_torques
from gensig.errors import SimulationError

LONGEST_SETTLING = 0.45  # s
MOST_NAMED = 3  # degrees of freedom in an error
SETTLED = 1e-4  # share of the start's transient that is left
STIFFER = 1.2  # than their mean stiffness are meshes taken for the longest step


class Vibration(Protocol):
    """A steady vibration: its orders (order,) of the reference, and complex angles (dof, order)."""

    @property
    def orders(self) -> Array:
        """Orders of the reference, (order,)."""

    @property
    def angle(self) -> Complex:
        """Complex amplitudes, (dof, order) rad or m."""


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class Dynamics:
    """All parameters of the motion of one machine: a gear pair, or a line of several meshes.

    No slots: what follows from them is cached.

    Parameters
    ----------
    dofs : names of the degrees of freedom, in the order of every (dof,) array
    system : bodies, springs and meshes; torques over an angle follow from ``torques``
    nominal : rotation of the reference
    friction_torque : (dof,) N m    what the drive gives to make up for the mean friction of the
        meshes; statics leave out both
    reference_force : (mesh,) N    at which contact and damping of the meshes are taken
    vibration : steady vibration at the first speed if no mesh parts; None for none
    turned : rad    angle of the reference in its cycle at time 0
    """

    dofs: tuple[str, ...]
    system: Equations
    nominal: Course
    torques: tuple[ShaftTorque, ...]
    friction_torque: Array
    reference_force: Array
    vibration: Vibration | None = None
    turned: float = 0.0

    def __post_init__(self) -> None:
        check_system(self.dofs, self.system)
        check_torques(self.dofs, self.system, self.torques, self.nominal.n_knots)

    @property
    def teeth(self) -> tuple[MeshTeeth, ...]:
        """The teeth of every mesh."""
        return tuple(mesh.teeth for mesh in self.system.meshes)

    @cached_property
    def equations(self) -> Equations:
        """The machine as numbers, with its torques over an angle."""
        sources = tuple(self._over_angle(torque) for torque in self.sources)
        return replace(self.system, sources=sources)

    def _over_angle(self, torque: ShaftTorque) -> OverAngle:
        per_rad = len(torque.table) / torque.period
        return OverAngle(
            dof=torque.dof,
            turned_by=torque.turning,
            nodes=self._sense(torque.dof) * torque.table,
            per_rad=self._sense(torque.turning) * per_rad,
            shift=torque.phase * per_rad,
        )

    @property
    def mesh_stiffness(self) -> Array:
        """Mean stiffness of every mesh under its reference force, (mesh,) N/m."""
        return np.array([mesh.stiffness for mesh in self.system.meshes])

    @property
    def mesh_damping(self) -> Array:
        """Damping of every mesh under its reference force, (mesh,) N s/m."""
        meshes = zip(self.system.meshes, self.reference_force.tolist(), strict=True)
        return np.array([mesh.damping_under(force) for mesh, force in meshes])

    @cached_property
    def rest(self) -> Array:
        """Deflection about which the machine moves, its reference not turned, (dof,)."""
        start, rotation = self.static_start(0.0), self.system.rotation
        return np.asarray(start - rotation * start[self.system.reference])

    def check_rest(self) -> None:
        """Raise SimulationError for torques and forces on what nothing holds."""
        _ = self.rest

    def start(self, time: float) -> tuple[Array, Array]:
        """Deflections and their rates from which a motion settles at a nominal time, (dof,) each.

        At rest; of a machine with sources the linear vibration is on it, their answer if no mesh
        parts.
        """
        still = self.static_start(time)
        if not self.sources:
            return still, np.zeros(len(still))
        angle, rate = self.vibration_at(time)
        return still + angle, rate

    def vibration_at(self, time: float) -> tuple[Array, Array]:
        """Linear vibration and its rate at a nominal time, (dof,) each; 0 without any."""
        if self.vibration is None:
            return np.zeros(len(self.dofs)), np.zeros(len(self.dofs))
        now = self.nominal.at(time)
        orders, phasors = self.vibration.orders, self.vibration.angle
        turned = np.exp(1j * orders * (self.turned + now.angle))
        rates = 1j * orders * now.speed * phasors
        return np.real(phasors @ turned), np.real(rates @ turned)

    def static_start(self, time: float) -> Array:
        """Deflection under the mean torques at a nominal time, without friction, (dof,).

        Under a nominal acceleration it is that of the accelerated machine.

        Raises
        ------
        SimulationError    for torques and forces on what nothing holds
        """
        system, now = self.system, self.nominal.at(time)
        force = self._torques(self.torques, np.array([time]))[0]
        force -= system.mass * system.rotation * now.acceleration
        at_work = self.reference_force, self.mesh_stiffness
        still = at_rest(system, *at_work, now.angle, force)
        loose = np.flatnonzero(~(np.abs(still) < OUT_OF_BOUNDS))
        if len(loose):
            names = ", ".join(self.dofs[dof] for dof in loose[:MOST_NAMED])
            raise SimulationError(
                f"the machine does not come to rest under its mean torques ({names}); check "
                "torques, and springs and supports that hold it"
            )
        return still

    @property
    def sources(self) -> tuple[ShaftTorque, ...]:
        """Torques that follow the angle of a shaft."""
        return tuple(t for t in self.torques if len(t.table) > 1)

    def _sense(self, dof: int) -> float:
        """1 where an angle counts as it nominally rotates, or of a translation, else -1."""
        return math.copysign(1.0, float(self.system.rotation[dof]))

    def factors(self, times: Array) -> Array:
        """Factors of the sources at times in s, (time, source)."""
        factors = [self.nominal.share(each.factor, times) for each in self.sources]
        return np.array(factors).reshape(-1, len(times)).T

    def forces(self, times: Array) -> Array:
        """Torques and forces that follow no angle, on the degrees of freedom, (time, dof)."""
        steady = [t for t in self.torques if len(t.table) == 1]
        friction = np.outer(self.nominal.share(None, times), self.friction_torque)
        return self._torques(steady, times) + friction

    def _torques(self, torques: Sequence[ShaftTorque], times: Array) -> Array:
        """Means of torques over their angle at times in s, (time, dof)."""
        forces = np.zeros((len(times), len(self.dofs)))
        common = self.nominal.share(None, times)
        for torque in torques:
            mean, share = self._sense(torque.dof) * float(torque.table.mean()), common
            if torque.factor is not None:
                share = self.nominal.share(torque.factor, times)
            forces[:, torque.dof] += mean * share
        return forces

    @cached_property
    def stiff_rates(self) -> Complex:
        """Eigenvalues that the steps must follow: of meshes stiffer than their mean, 1/s."""
        return self.equations.rates(STIFFER * self.mesh_stiffness)

    @cached_property
    def settling_time(self) -> float:
        """Time in which the slowest motion that is held falls to 1e-4 (longest 0.45 s), s."""
        decay = -np.real(self.equations.rates(self.mesh_stiffness))
        slowest = float(decay[decay > 1e-3].min(initial=np.inf))
        return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / slowest)

    @property
    def stiffest_motion(self) -> str:
        """Degree of freedom that springs, dampers and meshes hold hardest for its mass."""
        equations = self.equations
        spring, damper = np.diag(equations.stiffness), np.diag(equations.damping)
        held = spring + equations.held**2
        damped = damper + equations.held_damping * equations.held**2
        for mesh, stiffness in zip(equations.meshes, self.mesh_stiffness, strict=True):
            held = held + stiffness * mesh.push(len(held)) ** 2
        rates = np.sqrt(held / equations.mass), damped / equations.mass
        return self.dofs[int(np.argmax(np.maximum(*rates)))]
