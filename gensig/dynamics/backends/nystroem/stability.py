"""Longest stable step of the Nystroem method on one mode of vibration."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Complex

LONGEST = 4.0  # |lambda| h beyond which no step is stable
RATIO_STEPS = 64  # damping ratios from 0 to 1 at which the limit is computed


def stable_rate(rates: Complex) -> float:
    """Least stable number of steps per second of a machine with eigenvalues in 1/s."""
    size = np.abs(rates)
    moving = size > 0.0
    ratios = -np.real(rates[moving]) / size[moving]
    limits = [stability_limit(_next_ratio(ratio)) for ratio in ratios]
    return float((size[moving] / limits).max())


def _next_ratio(ratio: float) -> float:
    """The next greater ratio of a grid from 1/64 to 1: undamped modes grow too slowly to matter."""
    steps = min(max(math.ceil(ratio * RATIO_STEPS), 1), RATIO_STEPS)
    return steps / RATIO_STEPS


@lru_cache(maxsize=RATIO_STEPS + 1)
def stability_limit(ratio: float) -> float:
    """Largest |lambda| h up to which a mode of a damping ratio is stable."""
    steps = np.linspace(0.0, LONGEST, 401)[1:]
    for step in steps:
        growth = np.abs(np.linalg.eigvals(amplification(float(step), ratio))).max()
        if growth > 1.0 + 1e-9:
            return float(step - steps[0])
    return LONGEST


def amplification(step: float, ratio: float) -> Array:
    """Change over a step of [q, h v, h^2 (a, a_middle, a_before)] of one mode, (5, 5).

    ``step`` is the circular frequency times the step.
    """
    q, v, a, middle, before = np.eye(5)

    def force(place: Array, speed: Array) -> Array:
        return np.asarray(-(step**2) * place - 2.0 * ratio * step * speed)

    place = q + 0.5 * v + (19.0 * a - 10.0 * middle + 3.0 * before) / 96.0
    speed = v + (23.0 * a - 16.0 * middle + 5.0 * before) / 24.0
    halfway = force(place, speed)
    end_q = q + v + (a + 2.0 * halfway) / 6.0
    predicted = v + (a + 4.0 * halfway + middle - 3.0 * a + 3.0 * halfway) / 6.0
    end = force(end_q, predicted)
    end_v = v + (a + 4.0 * halfway + end) / 6.0
    return np.stack([end_q, end_v, end, halfway, a])
