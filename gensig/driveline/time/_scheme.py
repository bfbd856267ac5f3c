"""Coefficients of Newmark's method, as data that the compiled core reads as constants."""

from __future__ import annotations

from typing import NamedTuple


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


NEWMARK = average_acceleration(beta=0.25, gamma=0.5)
