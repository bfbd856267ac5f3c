"""Ramps, random walks and ripple: their mathematics and statistics."""

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad

from gensig.errors import ConfigError
from gensig.operation.courses import (
    EARLIEST,
    WALK_LIMIT,
    Profile,
    Ramp,
    RandomWalk,
    Ripple,
)

WALK = RandomWalk(scatter=0.02, correlation_time=0.4)
BENT = Profile(times=(-0.3, 0.1, 0.5, 0.9), factors=(0.5, 1.2, 0.8, 1.0))
RIPPLES = {
    "order": Ripple(share=0.1, order=2.0, phase=0.4),
    "frequency": Ripple(share=0.1, frequency=7.0, phase=-1.0),
}


def walk(seed, one=WALK, duration=1.0):
    return one.profile(duration, np.random.Generator(np.random.SFC64(seed)))


class TestRamp:
    def test_from_the_begin_to_the_end_of_the_record(self):
        ramp = Ramp(first_factor=0.5, last_factor=1.0)
        whole = ramp.profile(4.0).curve()
        early = replace(ramp, begin=-1.0, end=1.0).profile(4.0).curve()
        times = [-1, 0, 2, 4, 9]
        assert_allclose(whole(times), [0.5, 0.5, 0.75, 1, 1], rtol=1e-12)
        assert_allclose(early([-2, 0, 2]), [0.5, 0.75, 1], rtol=1e-12)


class TestRandomWalk:
    def test_the_same_seed_makes_the_same_walk(self):
        assert walk(3) == walk(3)
        assert walk(3) != walk(4)

    def test_a_longer_record_goes_on_from_a_shorter_one(self):
        short, long = walk(5), walk(5, duration=9.0)
        assert long.factors[: len(short.factors)] == short.factors
        assert long.times[: len(short.times)] == short.times
        assert short.times[0] == EARLIEST
        assert short.times[-1] > 1.0

    def test_scatter_and_correlation(self):
        """Over independent seeds; 4.5 standard errors of 4000 draws."""
        draws = np.array([walk(seed, duration=0.1).factors for seed in range(4000)])
        normed = (draws - 1.0) / WALK.scatter
        most = 4.5 / math.sqrt(len(draws))
        assert_allclose(normed.mean(axis=0), 0.0, atol=most)
        assert_allclose(normed.std(axis=0), 1.0, rtol=most / math.sqrt(2))
        for lag in (1, 20, 40, 100):  # twentieths of the correlation time
            correlation = (normed[:, 0] * normed[:, lag]).mean()
            assert_allclose(correlation, math.exp(-lag / 20), atol=most)

    def test_it_stays_above_its_least_factor(self):
        wide = RandomWalk(scatter=0.2, correlation_time=0.02)
        factors = np.array(walk(0, wide, duration=60.0).factors)
        assert wide.least == pytest.approx(0.2)
        assert factors.min() >= wide.least
        share = np.mean(np.abs(factors - 1.0) > 0.999 * WALK_LIMIT * 0.2)
        assert share < 1e-3

    def test_too_short_a_correlation_time(self):
        with pytest.raises(ConfigError, match=r"= 0.01 must lie in 0.02..1e\+06"):
            replace(WALK, correlation_time=0.01)

    def test_too_many_points(self):
        quick = replace(WALK, correlation_time=0.02)
        message = "correlation_time_s = 0.02 needs 1002002 points for 1000 s"
        with pytest.raises(ConfigError, match=message) as caught:
            walk(0, quick, duration=1000.0)
        least = float(re.search(r"give ([\d.]+) or more", str(caught.value))[1])
        allowed = walk(0, replace(WALK, correlation_time=least), duration=1000.0)
        assert len(allowed.times) > 90_000


class TestRipple:
    @pytest.mark.parametrize("profile", [None, BENT], ids=["constant", "bent"])
    @pytest.mark.parametrize("name", list(RIPPLES))
    @given(time=st.floats(-1.5, 2.0))
    @settings(max_examples=25, deadline=None)
    def test_what_it_gains_is_its_integral(self, name, profile, time):
        ripple, set_speed = RIPPLES[name], 40.0
        course = profile or Profile(times=(0.0, 1.0), factors=(1.0, 1.0))
        curve = course.curve()
        turned = curve.antiderivative()

        def angle(t):
            return set_speed * (turned(t) - turned(0.0))

        def wave(t):
            t = np.asarray(t)
            return float(curve(t) * ripple.share * np.sin(ripple.psi(t, angle(t))))

        low, high = sorted((0.0, time))
        knots = [knot for knot in course.times if low < knot < high]
        edges = sorted([0.0, *knots, time], reverse=time < 0.0)
        pieces = [quad(wave, a, b, limit=200)[0] for a, b in itertools.pairwise(edges)]
        at = np.array([time, 0.0])
        gained = ripple.gained(at, angle(at), set_speed, profile)
        assert_allclose(gained, [sum(pieces), 0.0], rtol=1e-8, atol=1e-10)

    @pytest.mark.parametrize("name", list(RIPPLES))
    def test_later_is_the_same_function_of_time(self, name):
        ripple, times, speed, delay = RIPPLES[name], np.linspace(-1, 1, 9), 30.0, 0.37
        later = times + delay
        moved = ripple.later(delay, speed * delay).psi(later, speed * later)
        assert_allclose(moved, ripple.psi(times, speed * times), atol=1e-12)

    @pytest.mark.parametrize(
        ("values", "text"),
        [
            (
                {"share": 1.0, "order": 1.0},
                "share = 1 must lie in 0..1, 1 not included",
            ),
            ({"share": -0.1, "order": 1.0}, "share = -0.1 must lie in 0..1"),
            ({"share": 0.1, "order": 1.0, "frequency": 5.0}, "give order (of the pini"),
            ({"share": 0.1, "order": 0.0}, "order = 0 must be positive"),
            ({"share": 0.1, "frequency": -5.0}, "frequency_hz = -5 must be positive"),
        ],
    )
    def test_refusals(self, values, text):
        with pytest.raises(ConfigError, match=re.escape(text)):
            Ripple(**values)
