"""A machine as nuisances meet it: the shafts of its gears, and its answer to small forces."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.pair import Body

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# motions of a gear that forces act on, in the order of every (..., 3) force
GEAR_AXES = ("x", "y", "rotation")


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
    """A sound machine whose meshes are held at their mean stiffness and damping."""

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
