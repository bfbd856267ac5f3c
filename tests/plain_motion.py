"""The equations of motion of a spur pair for scipy, on the mesh law of the compiled core."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from lane_tools import law_of
from scipy.integrate import solve_ivp

from gensig.dynamics.motion.dynamics import Dynamics

Slope = Callable[[float, np.ndarray], np.ndarray]

SOON = 1e-8  # s, over which a rate is taken
# usual sizes: m, rad, m/s, rad/s
LIKELY = np.repeat([1e-6, 1e-2], 6) * np.tile([1, 1, 20, 1, 1, 20], 2)


def equations(
    dynamics: Dynamics,
    *,
    prescribed: bool = False,
    damped_by_stiffness: float | None = None,
) -> tuple[Slope, np.ndarray]:
    """y' as a function of t and y = (q, q'), and the matrix of its linear part without the mesh.

    ``prescribed`` lets the mesh roll with the set speed, not with the pinion. A number of seconds
    damps the force by that times its rate, c proportional to k, in place of the law's own damping.
    """
    system, (teeth,) = dynamics.system, dynamics.teeth
    direction = system.meshes[0].push(len(dynamics.dofs))
    law, mass = law_of(dynamics), system.mass[:, None]
    radius, speed = teeth.pair.pinion.base_radius, dynamics.nominal.at(0.0).speed
    free = np.eye(12, k=6)
    free[6:] = -np.hstack([system.governed_stiffness, system.governed_damping]) / mass
    force = dynamics.forces(np.zeros(1))[0]
    pushed = np.concatenate([np.zeros(6), force / system.mass])
    # motion of the mesh by state
    motion = np.zeros((4, 12))
    motion[1, :6] = motion[2, 6:] = direction
    if not prescribed:
        motion[0, 2] = motion[3, 8] = radius
    # state by normal force, friction force, its moments, force on the roll
    forces = np.zeros((12, 5))
    forces[6:, 0] = -direction
    forces[[6, 9], 1] = 1, -1
    forces[[8, 11, 8], [2, 3, 4]] = 1, 1, radius
    forces[6:] /= mass
    start = np.array([teeth.start_roll, 0, 0, radius * speed])
    rate = np.array([radius * speed, 0, 0, 0])

    def slope(t, y):
        state = start + rate * t + motion @ y
        if damped_by_stiffness is None:
            return free @ y + pushed + forces @ law(*state)[:5]
        force = _damped_by_rate(law, state, damped_by_stiffness)
        return free @ y + pushed + forces @ force

    return slope, free


def _damped_by_rate(law, state, seconds):
    """Forces of the undamped law and what some seconds of their rate add, none negative."""
    roll, approach, rate, roll_rate = state
    force = law(roll, approach, 0.0, 0.0)[:5].copy()
    if not force[0] > 0.0:
        return 0.0 * force
    later = law(roll + roll_rate * SOON, approach + rate * SOON, 0.0, 0.0)[0]
    damped = force[0] + seconds * (later - force[0]) / SOON
    return force * max(0.0, damped / force[0])


def solved(
    slope: Slope, start: np.ndarray, times: np.ndarray, method: str, rtol: float
) -> np.ndarray:
    """States at some times, (time, state); ``start`` is the state at the first."""
    span, steps = (times[0], times[-1]), {"first_step": 1e-7, "max_step": 2e-5}
    atol = 10 * rtol * LIKELY
    return solve_ivp(
        slope, span, start, method, times, rtol=rtol, atol=atol, **steps
    ).y.T


def at_rest(dynamics: Dynamics, time: float = 0.0) -> np.ndarray:
    """State of a machine at rest in static equilibrium at a time."""
    return np.concatenate(dynamics.start(time))
