"""Rows of numbers of one gear mesh, as the compiled core reads them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._layout import FAR_NEAR
from gensig.dynamics.helical import half_lag, pitches
from gensig.dynamics.mesh_statics import least_gaps
from gensig.dynamics.pair import PairDynamics

Array = NDArray[np.float64]


def mesh_numbers(dynamics: PairDynamics, step: float, rest: Array) -> tuple[float, ...]:
    """The mesh as numbers, in the order of the rows of ``_layout.Group.numbers``.

    Parameters
    ----------
    step : s    of the integration
    rest : (dof,)    the equilibrium from which the state is counted
    """
    table, options, pair = dynamics.table, dynamics.table.options, dynamics.table.pair
    lag, damping = half_lag(table), dynamics.mesh_damping
    if options.law == "one_sided":
        damping = damping / dynamics.mesh_force
    speed = pair.pinion.base_radius * dynamics.operating.speed
    return (
        pair.pinion.base_radius,
        pair.wheel.base_radius,
        pair.path_of_contact,
        pair.pitch_point,
        pair.start_curvature_radius,
        pair.tangent_length,
        table.shared_compliance,
        damping,
        options.friction_coefficient,
        2.0 / (options.friction_transition * pair.base_pitch + 2.0 * lag),
        2.0 / (speed * step),
        pair.backlash,
        dynamics.mesh_force,
        float(dynamics.approach_direction() @ rest),
        lag,
        pair.pitch_point + lag,
    )


def exact_numbers(dynamics: PairDynamics) -> tuple[float, ...]:
    """Numbers that locate the pairs, in the order of the rows of ``_layout.Group.exact``."""
    options, pair = dynamics.table.options, dynamics.table.pair
    near = -math.inf, math.inf
    if options.law == "one_sided":
        near = near_positions(dynamics)
    return (
        pair.pinion.base_radius,
        pair.base_pitch,
        1.0 / pair.base_pitch,
        options.points_per_pitch / pair.base_pitch,
        dynamics.start_roll,
        *near,
        pitches(dynamics.table)[0] * pair.base_pitch,
    )


def near_positions(dynamics: PairDynamics) -> tuple[float, float]:
    """Positions s outside of which no pair comes within ``FAR_NEAR`` of touching, m."""
    table = dynamics.table
    beyond = table.position - table.pair.pitch_point - half_lag(table)
    teeth = (
        (dynamics.pinion_error, dynamics.pinion_tilt),
        (dynamics.wheel_error, dynamics.wheel_tilt),
    )
    nearest = [
        flank + error.min() + np.minimum(tilt.min() * beyond, tilt.max() * beyond)
        for flank, (error, tilt) in zip(least_gaps(table), teeth, strict=True)
    ]
    near = np.flatnonzero(nearest[0] + nearest[1] < FAR_NEAR)
    first, last = 0, len(table.position) - 1
    if len(near) > 0:  # else every pair may be as near as any other
        first, last = max(near[0] - 1, first), min(near[-1] + 1, last)
    return float(table.position[first]), float(table.position[last])
