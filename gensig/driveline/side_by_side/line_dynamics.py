"""The motion of one line of toothed meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.running import RunningLine
from gensig.driveline.side_by_side.line_pairs import mesh_pair
from gensig.driveline.side_by_side.line_statics import line_at_rest
from gensig.driveline.time.mesh_friction import slide_direction
from gensig.dynamics.backends.nystroem.method import is_followed_by_three
from gensig.dynamics.backends.nystroem.stability import stable_rate
from gensig.dynamics.backends.step_limits import LONGEST_SETTLING, SETTLED
from gensig.dynamics.integrator import Solver
from gensig.dynamics.pair import PairDynamics
from gensig.errors import SimulationError, StepError
from gensig.operation.setpoint import Operating

Array = NDArray[np.float64]
Index = NDArray[np.int64]

OTHER_BACKEND = "take solver.backend=newmark"
STIFFER = 1.2  # than their mean stiffness are meshes taken for the longest step


@dataclass(frozen=True, kw_only=True, eq=False)
class LineDynamics:
    """All parameters of the motion of one line of toothed meshes.

    No slots: what follows from them is cached.

    Parameters
    ----------
    running : the line with its course, torques and mean mesh forces
    pairs : the teeth of every mesh with their law; their supports are not read
    touched : (mesh, 6) degrees of freedom of x, y and rotation of gear a and of gear b, -1 for a
        gear that does not move so
    senses : (mesh,) 1 where gear a turns from x to y, else -1
    angles : degrees of freedom whose angles are given out
    """

    running: RunningLine
    pairs: tuple[PairDynamics, ...]
    touched: Index
    senses: Array
    angles: tuple[int, ...]

    @property
    def has_chords(self) -> bool:
        """True if a mesh is helical or has more than three pairs of teeth in contact."""
        return not all(is_followed_by_three(pair) for pair in self.pairs)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self.running.line.names

    @cached_property
    def reach(self) -> Array:
        """Gradient of the approach along the degrees of freedom of every mesh, (mesh, 6)."""
        reach = np.zeros(self.touched.shape)
        for row, mesh, dofs in zip(
            reach, self.running.line.meshes, self.touched, strict=True
        ):
            row[dofs >= 0] = mesh.direction[dofs[dofs >= 0]]
        return reach

    @property
    def slide(self) -> Array:
        """Direction of friction along the degrees of freedom of every mesh, (mesh, 6)."""
        slide = np.zeros_like(self.reach)
        meshes = zip(
            slide, self.running.line.meshes, self.touched, self.senses, strict=True
        )
        for row, mesh, dofs, sense in meshes:
            along = slide_direction(mesh.direction, dofs, sense)
            row[dofs >= 0] = along[dofs[dofs >= 0]]
        return slide

    @cached_property
    def stiff_rates(self) -> NDArray[np.complex128]:
        """Eigenvalues with the meshes held at 1.2 times their mean stiffness, 1/s."""
        return self._rates(STIFFER)

    @property
    def settling_time(self) -> float:
        """Time after which the start's transient has fallen to 1e-4 (longest 0.45 s), s."""
        rates = -np.real(self._rates(1.0))
        slowest = float(rates[rates > 1e-3].min(initial=np.inf))
        return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / slowest)

    def _rates(self, stiffer: float) -> NDArray[np.complex128]:
        line = self.running.line
        stiffness, n = line.stiffness.copy(), len(line.names)
        for mesh, pair in zip(line.meshes, self.pairs, strict=True):
            held = stiffer * pair.mean_mesh_stiffness
            stiffness += held * np.outer(mesh.direction, mesh.direction)
        per_mass = 1.0 / np.diag(line.mass)[:, None]
        state = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-stiffness * per_mass, -line.damping * per_mass],
            ]
        )
        return np.linalg.eigvals(state).astype(np.complex128)

    @cached_property
    def rest(self) -> Array:
        """Deflection about which the line moves, its reference not turned, (dof,)."""
        start, rotation = self.static_start(0.0), self.running.line.rotation
        return np.asarray(start - rotation * start[self.reference])

    @property
    def reference(self) -> int:
        """Degree of freedom that turns with the reference."""
        return int(np.argmin(np.abs(self.running.line.rotation - 1.0)))

    def static_start(self, time: float) -> Array:
        """Deflection under the mean torques at a nominal time, without friction, (dof,).

        Under a nominal acceleration it is that of the accelerated line.
        """
        line, course = self.running.line, self.running.course
        angle = float(course.nominal(np.array([time]))[0][0])
        force = self._torques(np.array([time]))[0]
        force -= line.mass @ line.rotation * course.acceleration(time)
        return line_at_rest(line, self.pairs, angle, force)

    def forces(self, times: Array) -> Array:
        """Torques and forces on the degrees of freedom at times in s, (time, dof)."""
        forces = self._torques(times)
        if self.running.line.friction_torque is not None:
            forces += self.running.line.friction_torque
        return forces

    def _torques(self, times: Array) -> Array:
        """The same without what makes up for friction."""
        forces = np.zeros((len(times), len(self.dofs)))
        for torque in self.running.torques:
            factor: Array | float = 1.0
            if torque.factor is not None:
                factor = np.interp(times, self.running.course.time, torque.factor)
            forces[:, torque.dof] += float(torque.table.mean()) * factor
        return forces


def line_dynamics(
    running: RunningLine,
    operating: Operating,
    *,
    angles: Sequence[int],
) -> LineDynamics:
    """The motion of a line whose meshes all have tables of teeth.

    Parameters
    ----------
    operating : options of the set-point; its speed and torque are not read
    angles : numbers of the nodes whose angles are given out
    """
    meshes = range(len(running.line.meshes))
    return LineDynamics(
        running=running,
        pairs=tuple(_toothed_pair(running, m, operating) for m in meshes),
        touched=np.array([running.touched(m) for m in meshes], dtype=np.int64),
        senses=np.array([running.sense(m) for m in meshes]),
        angles=tuple(running.dof(node) for node in angles),
    )


def check_line(line: LineDynamics, solver: Solver, sampling_rate: float) -> None:
    """Raise SimulationError for an unstable step or a line that the core does not cover."""
    for pair in line.pairs:
        _refuse(pair)
    for torque in line.running.torques:
        if len(torque.table) > 1:
            raise SimulationError(
                f"solver.backend = nystroem takes torques that do not follow an angle, but that "
                f"on '{line.dofs[torque.dof]}' does; {OTHER_BACKEND}"
            )
    needed = math.ceil(stable_rate(line.stiff_rates) / sampling_rate)
    if needed > solver.oversampling:
        raise StepError(
            f"solver.oversampling = {solver.oversampling} makes too long steps for "
            f"solver.backend=nystroem; raise solver.oversampling to at least {needed}"
        )


def _refuse(pair: PairDynamics) -> None:
    """Raise SimulationError for a mesh that the core of lines does not cover."""
    law = pair.table.options.law
    if law != "one_sided":
        raise SimulationError(
            f"mesh.law = {law} is not covered by solver.backend = nystroem on a drive line; "
            f"{OTHER_BACKEND}"
        )


def _toothed_pair(running: RunningLine, m: int, operating: Operating) -> PairDynamics:
    if m not in running.tabulated:
        raise SimulationError(
            "solver.backend = nystroem takes meshes of tabulated teeth, but mesh "
            f"{running.line.meshes[m].name} has none; {OTHER_BACKEND}"
        )
    return mesh_pair(running, m, operating)
