"""Distributions and designs that plans draw from."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from gensig.dataset.distributions import check_distribution, design_points, values_at
from gensig.errors import ConfigError

SPECS = {
    "uniform": {"distribution": "uniform", "low": -1.0, "high": 3.0},
    "log_uniform": {"distribution": "log_uniform", "low": 0.1, "high": 10.0},
    "normal": {"distribution": "normal", "mean": 1.0, "std": 2.0, "low": -2.0, "high": 5.0},
    "integers": {"distribution": "integers", "low": 2, "high": 5},
    "choice": {"distribution": "choice", "values": [1.0, 2.5, 7]},
}
POINTS = (np.arange(4000) + 0.5) / 4000


@settings(deadline=None)
@given(st.sampled_from(sorted(SPECS)), st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_values_stay_in_range(kind, points):
    spec = SPECS[kind]
    values = values_at("key", spec, np.array(points))
    if kind == "choice":
        assert set(values) <= set(spec["values"])
    else:
        assert min(values) >= spec["low"] - 1e-12
        assert max(values) <= spec["high"] + 1e-12
    assert all(type(value) in (int, float) for value in values)


@pytest.mark.parametrize("kind", ["uniform", "log_uniform", "normal", "integers"])
def test_values_rise_with_the_point_and_reach_both_ends(kind):
    values = np.array(values_at("key", SPECS[kind], POINTS))
    assert np.all(np.diff(values) >= 0)
    spec = SPECS[kind]
    assert_allclose([values[0], values[-1]], [spec["low"], spec["high"]], rtol=0.02, atol=0.02)


def test_shapes():
    uniform, log_uniform, normal, integers, choice = (np.array(values_at("key", SPECS[kind], POINTS)) for kind in SPECS)
    assert_allclose([uniform.mean(), uniform.std()], [1.0, 4 / np.sqrt(12)], rtol=1e-3, atol=0)
    assert_allclose(np.median(log_uniform), 1.0, rtol=1e-3, atol=0)
    assert_allclose(normal.mean(), 1.0 + 2 * 0.0853, rtol=0.01, atol=0)  # cut at -1.5 and +2 sigma
    assert np.unique(integers, return_counts=True)[1].tolist() == [1000] * 4
    assert_allclose([np.mean(choice == value) for value in SPECS["choice"]["values"]], 1 / 3, rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        (3, "give a distribution, one of uniform, log_uniform, normal, integers, choice"),
        ({"low": 1, "high": 2}, "give a distribution"),
        ({"distribution": "unform", "low": 1, "high": 2}, "give a distribution"),
        ({"distribution": "uniform", "low": 1}, "uniform needs exactly low, high"),
        ({"distribution": "uniform", "low": 1, "high": 2, "mean": 3}, "uniform needs exactly low, high"),
        ({"distribution": "uniform", "low": 2, "high": 1}, "low = 2 and high = 1 are no range for uniform"),
        ({"distribution": "log_uniform", "low": 0, "high": 1}, "are no range for log_uniform"),
        ({"distribution": "uniform", "low": "a", "high": 1}, "low = 'a' is not a finite number"),
        ({"distribution": "uniform", "low": 0, "high": float("inf")}, "high = inf is not a finite number"),
        ({"distribution": "uniform", "low": True, "high": 2}, "low = True is not a finite number"),
        ({**SPECS["normal"], "std": 0}, "std = 0 must be positive"),
        ({"distribution": "choice", "values": []}, "values must be a list with at least one entry"),
        ({"distribution": "choice", "values": ["a"]}, "values must be numbers"),
    ],
)
def test_mistakes_are_answered(spec, text):
    with pytest.raises(ConfigError, match=re.escape(text)) as caught:
        check_distribution("operating.speed_rpm", spec)
    assert "operating.speed_rpm" in str(caught.value)


def test_whole_numbers_need_whole_ends():
    with pytest.raises(ConfigError, match=r"0\.5"):
        check_distribution("key", {"distribution": "integers", "low": 0.5, "high": 2.5})


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
@pytest.mark.parametrize("n_points", [1, 7, 64])
class TestDesigns:
    def test_shape_range_and_seed(self, design, n_points):
        one, two, other = (design_points(design, n_points, 3, np.random.default_rng(seed)) for seed in (1, 1, 2))
        assert one.shape == (n_points, 3)
        assert one.min() >= 0
        assert one.max() < 1
        assert_allclose(one, two, rtol=0, atol=0)
        assert np.abs(one - other).max() > 0

    def test_every_axis_is_filled_evenly(self, design, n_points):
        points = design_points(design, n_points, 3, np.random.default_rng(1))
        counts = np.array([np.bincount((axis * n_points).astype(int), minlength=n_points) for axis in points.T])
        assert counts.max() <= (1 if design == "latin_hypercube" else 2)


def test_no_dimension_draws_nothing():
    assert design_points("latin_hypercube", 5, 0, np.random.default_rng(0)).shape == (5, 0)


@pytest.mark.parametrize("n_dimensions", [0, 2])
def test_unknown_designs_list_the_known(n_dimensions):
    with pytest.raises(ConfigError, match=r"plan.design = 'grid'; allowed: latin_hypercube, sobol"):
        design_points("grid", 4, n_dimensions, np.random.default_rng(0))
