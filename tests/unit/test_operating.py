"""Profiles of speed and torque: their mathematics, and what they mean for a machine."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad

from gensig.errors import ConfigError
from gensig.operation.courses import Profile

PROFILE = Profile(
    times=(-0.2, 0.3, 0.7, 1.0),
    factors=(0.5, 0.8, 1.0, 0.25),
)


@pytest.fixture
def operating(xiamen):
    torque = Profile(
        times=(0.0, 2.0),
        factors=(0.0, 1.5),
    )
    return replace(xiamen.operating, speed_profile=PROFILE, torque_profile=torque)


@st.composite
def profiles(draw):
    """Any profile around time 0."""
    piece = st.tuples(
        st.floats(0.01, 2.0),
        st.floats(0.1, 3.0),
    )
    pieces = draw(st.lists(piece, min_size=2, max_size=8))
    lengths, factors = zip(*pieces, strict=True)
    times = draw(st.floats(-3.0, 1.0)) + np.cumsum(lengths)
    return Profile(
        times=tuple(times.tolist()),
        factors=factors,
    )


class TestCurve:
    def test_linear_between_the_points_and_held_outside(self):
        values = PROFILE.curve()([-9, -0.2, 0.05, 0.3, 0.5, 1.0, 40])
        expected = [0.5, 0.5, 0.65, 0.8, 0.9, 0.25, 0.25]
        assert_allclose(values, expected)

    def test_its_slope_is_that_of_the_piece_that_begins(self):
        slope = PROFILE.curve().derivative()([-9, -0.2, 0.1, 0.3, 0.7, 1.0, 40])
        assert_allclose(
            slope,
            [0, 0.6, 0.6, 0.5, -2.5, 0, 0],
            atol=1e-12,
        )

    def test_the_same_points_make_the_same_profile(self):
        same = replace(PROFILE)
        assert same == PROFILE
        assert hash(same) == hash(PROFILE)
        assert replace(PROFILE, factors=(0.5, 0.8, 1.0, 0.3)) != PROFILE

    @pytest.mark.parametrize(
        "factors",
        [(1.0,), (1.0, math.nan), (1.0, math.inf)],
    )
    def test_profiles_made_in_python_are_checked_too(self, factors):
        with pytest.raises(ConfigError, match=r"one factor a time|a finite factor"):
            Profile(times=(0.0, 1.0), factors=factors)


class TestNominal:
    def test_constant_without_profiles(self, xiamen):
        times = np.array([-0.45, 0.0, 1e-6, 0.7])
        result, speed = xiamen.operating.nominal(times), xiamen.operating.speed
        assert_array_equal(result.angle, speed * times)
        assert_array_equal(result.speed, speed)
        assert_array_equal(result.torque_factor, 1)
        assert_array_equal(result.acceleration, 0)
        assert_array_equal(result.torque_slope, 0)

    def test_whole_numbers_are_times_too(self, operating, xiamen):
        for each in (operating, xiamen.operating):
            whole, floats = (each.nominal(np.arange(3, dtype=t)) for t in (int, float))
            assert_array_equal(whole.angle, floats.angle)
            assert whole.torque_factor.dtype == np.float64

    @given(
        profile=profiles(),
        time=st.floats(-5.0, 12.0),
    )
    def test_the_angle_is_the_integral_of_the_speed_from_time_0(
        self, xiamen, profile, time
    ):
        operating = replace(xiamen.operating, speed_profile=profile)
        low, high = sorted((0.0, time))
        knots = [knot for knot in profile.times if low < knot < high]
        turned, _ = quad(
            profile.curve(),
            0.0,
            time,
            points=knots or None,
            limit=100,
        )
        angle = operating.nominal(np.array([time, 0.0])).angle
        expected = [operating.speed * turned, 0.0]

        assert_allclose(angle, expected, atol=1e-9 * operating.speed)

    def test_torque_follows_its_own_profile(self, operating):
        result = operating.nominal(np.array([-1.0, 0.5, 9.0]))
        assert_allclose(result.torque_factor, [0, 0.375, 1.5])
        assert_allclose(result.torque_slope, [0, 0.75, 0])
