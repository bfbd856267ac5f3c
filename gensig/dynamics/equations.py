"""A machine as numbers: bodies, springs, meshes, governor and torques, in SI units.

Gear pairs and drive lines are integrated by these alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gensig.arrays import Array, Complex, Integers
from gensig.dynamics.mesh_teeth import MeshTeeth

# motions that a mesh acts on: x, y and rotation of its driving gear a and its driven gear b;
# helical gears that move along their axes have more after them
A_X, A_Y, A_TURN, B_X, B_Y, B_TURN, N_IN_PLANE = range(7)
N_MOTIONS = 12  # of helical gears
NONE = -1  # for a gear that does not move so
# of the first six in a gear pair, whose y is the line of action
PAIR_SLIDE = (1.0, 0.0, 0.0, -1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mesh:
    """A gear mesh between the bodies of a machine.

    Parameters
    ----------
    touched : (motion,)    degrees of freedom that it acts on, ``NONE`` where there is none
    reach : (motion,)      gradient of the approach along them
    slide : (motion,)      direction of its friction
    stiffness : N/m        mean one under the force at which contact and damping are taken
    damping : N s/m, of the one-sided law per N of the force of a pair of teeth
    mean_force : N
    speed : rad/s          of gear a at the set-point
    """

    name: str
    teeth: MeshTeeth
    touched: Integers
    reach: Array
    slide: Array
    stiffness: float
    damping: float
    mean_force: float
    speed: float

    def approach(self, deflection: Array) -> float:
        """Approach of the flanks at a deflection (dof,), m."""
        moved = np.where(self.touched == NONE, 0.0, deflection[self.touched])
        return float(self.reach @ moved)

    def damping_under(self, force: float) -> float:
        """Damping under a mean force in N, N s/m."""
        if self.teeth.table.options.law == "one_sided":
            return self.damping * force
        return self.damping

    @property
    def turn(self) -> int:
        """Degree of freedom of the rotation of gear a."""
        return int(self.touched[A_TURN])

    def push(self, n_dof: int) -> Array:
        """Gradient of the approach along all degrees of freedom, (dof,)."""
        return self._along(self.reach, n_dof)

    def rub(self, n_dof: int) -> Array:
        """Direction of the friction along all degrees of freedom, (dof,)."""
        return self._along(self.slide, n_dof)

    def _along(self, values: Array, n_dof: int) -> Array:
        direction = np.zeros(n_dof)
        is_there = self.touched != NONE
        direction[self.touched[is_there]] = values[is_there]
        return direction


class Element(ABC):
    """A force between bodies that is neither a spring nor that of a mesh.

    ``law`` names the entry of ``FORCE_LAWS`` that has its code.
    """

    law: ClassVar[str]

    @abstractmethod
    def largest_stiffness(self, n_dof: int) -> Array:
        """Stiffness that the steps of an integration must follow, (dof, dof)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OverAngle:
    """A torque or a force on a degree of freedom that follows the angle of a shaft.

    ``nodes`` (node,) N m or N stand at equal distances over a period, straight between them;
    ``per_rad`` is the number of nodes per rad of the degree of freedom ``turned_by``, and ``shift``
    the place in nodes at angle 0.
    """

    dof: int
    turned_by: int
    nodes: Array
    per_rad: float
    shift: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equations:
    """M q'' + C q' + K q = f + mesh forces; q is the deviation from nominal rotation.

    Parameters
    ----------
    mass : (dof,) kg or kg m2
    stiffness, damping : (dof, dof)    without the governor
    rotation : (dof,)    of each with that of the reference, 0 for a translation
    held : (dof,)        the governor's stiffness is ``held`` times ``held``
    held_damping : s     its damping is so many times its stiffness
    sources : torques and forces over an angle
    elements : further forces between bodies
    reference : degree of freedom that turns with the reference
    angles : degrees of freedom whose angles are given out
    """

    mass: Array
    stiffness: Array
    damping: Array
    rotation: Array
    held: Array
    held_damping: float
    meshes: tuple[Mesh, ...]
    sources: tuple[OverAngle, ...]
    reference: int
    angles: tuple[int, ...]
    elements: tuple[Element, ...] = ()

    @property
    def governed_stiffness(self) -> Array:
        """Stiffness with that of the governor, (dof, dof)."""
        return self.stiffness + np.outer(self.held, self.held)

    @property
    def governed_damping(self) -> Array:
        """Damping with that of the governor, (dof, dof)."""
        return self.damping + self.held_damping * np.outer(self.held, self.held)

    def closed(
        self, mesh_stiffness: Array, mesh_damping: Array | None = None
    ) -> tuple[Array, Array]:
        """Stiffness and damping with a spring and a damper in every mesh, (dof, dof) each.

        ``mesh_stiffness`` (mesh,) N/m, ``mesh_damping`` (mesh,) N s/m, None for none.
        """
        n, dampers = len(self.mass), np.zeros(len(self.meshes))
        if mesh_damping is not None:
            dampers = mesh_damping
        reach = np.array([mesh.push(n) for mesh in self.meshes]).reshape(-1, n)
        stiffness = self.governed_stiffness + (reach.T * mesh_stiffness) @ reach
        return stiffness, self.governed_damping + (reach.T * dampers) @ reach

    def rates(
        self, mesh_stiffness: Array, mesh_damping: Array | None = None
    ) -> Complex:
        """Eigenvalues in 1/s with every mesh held as in ``closed``."""
        n = len(self.mass)
        stiffness, damping = self.closed(mesh_stiffness, mesh_damping)
        for element in self.elements:
            stiffness = stiffness + element.largest_stiffness(n)
        state, per_mass = np.zeros((2 * n, 2 * n)), 1.0 / self.mass[:, None]
        state[:n, n:] = np.eye(n)
        state[n:, :n], state[n:, n:] = -stiffness * per_mass, -damping * per_mass
        return np.linalg.eigvals(state).astype(np.complex128)

    def holding(self, deflection: Array) -> Array:
        """Forces that hold a deflection against springs and mean mesh forces, (dof,)."""
        force = self.stiffness @ deflection + self.held * (self.held @ deflection)
        for mesh in self.meshes:
            force = force + mesh.mean_force * mesh.push(len(deflection))
        return np.asarray(force)

    @property
    def is_gear_pair(self) -> bool:
        """True for one mesh of two gears that are the first bodies, with y along its line.

        Dampers are beside springs, and no torque follows an angle.
        """
        mesh = self.meshes[0]
        plane = mesh.reach[:N_IN_PLANE]
        joined = (self.stiffness != 0.0) | np.eye(len(self.mass), dtype=np.bool_)
        return (
            len(self.meshes) == 1
            and not self.sources
            and not np.any(self.damping[~joined])
            and np.array_equal(mesh.touched, np.arange(len(mesh.touched)))
            and np.array_equal(mesh.slide[:N_IN_PLANE], PAIR_SLIDE)
            and np.array_equal(plane[[A_X, A_Y, B_X, B_Y]], [0.0, -1.0, 0.0, 1.0])
            and self.rotation[A_TURN] == 1.0
        )
