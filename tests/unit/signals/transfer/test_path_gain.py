"""Response of least delay with a given gain."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.signals.transfer.path_gain import gain_at, minimum_phase

RATE, STEP = 2000.0, 10.0
FREQUENCY = np.array([50.0, 100.0, 200.0, 205.0, 400.0, 900.0])
GAIN = np.array([1.0, 8.0, 0.1, 5.0, 0.5, 2.0])


def test_the_gain_is_the_given_one_at_every_line():
    even, response = minimum_phase(FREQUENCY, GAIN, RATE, STEP)
    assert_allclose(even, np.arange(0.0, 1001.0, STEP))
    expected = gain_at(even, FREQUENCY, GAIN)
    assert_allclose(np.abs(response), expected, rtol=1e-9)


def test_a_flat_gain_delays_nothing():
    _, response = minimum_phase(FREQUENCY, np.full(6, 3.0), RATE, STEP)
    assert_allclose(response, 3.0, rtol=1e-12)


@pytest.mark.parametrize("pole", [0.3, 0.8])
def test_the_phase_is_that_of_a_filter_with_a_pole_inside_the_circle(pole):
    """Among responses of one gain that of least delay is the one without zeros outside."""
    frequency = np.linspace(1.0, 999.0, 4000)

    def response_at(hertz):
        return 1.0 / (1.0 - pole * np.exp(-2j * np.pi * hertz / RATE))

    even, response = minimum_phase(
        frequency, np.abs(response_at(frequency)), RATE, STEP
    )
    expected = response_at(even)
    assert_allclose(response, expected, atol=2e-4 * np.abs(expected).max())
    anticausal = np.conj(expected)
    assert np.abs(response - anticausal).max() > 0.1
