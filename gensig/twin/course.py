"""The drift of the speed as a configuration has it."""

from __future__ import annotations

import math

import numpy as np

LONGEST = 10.0  # s of the course; it holds its last value afterwards
MOST_POINTS = 400
POINTS_A_CORRELATION = 4
SEED = 0


def drift_profile(scatter: float | None, correlation_time: float | None) -> list[list[float]] | None:
    """``operating.speed_profile`` of a scatter (over the mean) and a correlation time (s); None without one.

    A first-order random walk (Ornstein-Uhlenbeck) drawn once, as [time_s, factor] pairs with mean 1, not a copy of the
    measured course.
    """
    if scatter is None or correlation_time is None:
        return None
    step = max(correlation_time / POINTS_A_CORRELATION, LONGEST / MOST_POINTS)
    n_points = math.ceil(LONGEST / step) + 1
    keep = math.exp(-step / correlation_time)
    rng = np.random.default_rng(SEED)
    walk = np.empty(n_points)
    walk[0] = rng.standard_normal()
    for place in range(1, n_points):
        walk[place] = keep * walk[place - 1] + math.sqrt(1.0 - keep**2) * rng.standard_normal()
    walk -= walk.mean()
    return [[round(place * step, 6), round(1.0 + scatter * value, 8)] for place, value in enumerate(walk)]
