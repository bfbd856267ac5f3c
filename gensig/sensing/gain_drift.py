"""Slow drift of the sensors' gains over a record."""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array

# in a correlation time; between them the logarithm is straight: 2.4 % less variance midway
POINTS_PER_TIME = 20


def draw_drift(
    rng: np.random.Generator,
    scatter: float,
    correlation_time: float,
    n_sensors: int,
    n_samples: int,
    rate: float,
) -> Array:
    """Factor of each sensor at every sample, (sensor, sample).

    It is the exponential of a mean-reverting walk. The walk is stationary, so it also holds the
    state of mounting and temperature at the first sample. It is drawn exactly at even points,
    x(k + 1) = a x(k) + scatter sqrt(1 - a^2) n(k) with a = exp(-step / correlation time), and is
    straight between them.

    Parameters
    ----------
    scatter : 1                 standard deviation of the logarithm at any instant
    correlation_time : s        time after which exp(-1) of a deviation is expected to be left
    rate : Hz                   of the samples

    Source: G. E. Uhlenbeck & L. S. Ornstein (1930), Physical Review 36, 823-841; its exact step:
    D. T. Gillespie (1996), Physical Review E 54 (2), 2084-2091, eq. (1.9a).
    """
    step = correlation_time / POINTS_PER_TIME
    duration = (n_samples - 1) / rate
    normal = rng.standard_normal((math.floor(duration / step) + 2, n_sensors))
    kept = math.exp(-1.0 / POINTS_PER_TIME)
    walk = np.empty_like(normal)
    walk[0] = normal[0]
    for k in range(1, len(normal)):
        walk[k] = kept * walk[k - 1] + math.sqrt(1.0 - kept**2) * normal[k]
    times, points = np.arange(n_samples) / rate, step * np.arange(len(walk))
    straight = np.stack([np.interp(times, points, column) for column in walk.T])
    return np.exp(scatter * straight)
