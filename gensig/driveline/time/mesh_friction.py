"""Friction of the drive flanks of a mesh of a shaft line.

The law is that of ``docs/theory/spur_dynamics.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.mesh.tooth_table import ToothTable

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshFriction:
    """Friction of a mesh of tabulated teeth.

    Parameters
    ----------
    numbers : (N_FRICTION,)    coefficient and lengths, in the order of ``_layout``
    directions : (3, dof)    where the friction force, its moment about gear a and that about gear
        b act
    """

    numbers: Array
    directions: Array


def mesh_friction(
    table: ToothTable,
    direction: Array,
    touched: Sequence[int],
    rotation: Array,
    sense: float,
) -> MeshFriction:
    """Friction of a mesh between gears of a line.

    Parameters
    ----------
    direction : (dof,)    gradient of the approach
    touched : degrees of freedom of x, y and rotation of gear a and of gear b; -1: moves not so
    rotation : (dof,)    how far each turns with the reference, signed as its angle counts
    sense : 1 where gear a turns from x to y, else -1
    """
    options, pair = table.options, table.pair
    lag, (*_, turn_a, _, _, turn_b) = table.half_lag, touched
    directions = np.zeros((3, len(direction)))
    directions[0] = slide_direction(direction, touched, sense)
    # an angle that counts against its rotation feels moments the other way
    directions[1, turn_a] = np.sign(rotation[turn_a])
    directions[2, turn_b] = np.sign(rotation[turn_b])
    numbers = (
        options.friction_coefficient,
        pair.base_pitch,
        lag,
        pair.pitch_point,
        2.0 / (options.friction_transition * pair.base_pitch + 2.0 * lag),
        pair.path_of_contact,
        pair.start_curvature_radius,
        pair.tangent_length,
    )
    return MeshFriction(numbers=np.array(numbers), directions=directions)


def slide_direction(direction: Array, touched: Sequence[int], sense: float) -> Array:
    """Direction of the friction force of a mesh along x and y of both gears, (dof,).

    Where gear a turns against its frame (``sense`` -1), as in a gear pair, gear a feels it along
    x, which is y turned back by a right angle. Where it turns from x to y, it is the other way.
    """
    slide = np.zeros_like(direction)
    for x, y in (touched[:2], touched[3:5]):
        if x >= 0:
            slide[x], slide[y] = sense * direction[y], -sense * direction[x]
    return slide
