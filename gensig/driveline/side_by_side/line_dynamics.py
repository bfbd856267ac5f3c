"""The motion of one line of toothed meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.running import RunningLine, touched_dofs, turning_sense
from gensig.driveline.side_by_side.line_statics import line_at_rest
from gensig.driveline.time.course import ShaftTorque
from gensig.driveline.time.mesh_friction import slide_direction
from gensig.dynamics.equations import (
    A_TURN,
    NONE,
    Dynamics,
    Equations,
    Mesh,
    OverAngle,
)
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.errors import SimulationError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LineDynamics(Dynamics):
    """All parameters of the motion of one line of toothed meshes.

    No slots: what follows from them is cached.

    Parameters
    ----------
    running : the line with its course, torques and mean mesh forces
    teeth : the teeth of every mesh
    touched : (mesh, 6) degrees of freedom of x, y and rotation of gear a and of gear b, -1 for a
        gear that does not move so
    senses : (mesh,) 1 where gear a turns from x to y, else -1
    angles : degrees of freedom whose angles are given out
    """

    running: RunningLine
    teeth: tuple[MeshTeeth, ...]
    touched: Index
    senses: Array
    angles: tuple[int, ...]

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self.running.line.names

    @cached_property
    def equations(self) -> Equations:
        """As ``Dynamics.equations``."""
        line = self.running.line
        held = np.zeros(len(line.names)) if line.held is None else line.held
        rigid = np.outer(held, held)
        return Equations(
            mass=np.diag(line.mass),
            stiffness=line.stiffness - rigid,
            damping=line.damping - line.held_damping * rigid,
            rotation=line.rotation,
            held=held,
            held_damping=line.held_damping,
            meshes=tuple(self._mesh(m) for m in range(len(self.teeth))),
            sources=tuple(self._over_angle(torque) for torque in self.sources),
            reference=self.reference,
            angles=self.angles,
        )

    def _mesh(self, m: int) -> Mesh:
        running, mesh, dofs = (
            self.running,
            self.running.line.meshes[m],
            self.touched[m],
        )
        slide = slide_direction(mesh.direction, dofs, self.senses[m])
        is_there = dofs != NONE
        turning = abs(float(running.line.rotation[dofs[A_TURN]]))
        return Mesh(
            teeth=self.teeth[m],
            touched=dofs,
            reach=np.where(is_there, mesh.direction[dofs], 0.0),
            slide=np.where(is_there, slide[dofs], 0.0),
            damping=mesh.damping,
            mean_force=float(running.mesh_force[m]),
            speed=turning * float(running.course.speed[0]),
        )

    def _over_angle(self, torque: ShaftTorque) -> OverAngle:
        sense, n_nodes = self._sense(torque), len(torque.table)
        per_rad = n_nodes / torque.period
        return OverAngle(
            dof=torque.dof,
            turned_by=torque.dof,
            nodes=sense * torque.table,
            per_rad=sense * per_rad,
            shift=torque.phase * per_rad,
        )

    @property
    def is_steady(self) -> bool:
        """True where neither speed nor torques change."""
        return len(self.running.course.time) == 1

    def course(self, times: Array) -> tuple[Array, Array]:
        """As ``Dynamics.course``."""
        return self.running.course.nominal(times)

    @cached_property
    def mesh_stiffness(self) -> Array:
        """Mean stiffness of every mesh under its reference force, (mesh,) N/m."""
        forces = self.running.reference_force
        meshes = zip(self.teeth, forces.tolist(), strict=True)
        return np.array([teeth.mean_stiffness(force) for teeth, force in meshes])

    @cached_property
    def rest(self) -> Array:
        """Deflection about which the line moves, its reference not turned, (dof,)."""
        start, rotation = self.static_start(0.0), self.running.line.rotation
        return np.asarray(start - rotation * start[self.reference])

    @property
    def reference(self) -> int:
        """Degree of freedom that turns with the reference."""
        return int(np.argmin(np.abs(self.running.line.rotation - 1.0)))

    def start(self, time: float) -> tuple[Array, Array]:
        """As ``Dynamics.start``; of a line with sources the linear vibration is on it.

        That vibration is the answer to the sources if no mesh parts.
        """
        still = self.static_start(time)
        if not self.sources:
            return still, np.zeros(len(still))
        running = self.running
        angle, speed = running.course.nominal(np.array([time]))
        orders, phasors = running.linear.orders, running.linear.angle
        turned = np.exp(1j * orders * (running.turned + float(angle[0])))
        rates = 1j * orders * float(speed[0]) * phasors
        return still + np.real(phasors @ turned), np.real(rates @ turned)

    def static_start(self, time: float) -> Array:
        """Deflection under the mean torques at a nominal time, without friction, (dof,).

        Under a nominal acceleration it is that of the accelerated line.
        """
        line, course = self.running.line, self.running.course
        times = np.array([time])
        angle = float(course.nominal(times)[0][0])
        force = self._torques(self.running.torques, times)[0]
        force -= line.mass @ line.rotation * course.acceleration(time)
        mean = self.running.reference_force
        return line_at_rest(line, self.teeth, mean, self.mesh_stiffness, angle, force)

    @property
    def sources(self) -> tuple[ShaftTorque, ...]:
        """Torques that follow the angle of their degree of freedom."""
        return tuple(t for t in self.running.torques if len(t.table) > 1)

    def _sense(self, torque: ShaftTorque) -> float:
        """1 where the angle that a torque acts on counts as it nominally rotates, else -1."""
        return math.copysign(1.0, float(self.running.line.rotation[torque.dof]))

    def factors(self, times: Array) -> Array:
        """Factors of the sources at times in s, (time, source)."""
        factors = [self._factor(source, times) for source in self.sources]
        return np.array(factors).reshape(-1, len(times)).T

    def forces(self, times: Array) -> Array:
        """Torques and forces that follow no angle, on the degrees of freedom, (time, dof)."""
        steady = [t for t in self.running.torques if len(t.table) == 1]
        forces = self._torques(steady, times)
        if self.running.line.friction_torque is not None:
            forces += self.running.line.friction_torque
        return forces

    def _torques(self, torques: Sequence[ShaftTorque], times: Array) -> Array:
        """Means of torques over their angle at times in s, (time, dof)."""
        forces = np.zeros((len(times), len(self.dofs)))
        for torque in torques:
            mean = self._sense(torque) * float(torque.table.mean())
            forces[:, torque.dof] += mean * self._factor(torque, times)
        return forces

    def _factor(self, torque: ShaftTorque, times: Array) -> Array:
        if torque.factor is None:
            return np.ones(len(times))
        return np.interp(times, self.running.course.time, torque.factor)


def line_dynamics(running: RunningLine, *, angles: Sequence[int]) -> LineDynamics:
    """The motion of a line whose meshes all have teeth.

    ``angles`` are numbers of the nodes whose angles are given out.
    """
    meshes = range(len(running.line.meshes))
    return LineDynamics(
        running=running,
        teeth=tuple(_teeth(running, m) for m in meshes),
        touched=np.array(
            [touched_dofs(running.machine, running.matrices, m) for m in meshes]
        ),
        senses=np.array([turning_sense(running.machine, m) for m in meshes]),
        angles=tuple(running.dof(node) for node in angles),
    )


def _teeth(running: RunningLine, m: int) -> MeshTeeth:
    if m not in running.teeth:
        raise SimulationError(
            "solver.backend = nystroem takes meshes of tabulated teeth, but mesh "
            f"{running.line.meshes[m].name} has none; take solver.backend=newmark"
        )
    return running.teeth[m]
