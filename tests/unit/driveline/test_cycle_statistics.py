"""Statistics over the cycles of the crank: exact for periodic signals, robust to one impact."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.driveline.excitation.cycle_statistics import (
    fluctuations,
    order_amplitudes,
    typical_extremes,
    whole_cycles,
)

CYCLE = 4.0 * np.pi


def crank(n_cycles, *, rise=0.0, n_samples=20000):
    """Angle of a crank that turns evenly, or ever faster."""
    x = np.linspace(0.0, 1.0, n_samples)
    return 0.3 + n_cycles * CYCLE * (x + rise * x**2) / (1.0 + rise)


@pytest.mark.parametrize("rise", [0.0, 0.4])
def test_orders_are_found_whatever_the_speed_and_the_trend(rise):
    angle = crank(6.3, rise=rise)
    signal = (
        2.0 * np.cos(0.5 * angle + 0.2)
        + 0.5 * np.sin(10.0 * angle)
        + 3.0
        + 0.01 * angle
    )
    computed = order_amplitudes(np.array([signal, -signal]), angle, 40)
    expected = np.zeros(40)
    expected[0], expected[19] = 2.0, 0.5
    assert_allclose(computed, [expected, expected], atol=0.02)


def test_fluctuation_is_half_the_peak_to_peak_of_each_cycle():
    angle = crank(5.5)
    assert [one.stop for one in whole_cycles(angle)][-1] < len(angle)
    computed = fluctuations(
        np.array([np.sin(angle), 3.0 * np.sin(0.5 * angle) + 7.0]), angle
    )
    assert computed.shape == (2, 5)
    assert_allclose(computed, np.array([[1.0], [3.0]]) * np.ones((2, 5)), rtol=1e-5)


def test_one_impact_moves_the_extremes_of_a_run_but_not_the_typical_ones():
    angle = crank(9.5)
    force = np.sin(angle)[None]
    force[0, 5000] = 100.0
    least, greatest = typical_extremes(force, angle)
    assert_allclose([least[0], greatest[0]], [-1.0, 1.0], rtol=1e-5)
    assert force.max() == 100.0


def test_less_than_a_cycle_is_refused():
    with refused("less than a cycle of two turns; simulate longer"):
        whole_cycles(crank(0.9))
