"""The equations of motion of a spur pair as scipy takes them; the mesh law is that of the compiled core."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from lane_tools import law_of
from scipy.integrate import solve_ivp

from gensig.dynamics.pair import PairDynamics

Slope = Callable[[float, np.ndarray], np.ndarray]

LIKELY = np.repeat([1e-6, 1e-2], 6) * np.tile(
    [1, 1, 20, 1, 1, 20], 2
)  # m, rad, m/s, rad/s: usual sizes


def equations(dynamics: PairDynamics) -> tuple[Slope, np.ndarray]:
    """y' as a function of t and y = (q, q'), and the matrix of its linear part without the mesh."""
    system, direction, law = (
        dynamics.system(),
        dynamics.approach_direction(),
        law_of(dynamics),
    )
    radius, speed = dynamics.table.pair.pinion.base_radius, dynamics.operating.speed
    free = np.eye(12, k=6)
    free[6:] = -np.hstack([system.stiffness, system.damping]) / system.mass[:, None]
    pushed = np.concatenate([np.zeros(6), system.force / system.mass])
    # motion of the mesh by state; state by normal force, friction force, its moments, force on the roll
    seen, felt = np.zeros((4, 12)), np.zeros((12, 5))
    seen[1, :6] = seen[2, 6:] = direction
    seen[0, 2] = seen[3, 8] = radius
    felt[6:, 0] = -direction
    felt[[6, 9], 1] = 1, -1
    felt[[8, 11, 8], [2, 3, 4]] = 1, 1, radius
    felt[6:] /= system.mass[:, None]
    start, rate = (
        np.array([dynamics.start_roll, 0, 0, radius * speed]),
        np.array([radius * speed, 0, 0, 0]),
    )

    def slope(t, y):
        return free @ y + pushed + felt @ law(*(start + rate * t + seen @ y))[:5]

    return slope, free


def solved(
    slope: Slope, start: np.ndarray, times: np.ndarray, method: str, rtol: float
) -> np.ndarray:
    """States at some times, (time, state); ``start`` is the state at the first."""
    span = times[0], times[-1]
    solution = solve_ivp(
        slope,
        span,
        start,
        method=method,
        rtol=rtol,
        atol=10 * rtol * LIKELY,
        t_eval=times,
        first_step=1e-7,
        max_step=2e-5,
    )
    return solution.y.T


def at_rest(dynamics: PairDynamics, time: float = 0.0) -> np.ndarray:
    """State of a machine at rest in static equilibrium at a time."""
    return np.concatenate([dynamics.static_start(time), np.zeros(6)])
