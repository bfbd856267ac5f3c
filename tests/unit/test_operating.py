"""Profiles of speed and torque: their mathematics, what they mean for a machine, and what is
refused."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad

from gensig.errors import ConfigError
from gensig.operation.courses import MOST_POINTS, Profile
from gensig.operation.options import read_profile
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.systems.registry import read_system

POINTS = ((-0.2, 0.5), (0.3, 0.8), (0.7, 1.0), (1.0, 0.25))
PROFILE = Profile(
    times=tuple(time for time, _ in POINTS),
    factors=tuple(factor for _, factor in POINTS),
)


@pytest.fixture
def operating(xiamen):
    return replace(
        xiamen.operating,
        speed_profile=PROFILE,
        torque_profile=Profile(times=(0.0, 2.0), factors=(0.0, 1.5)),
    )


def profiles():
    """Any profile around time 0."""
    pieces = st.lists(
        st.tuples(st.floats(0.01, 2.0), st.floats(0.1, 3.0)), min_size=2, max_size=8
    )

    def build(start, parts):
        times = start + np.cumsum([length for length, _ in parts])
        return Profile(
            times=tuple(times.tolist()), factors=tuple(factor for _, factor in parts)
        )

    return st.builds(build, st.floats(-3.0, 1.0), pieces)


class TestCurve:
    def test_linear_between_the_points_and_held_outside(self):
        assert_allclose(
            PROFILE.curve()([-9, -0.2, 0.05, 0.3, 0.5, 1.0, 40]),
            [0.5, 0.5, 0.65, 0.8, 0.9, 0.25, 0.25],
            rtol=1e-12,
            atol=0,
        )

    def test_its_slope_is_that_of_the_piece_that_begins(self):
        slope = PROFILE.curve().derivative()([-9, -0.2, 0.1, 0.3, 0.7, 1.0, 40])
        assert_allclose(slope, [0, 0.6, 0.6, 0.5, -2.5, 0, 0], rtol=1e-9, atol=1e-12)

    def test_the_same_points_make_the_same_profile(self):
        again = read_profile(
            "operating.speed_profile", [list(point) for point in POINTS]
        )
        assert again == PROFILE
        assert hash(again) == hash(PROFILE)
        assert replace(PROFILE, factors=(0.5, 0.8, 1.0, 0.3)) != PROFILE


class TestNominal:
    def test_constant_without_profiles(self, xiamen):
        times = np.array([-0.45, 0.0, 1e-6, 0.7])
        found, speed = xiamen.operating.nominal(times), xiamen.operating.speed
        assert found.angle.tobytes() == (speed * times).tobytes()
        assert_allclose(found.speed, speed, rtol=0, atol=0)
        assert_allclose(found.torque_factor, 1, rtol=0, atol=0)
        assert_allclose(
            [found.acceleration, found.torque_slope], np.zeros((2, 4)), rtol=0, atol=0
        )

    def test_whole_numbers_are_times_too(self, operating, xiamen):
        times = np.arange(3)
        for one in (operating, xiamen.operating):
            assert_allclose(
                one.nominal(times).angle,
                one.nominal(times.astype(float)).angle,
                rtol=0,
                atol=0,
            )
            assert one.nominal(times).torque_factor.dtype == np.float64

    @given(profile=profiles(), time=st.floats(-5.0, 12.0))
    def test_the_angle_is_the_integral_of_the_speed_from_time_0(
        self, xiamen, profile, time
    ):
        operating = replace(xiamen.operating, speed_profile=profile)
        inside = [
            knot for knot in profile.times if min(0.0, time) < knot < max(0.0, time)
        ]
        expected, _ = quad(
            lambda t: float(profile.curve()(t)),
            0.0,
            time,
            points=inside or None,
            limit=100,
        )
        found = operating.nominal(np.array([time, 0.0])).angle
        assert_allclose(
            found,
            [operating.speed * expected, 0.0],
            rtol=1e-9,
            atol=1e-9 * operating.speed,
        )

    def test_torque_follows_its_own_profile(self, operating):
        found = operating.nominal(np.array([-1.0, 0.5, 9.0]))
        assert_allclose(found.torque_factor, [0, 0.375, 1.5], rtol=1e-12, atol=0)
        assert_allclose(found.torque_slope, [0, 0.75, 0], rtol=1e-12, atol=0)


class TestConfiguration:
    def test_profiles_compose_and_read(self):
        words = [
            "operating.speed_profile=[[0,0.5],[1,1]]",
            "operating.torque_profile=[[0.1,0],[0.2,1.5],[1,1]]",
        ]
        config = read_request(words).config
        assert config["operating"]["speed_profile"] == [[0, 0.5], [1, 1]]
        operating = read_system(config).operating
        assert operating.speed_profile == Profile(times=(0.0, 1.0), factors=(0.5, 1.0))
        assert operating.torque_profile == Profile(
            times=(0.1, 0.2, 1.0), factors=(0.0, 1.5, 1.0)
        )

    def test_a_drawn_speed_scales_the_profile(self, config_with):
        config = config_with({"operating.speed_profile": [[0, 0.5], [1, 1]]})
        slow, fast = (
            InputReader(config).machine({"operating.speed_rpm": speed}).operating
            for speed in (600.0, 1200.0)
        )
        times = np.array([-0.3, 0.5, 2.0])
        assert_allclose(
            slow.nominal(times).speed,
            20 * math.pi * np.array([0.5, 0.75, 1.0]),
            rtol=1e-12,
            atol=0,
        )
        assert_allclose(
            fast.nominal(times).angle, 2 * slow.nominal(times).angle, rtol=1e-12, atol=0
        )

    def test_as_many_points_as_allowed(self):
        many = read_profile(
            "operating.speed_profile",
            [[place * 1e-3, 1.0] for place in range(MOST_POINTS)],
        )
        assert len(many.times) == MOST_POINTS

    @pytest.mark.parametrize("key", ["speed_profile", "torque_profile"])
    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (3, " = 3 is no list; give [time_s, factor] pairs, a group with a kind"),
            ({"a": 1}, ".kind = None; allowed: ramp, random_walk, file"),
            ({"kind": "sine"}, ".kind = 'sine'; allowed: ramp, random_walk, file"),
            ([[0, 1]], ": 1 points; give 2 to 100000"),
            ([[k, 1] for k in range(100_001)], ": 100001 points; give 2 to 100000"),
            ([0, 1], ": point 0 = 0; give two finite numbers, [time_s, factor]"),
            ([[0, 1], [1, 1, 1]], ": point 1 = [1, 1, 1]; give two finite numbers"),
            ([[0, True], [1, 1]], ": point 0 = [0, True]; give two finite numbers"),
            ([[0, math.nan], [1, 1]], ": point 0 = [0, nan]; give two finite numbers"),
            ([[0, 1], [1, 10**400]], ": point 1 = [1, 1000"),
            ([[0, 1], [2e6, 1]], ": point 1 = [2e+06, 1]; give a time within 1e+06 s"),
            (
                [[0, 1], [1, 1], [0.5, 1]],
                ": the time 0.5 s follows 1 s; times must increase",
            ),
            ([[0, 1], [1e-5, 1]], "times must increase, by 0.001 s or more"),
            ([[0, 1], [1, -0.5]], ": factor -0.5 must "),
        ],
    )
    def test_refusals(self, config_with, key, value, text):
        with pytest.raises(ConfigError, match=re.escape(text)) as caught:
            read_system(config_with({f"operating.{key}": value}))
        assert str(caught.value).startswith(f"operating.{key}")
        assert "\n" not in str(caught.value)

    def test_a_torque_may_fall_to_nothing_but_no_speed(self, machine):
        value = [[0, 1], [1, 0]]
        assert (
            machine({"operating.torque_profile": value}).operating.torque_profile
            is not None
        )
        with pytest.raises(
            ConfigError,
            match=re.escape("operating.speed_profile: factor 0 must be positive"),
        ):
            machine({"operating.speed_profile": value})

    @pytest.mark.parametrize("factors", [(1.0,), (1.0, math.nan), (1.0, math.inf)])
    def test_profiles_made_in_python_are_checked_too(self, factors):
        with pytest.raises(ConfigError, match=r"one factor a time|a finite factor"):
            Profile(times=(0.0, 1.0), factors=factors)
