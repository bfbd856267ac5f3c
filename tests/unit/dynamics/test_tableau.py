"""Laws of the coefficients of the schemes."""

import numpy as np
import pytest
from closeness import assert_close

from gensig.dynamics._tableau import (
    CUBIC_MIDDLE,
    NEWMARK,
    RK4,
    Tableau,
    average_acceleration,
)

ANGLES = np.linspace(0.05, 0.4, 8)  # omega h


def stepped(scheme: Tableau, h: float) -> complex:
    """One step h of the oscillator q'' = -q, from q = 1 at rest, as q_1 + i v_1."""
    q = 1.0
    v = 0.0
    accelerations = []
    stage_q = q
    stage_v = v
    for node in (*scheme.node[1:], 0.0):
        a = -stage_q
        accelerations.append(a)
        stage_q = q + node * h * stage_v
        stage_v = v + node * h * a
    gained = h * scheme.share * np.dot(scheme.weight, accelerations)
    moved = h * (v + h * scheme.share * np.dot(scheme.position, accelerations))
    return complex(q + moved, v + gained)


def order(scheme: Tableau) -> float:
    """Order of a scheme: slope of the error of a step over its length, less one."""
    exact = np.exp(-1j * ANGLES)
    errors = np.abs([stepped(scheme, angle) for angle in ANGLES] - exact)
    return float(np.polyfit(np.log(ANGLES), np.log(errors), 1)[0]) - 1.0


def test_the_classical_scheme_is_of_fourth_order() -> None:
    assert 3.9 < order(RK4) < 4.1

    other = RK4._replace(weight=(1.0, 2.1, 1.9, 1.0), node=(0.0, 0.45, 0.45, 1.0))
    assert order(other) < 2.5
    assert sum(RK4.weight) * RK4.share == 1.0
    assert sum(RK4.position) * RK4.share == 0.5

    for values in (RK4.node, RK4.weight, RK4.position):
        assert values[1] == values[2]  # the core reads one of them for both


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
    with pytest.raises(ValueError, match=text):
        average_acceleration(beta, gamma)
