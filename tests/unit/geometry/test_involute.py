import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from refusals import refused

from gensig.errors import GeometryError
from gensig.geometry.involute import inverse_involute, involute


def test_known_value():
    # inv(20 deg), any table of gear geometry
    assert_allclose(involute(math.radians(20)), 0.014904, rtol=0, atol=5e-7)


@given(st.floats(math.radians(5), math.radians(60)))
def test_inverse_gives_the_angle_back(angle):
    assert_allclose(inverse_involute(involute(angle)), angle, rtol=1e-9, atol=0)


@given(st.floats(0.0, involute(math.radians(80))))
def test_inverse_solves_to_rounding(value):
    angle = inverse_involute(value)
    assert 0.0 <= angle <= math.radians(80) * (1 + 1e-15)
    assert_allclose(
        involute(angle), value, rtol=0, atol=1e-16 + 2e-16 * math.tan(angle) ** 2 * 4
    )


@pytest.mark.parametrize("value", [-0.01, 100.0])
def test_values_without_an_angle_are_refused(value):
    with refused("profile shifts", GeometryError):
        inverse_involute(value)
