"""Laws of the coefficients of the schemes."""

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.driveline.time._scheme import NEWMARK, average_acceleration
from gensig.dynamics._tables import CUBIC_MIDDLE


def test_the_middle_of_a_cubic_is_exact() -> None:
    cubic = np.polynomial.Polynomial([0.3, -1.2, 0.7, 2.1])
    (begin, end) = (-0.4, 0.9)
    values = cubic(np.array([begin, end]))
    slopes = cubic.deriv()(np.array([begin, end]))
    middle = 0.5 * (begin + end)
    d = end - begin
    by_values, by_slopes, slope_by_values, slope_by_slopes = CUBIC_MIDDLE
    value = by_values * values.sum() - by_slopes * d * np.diff(slopes)[0]
    slope = slope_by_values * np.diff(values)[0] / d - slope_by_slopes * slopes.sum()

    assert_close(
        [value, slope],
        [cubic(middle), cubic.deriv()(middle)],
        1e-14,
    )

    simpson = d * (slopes.sum() + 4.0 * slope) / 6.0
    assert_close(simpson, np.diff(values)[0], 1e-14)


def test_newmark_keeps_the_energy_of_an_oscillator() -> None:
    """One step of q'' = -q with the factor of the coefficients."""
    q = 1.0
    v = 0.3
    h = 0.7
    right = -2.0 * q + 2.0 * NEWMARK.damping / h * v
    moved = right / (NEWMARK.mass / h**2 + 1.0)
    q_1 = q + moved
    v_1 = NEWMARK.damping * moved / h - v

    assert_close(q_1**2 + v_1**2, q**2 + v**2, 1e-14)

    mean = (0.5 - NEWMARK.beta) * -q + NEWMARK.beta * -q_1
    assert_close(q_1, q + h * v + h**2 * mean, 1e-14)
    assert_close(
        v_1,
        v + h * ((1.0 - NEWMARK.gamma) * -q + NEWMARK.gamma * -q_1),
        1e-14,
    )


@pytest.mark.parametrize(
    ("beta", "gamma"),
    [(1 / 6, 0.5), (0.25, 0.6), (0.3025, 0.6)],
)
def test_other_newmark_schemes_are_refused(beta: float, gamma: float) -> None:
    text = "written for the average acceleration, 1/4, 1/2"
    with refused(text, ValueError):
        average_acceleration(beta, gamma)
