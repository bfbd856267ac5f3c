"""Loads of single pairs of teeth, read off the force of a running mesh.

``docs/theory/degradation.md``.
"""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import GearPair

SECONDS = 0.5  # of steady running that stand for a set-point
SHARED = 0.5  # of the mesh force on one tooth where two pairs carry; assumed
LEAST_TORQUE = (
    1e-6  # N m, of a mesh that passes without touching: laws take roots and logarithms
)


def greatest_loads(pair: GearPair, angle: Array, force: Array) -> Array:
    """Greatest load of every pair of teeth that is seen from its entry to its exit, as torque of
    the pinion.

    Parameters
    ----------
    angle : (sample,) rad    of the pinion; a pair of teeth enters at every pitch of it
    force : (sample,) N      of the mesh, negative on the back flanks

    Returns
    -------
    (pair of teeth,) N m

    A spur tooth has the whole force where its pair is alone, ``SHARED`` of it where another one
    carries too; the back flanks close cracks and are left out. For helical teeth it is the torque
    of the whole mesh, which their slices share as at rest.
    """
    if pair.pinion.helix_angle != 0.0:
        return _of_slices(pair, angle, force)
    roll = pair.pinion.base_radius * angle
    entered = (
        np.arange(
            math.ceil(roll[0] / pair.base_pitch), math.floor(roll[-1] / pair.base_pitch)
        )
        * pair.base_pitch
    )
    loads = []
    for entry in entered[entered + pair.path_of_contact <= roll[-1]]:
        position = roll - entry
        engaged = (position >= 0.0) & (position <= pair.path_of_contact)
        alone = (position > pair.path_of_contact - pair.base_pitch) & (
            position < pair.base_pitch
        )
        load = np.where(alone, 1.0, SHARED)[engaged] * np.maximum(force[engaged], 0.0)
        loads.append(float(load.max(initial=0.0)))
    return np.maximum(np.array(loads) * pair.pinion.base_radius, LEAST_TORQUE)


def mean_torque(pair: GearPair, force: Array) -> float:
    """Mean torque of the pinion by the force on its working flanks, (sample,) N; N m."""
    mean = float(np.maximum(force, 0.0).mean()) * pair.pinion.base_radius
    return max(mean, LEAST_TORQUE)


def _of_slices(pair: GearPair, angle: Array, force: Array) -> Array:
    """Greatest torque of the mesh during the engagement of every pair, (pair of teeth,) N m."""
    roll = pair.pinion.base_radius * angle
    length = pair.total_contact_ratio * pair.base_pitch
    first, last = roll[0] / pair.base_pitch, (roll[-1] - length) / pair.base_pitch
    loads = []
    for number in range(math.ceil(first), math.floor(last) + 1):
        position = roll - number * pair.base_pitch
        engaged = (position >= 0.0) & (position <= length)
        loads.append(float(np.maximum(force[engaged], 0.0).max(initial=0.0)))
    return np.maximum(np.array(loads) * pair.pinion.base_radius, LEAST_TORQUE)
