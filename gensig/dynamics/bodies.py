"""Bodies of a machine and the springs between them as tables, and the matrices of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gensig.arrays import Array
from gensig.errors import SimulationError

HOUSING = -1  # end of a spring that stands still


class Motion(NamedTuple):
    """One way in which a body moves: ``inertia`` in kg or kg m2.

    ``speed`` is its nominal rotation with that of the reference, 0 for a translation.
    """

    name: str
    inertia: float
    speed: float = 0.0


class Spring(NamedTuple):
    """A spring and a damper beside it between two motions, by their numbers, or the housing.

    ``stiffness`` N/m or N m/rad, ``damping`` N s/m or N m s/rad; ``loss`` is the loss factor times
    the stiffness.
    """

    first: int
    second: int
    stiffness: float
    damping: float
    loss: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies:
    """Motions of all bodies, in the order of every (dof,) array, and springs between them."""

    motions: tuple[Motion, ...]
    springs: tuple[Spring, ...]

    def __post_init__(self) -> None:
        for motion in self.motions:
            if not motion.inertia > 0.0:
                raise SimulationError(
                    f"the mass or inertia of '{motion.name}' must be positive"
                )
        for spring in self.springs:
            values = spring.stiffness, spring.damping, spring.loss
            if not all(value >= 0.0 for value in values):
                raise SimulationError(
                    f"the spring of '{self.motions[spring.first].name}' would feed energy in: "
                    f"stiffness {spring.stiffness:g}, damping {spring.damping:g} and loss "
                    f"{spring.loss:g} must not be negative"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return tuple(motion.name for motion in self.motions)

    @property
    def mass(self) -> Array:
        """Masses and moments of inertia, (dof,)."""
        return np.array([motion.inertia for motion in self.motions])

    @property
    def rotation(self) -> Array:
        """Rotation of each with that of the reference, (dof,)."""
        return np.array([motion.speed for motion in self.motions])

    @property
    def stiffness(self) -> Array:
        """Stiffness of all springs, (dof, dof)."""
        return self._matrix(lambda spring: spring.stiffness)

    @property
    def damping(self) -> Array:
        """Damping of all springs, (dof, dof)."""
        return self._matrix(lambda spring: spring.damping)

    @property
    def loss(self) -> Array:
        """Loss factors times stiffness of all springs, (dof, dof)."""
        return self._matrix(lambda spring: spring.loss)

    def _matrix(self, value_of: Callable[[Spring], float]) -> Array:
        matrix = np.zeros((len(self.motions), len(self.motions)))
        for spring in self.springs:
            value = value_of(spring)
            ends = [end for end in (spring.first, spring.second) if end != HOUSING]
            for end in ends:
                matrix[end, end] += value
            if len(ends) > 1:
                matrix[ends, ends[::-1]] -= value
        return matrix
