"""A drive line in motion: its bodies, meshes, nominal rotation and torques."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.linear.forced import SteadyResponse
from gensig.driveline.time.course import LineCourse, ShaftTorque
from gensig.driveline.time.line_checks import check_system, check_torques
from gensig.driveline.time.line_statics import line_at_rest
from gensig.dynamics.equations import Dynamics, Equations, OverAngle
from gensig.dynamics.mesh_teeth import MeshTeeth

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LineDynamics(Dynamics):
    """All parameters of the motion of one line.

    No slots: what follows from them is cached.

    Parameters
    ----------
    names : of the degrees of freedom
    system : bodies, springs and meshes; torques over an angle follow from ``torques``
    nominal : rotation of the reference
    friction_torque : (dof,) N m    what the drive gives to make up for the mean friction of the
        meshes; statics know neither
    reference_force : (mesh,) N    at which contact and damping of the meshes are taken
    vibration : steady vibration at the first speed if no mesh parts; None for none
    turned : rad    angle of the reference in its cycle at time 0
    """

    names: tuple[str, ...]
    system: Equations
    nominal: LineCourse
    torques: tuple[ShaftTorque, ...]
    friction_torque: Array
    reference_force: Array
    vibration: SteadyResponse | None = None
    turned: float = 0.0

    def __post_init__(self) -> None:
        check_system(self.names, self.system)
        n_knots = len(self.nominal.time)
        check_torques(self.names, self.system, self.torques, n_knots)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self.names

    @property
    def teeth(self) -> tuple[MeshTeeth, ...]:
        """The teeth of every mesh."""
        return tuple(mesh.teeth for mesh in self.system.meshes)

    @cached_property
    def equations(self) -> Equations:
        """As ``Dynamics.equations``."""
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
    def is_steady(self) -> bool:
        """True where neither speed nor torques change."""
        return len(self.nominal.time) == 1

    def course(self, times: Array) -> tuple[Array, Array]:
        """As ``Dynamics.course``."""
        return self.nominal.nominal(times)

    @cached_property
    def mesh_stiffness(self) -> Array:
        """Mean stiffness of every mesh under its reference force, (mesh,) N/m."""
        meshes = zip(self.teeth, self.reference_force.tolist(), strict=True)
        return np.array([teeth.mean_stiffness(force) for teeth, force in meshes])

    @cached_property
    def rest(self) -> Array:
        """Deflection about which the line moves, its reference not turned, (dof,)."""
        start, rotation = self.static_start(0.0), self.system.rotation
        return np.asarray(start - rotation * start[self.system.reference])

    def start(self, time: float) -> tuple[Array, Array]:
        """As ``Dynamics.start``; of a line with sources the linear vibration is on it.

        That vibration is the answer to the sources if no mesh parts.
        """
        still = self.static_start(time)
        if not self.sources:
            return still, np.zeros(len(still))
        angle, rate = self.vibration_at(time)
        return still + angle, rate

    def vibration_at(self, time: float) -> tuple[Array, Array]:
        """Linear vibration and its rate at a nominal time, (dof,) each; 0 without any."""
        if self.vibration is None:
            return np.zeros(len(self.names)), np.zeros(len(self.names))
        angle, speed = self.nominal.nominal(np.array([time]))
        orders, phasors = self.vibration.orders, self.vibration.angle
        turned = np.exp(1j * orders * (self.turned + float(angle[0])))
        rates = 1j * orders * float(speed[0]) * phasors
        return np.real(phasors @ turned), np.real(rates @ turned)

    def static_start(self, time: float) -> Array:
        """Deflection under the mean torques at a nominal time, without friction, (dof,).

        Under a nominal acceleration it is that of the accelerated line.
        """
        angle = float(self.nominal.nominal(np.array([time]))[0][0])
        at_work = self.reference_force, self.mesh_stiffness
        return line_at_rest(self.system, *at_work, angle, self.mean_forces(time))

    def mean_forces(self, time: float) -> Array:
        """Means of the torques over their angles at a nominal time, (dof,).

        Less the inertia forces of a nominal acceleration; friction is left out.
        """
        accelerated = self.system.mass * self.system.rotation
        mean = self._torques(self.torques, np.array([time]))[0]
        return np.asarray(mean - accelerated * self.nominal.acceleration(time))

    @property
    def sources(self) -> tuple[ShaftTorque, ...]:
        """Torques that follow the angle of a shaft."""
        return tuple(t for t in self.torques if len(t.table) > 1)

    def _sense(self, dof: int) -> float:
        """1 where an angle counts as it nominally rotates, or of a translation, else -1."""
        return math.copysign(1.0, float(self.system.rotation[dof]))

    def factors(self, times: Array) -> Array:
        """Factors of the sources at times in s, (time, source)."""
        factors = [self._factor(source, times) for source in self.sources]
        return np.array(factors).reshape(-1, len(times)).T

    def forces(self, times: Array) -> Array:
        """Torques and forces that follow no angle, on the degrees of freedom, (time, dof)."""
        steady = [t for t in self.torques if len(t.table) == 1]
        return self._torques(steady, times) + self.friction_torque

    def _torques(self, torques: Sequence[ShaftTorque], times: Array) -> Array:
        """Means of torques over their angle at times in s, (time, dof)."""
        forces = np.zeros((len(times), len(self.dofs)))
        for torque in torques:
            mean = self._sense(torque.dof) * float(torque.table.mean())
            forces[:, torque.dof] += mean * self._factor(torque, times)
        return forces

    def _factor(self, torque: ShaftTorque, times: Array) -> Array:
        if torque.factor is None:
            return np.ones(len(times))
        return np.interp(times, self.nominal.time, torque.factor)
