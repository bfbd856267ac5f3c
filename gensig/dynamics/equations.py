"""A machine as numbers: bodies, springs, meshes, governor and torques, in SI units.

Gear pairs and drive lines are integrated by these alone.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.mesh_teeth import MeshTeeth

Array = NDArray[np.float64]

# motions that a mesh acts on: x, y and rotation of its driving gear a and its driven gear b;
# helical gears that move along their axes have more after them
A_X, A_Y, A_TURN, B_X, B_Y, B_TURN, N_IN_PLANE = range(7)
N_MOTIONS = 12  # of helical gears
NONE = -1  # for a gear that does not move so
LONGEST_SETTLING = 0.45  # s
SETTLED = 1e-4  # share of the start's transient that is left
STIFFER = 1.2  # than their mean stiffness are meshes taken for the longest step
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
    damping : N s/m, of the one-sided law per N of the force of a pair of teeth
    mean_force : N
    speed : rad/s          of gear a at the set-point
    """

    name: str
    teeth: MeshTeeth
    touched: NDArray[np.int64]
    reach: Array
    slide: Array
    damping: float
    mean_force: float
    speed: float

    def approach(self, deflection: Array) -> float:
        """Approach of the flanks at a deflection (dof,), m."""
        moved = np.where(self.touched == NONE, 0.0, deflection[self.touched])
        return float(self.reach @ moved)

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
    ) -> NDArray[np.complex128]:
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


class Dynamics(ABC):
    """A machine in motion, which can be integrated: a gear pair, or a line of several meshes."""

    @property
    @abstractmethod
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""

    @property
    @abstractmethod
    def equations(self) -> Equations:
        """The machine as numbers."""

    @property
    @abstractmethod
    def mesh_stiffness(self) -> Array:
        """Mean stiffness of every mesh, (mesh,) N/m."""

    @property
    @abstractmethod
    def is_steady(self) -> bool:
        """True where neither speed nor torques change over time."""

    @property
    @abstractmethod
    def rest(self) -> Array:
        """Deflection about which the machine moves, its reference not turned, (dof,)."""

    @abstractmethod
    def start(self, time: float) -> tuple[Array, Array]:
        """Deflections and their rates from which a motion settles at a nominal time, (dof,) each.

        Rates are 0 where the machine starts at rest.
        """

    @abstractmethod
    def course(self, times: Array) -> tuple[Array, Array]:
        """Angle in rad since time 0 and speed in rad/s of the reference at times in s, (time,).

        ``times`` increase and hold 0.
        """

    @abstractmethod
    def forces(self, times: Array) -> Array:
        """Torques and forces that follow no angle, on the degrees of freedom, (time, dof)."""

    @abstractmethod
    def factors(self, times: Array) -> Array:
        """Factors of the torques over an angle at times in s, (time, source)."""

    @cached_property
    def stiff_rates(self) -> NDArray[np.complex128]:
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
