"""Ramps and random walks: their mathematics and statistics. Ripple is in test_operation."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.operation.courses import (
    EARLIEST,
    MOST_POINTS,
    WALK_LIMIT,
    Ramp,
    RandomWalk,
    Ripple,
)

WALK = RandomWalk(scatter=0.02, correlation_time=0.4)


def walk(seed, process=WALK, duration=1.0):
    return process.profile(
        duration,
        np.random.Generator(np.random.SFC64(seed)),
    )


class TestRamp:
    def test_from_the_begin_to_the_end_of_the_record(self):
        ramp = Ramp(first_factor=0.5, last_factor=1.0)
        whole = ramp.profile(4.0).curve()
        early = replace(ramp, begin=-1.0, end=1.0).profile(4.0).curve()
        times = [-1, 0, 2, 4, 9]

        assert_allclose(
            whole(times),
            [0.5, 0.5, 0.75, 1, 1],
        )
        assert_allclose(
            early([-2, 0, 2]),
            [0.5, 0.75, 1],
        )


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

        assert_allclose(
            normed.mean(axis=0),
            0.0,
            atol=most,
        )
        assert_allclose(
            normed.std(axis=0),
            1.0,
            rtol=most / math.sqrt(2),
        )
        for lag in (1, 20, 40, 100):  # twentieths of the correlation time
            correlation = (normed[:, 0] * normed[:, lag]).mean()
            assert_allclose(
                correlation,
                math.exp(-lag / 20),
                atol=most,
            )

    def test_it_stays_above_its_least_factor(self):
        wide = RandomWalk(scatter=0.2, correlation_time=0.02)
        factors = np.array(walk(0, wide, duration=60.0).factors)
        assert_allclose(wide.least, 0.2)
        assert factors.min() >= wide.least

        share = np.mean(np.abs(factors - 1.0) > 0.999 * WALK_LIMIT * 0.2)
        assert share < 1e-3

    def test_too_short_a_correlation_time(self):
        with refused("= 0.01 must lie in 0.02..1e+06"):
            replace(WALK, correlation_time=0.01)

    def test_as_many_points_as_a_profile_takes(self):
        """One every millisecond."""
        quick = replace(WALK, correlation_time=0.02)
        duration = EARLIEST + 1e-3 * (MOST_POINTS - 2.5)
        assert len(walk(0, quick, duration).times) == MOST_POINTS
        with refused(f"needs {MOST_POINTS + 1} points"):
            walk(0, quick, duration + 1e-3)

    def test_too_many_points(self):
        quick = replace(WALK, correlation_time=0.02)
        message = "correlation_time_s = 0.02 needs 1002002 points for 1000 s"
        with refused(message) as caught:
            walk(0, quick, duration=1000.0)

        least = float(re.search(r"give ([\d.]+) or more", str(caught.value))[1])
        allowed = walk(
            0,
            replace(WALK, correlation_time=least),
            duration=1000.0,
        )
        assert len(allowed.times) > 90_000


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
def test_ripples_that_cannot_be(values, text):
    with refused(text):
        Ripple(**values)
