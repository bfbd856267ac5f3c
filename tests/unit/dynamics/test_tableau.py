"""Laws that the coefficients of the schemes keep."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.dynamics._tableau import (
    CUBIC_MIDDLE,
    NEWMARK,
    RK4,
    Tableau,
    average_acceleration,
)

ANGLES = np.linspace(0.05, 0.4, 8)  # omega h


def stepped(scheme: Tableau, angle: float) -> complex:
    """One step of the oscillator q'' = -q over ``angle``, from q = 1 at rest, as q_1 + i v_1."""
    q, v, h = 1.0, 0.0, angle
    accelerations = []
    stage_q, stage_v = q, v
    for node in (*scheme.node[1:], None):
        a = -stage_q
        accelerations.append(a)
        if node is not None:
            stage_q, stage_v = q + node * h * stage_v, v + node * h * a
    weighted = np.dot(scheme.weight, accelerations)
    moved = np.dot(scheme.position, accelerations)
    return complex(
        q + h * (v + h * scheme.share * moved), v + h * scheme.share * weighted
    )


def order(scheme: Tableau) -> float:
    """Order of a scheme: the slope of its error over the step, less the one of a single step."""
    errors = [
        abs(stepped(scheme, angle) - complex(np.cos(angle), -np.sin(angle)))
        for angle in ANGLES
    ]
    return float(np.polyfit(np.log(ANGLES), np.log(errors), 1)[0]) - 1.0


def test_the_classical_scheme_is_of_fourth_order() -> None:
    assert 3.9 < order(RK4) < 4.1
    assert (
        order(RK4._replace(weight=(1.0, 2.1, 1.9, 1.0), node=(0.0, 0.45, 0.45, 1.0)))
        < 2.5
    )


def test_weights_sum_to_the_step() -> None:
    assert sum(RK4.weight) * RK4.share == 1.0
    assert sum(RK4.position) * RK4.share == 0.5


def test_stages_in_the_middle_are_alike() -> None:
    """The core reads the coefficients of one of them for both."""
    for values in (RK4.node, RK4.weight, RK4.position):
        assert values[1] == values[2]


def test_the_middle_of_a_cubic_is_exact() -> None:
    cubic = np.polynomial.Polynomial([0.3, -1.2, 0.7, 2.1])
    begin, end = -0.4, 0.9
    values, slopes = (
        [cubic(x) for x in (begin, end)],
        [cubic.deriv()(x) for x in (begin, end)],
    )
    middle, d = 0.5 * (begin + end), end - begin
    value = CUBIC_MIDDLE.value_by_values * sum(
        values
    ) + CUBIC_MIDDLE.value_by_slopes * d * (slopes[0] - slopes[1])
    slope = CUBIC_MIDDLE.slope_by_values * (
        values[1] - values[0]
    ) / d - CUBIC_MIDDLE.slope_by_slopes * sum(slopes)
    assert_allclose(
        [value, slope], [cubic(middle), cubic.deriv()(middle)], rtol=1e-14, atol=0
    )
    assert_allclose(
        d * (slopes[0] + 4.0 * slope + slopes[1]) / 6.0,
        values[1] - values[0],
        rtol=1e-14,
        atol=0,
    )


def test_newmark_keeps_the_energy_of_an_oscillator() -> None:
    """One step of q'' = -q with the factor that the coefficients give."""
    q, v, h = 1.0, 0.3, 0.7
    a = -q
    right = -2.0 * q + 2.0 * NEWMARK.damping / h * v
    moved = right / (NEWMARK.mass / h**2 + 1.0)
    q_1, v_1 = q + moved, NEWMARK.damping * moved / h - v
    assert_allclose(q_1**2 + v_1**2, q**2 + v**2, rtol=1e-14, atol=0)
    a_1 = -q_1
    taylor = q + h * v + h**2 * ((0.5 - NEWMARK.beta) * a + NEWMARK.beta * a_1)
    assert_allclose(q_1, taylor, rtol=1e-14, atol=0)
    assert_allclose(
        v_1,
        v + h * ((1.0 - NEWMARK.gamma) * a + NEWMARK.gamma * a_1),
        rtol=1e-14,
        atol=0,
    )


@pytest.mark.parametrize(("beta", "gamma"), [(1 / 6, 0.5), (0.25, 0.6), (0.3025, 0.6)])
def test_other_newmark_schemes_are_refused(beta: float, gamma: float) -> None:
    with pytest.raises(
        ValueError, match="written for the average acceleration, 1/4, 1/2"
    ):
        average_acceleration(beta, gamma)
