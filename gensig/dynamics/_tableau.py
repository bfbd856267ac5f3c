"""Coefficients of the numerical schemes, as data.

The compiled cores read them as constants: a change of this file compiles the cores anew.
"""

from __future__ import annotations

from typing import NamedTuple


class CubicMiddle(NamedTuple):
    """Value and slope of a cubic half-way between two ends at a distance d.

    value = value_by_values (y_0 + y_1) + value_by_slopes d (y'_0 - y'_1)
    slope = slope_by_values (y_1 - y_0) / d - slope_by_slopes (y'_0 + y'_1)

    Simpson's rule over the slopes of both ends and of the middle gives y_1 - y_0.
    """

    value_by_values: float
    value_by_slopes: float
    slope_by_values: float
    slope_by_slopes: float


class LowPass(NamedTuple):
    """Low-pass between the internal rate and the output rate, in shares of the output rate.

    ``pass_share`` is the end of the pass band, ``stop_share`` the begin of the stop band,
    ``attenuation_db`` the attenuation of the stop band.
    """

    pass_share: float
    stop_share: float
    attenuation_db: float


class Newmark(NamedTuple):
    """Newmark's method with beta and gamma, and two numbers that follow from them.

    A step h solves (``mass`` M / h^2 + ``damping`` C / h + K) dq = right-hand side, and ends at
    the speed v_1 = ``damping`` dq / h - v_0. The mean of v_1 and v_0 is dq / h, which holds only
    for gamma = 2 beta = 1/2, the average acceleration.
    """

    beta: float
    gamma: float
    mass: float
    damping: float


def average_acceleration(beta: float, gamma: float) -> Newmark:
    """Newmark's coefficients; ValueError for others than those of the average acceleration."""
    if gamma != 0.5 or beta != 0.5 * gamma:
        raise ValueError(
            f"beta = {beta}, gamma = {gamma}: the core is written for the average "
            "acceleration, 1/4, 1/2"
        )
    return Newmark(beta=beta, gamma=gamma, mass=1.0 / beta, damping=gamma / beta)


CUBIC_MIDDLE = CubicMiddle(
    value_by_values=0.5,
    value_by_slopes=0.125,
    slope_by_values=1.5,
    slope_by_slopes=0.25,
)
# the pass band ends at 20 kHz of 51.2 kHz
LOW_PASS = LowPass(pass_share=0.390625, stop_share=0.5, attenuation_db=100.0)
NEWMARK = average_acceleration(beta=0.25, gamma=0.5)
