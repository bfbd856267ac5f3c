"""Distributions and designs that plans draw from."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from refusals import refused
from scipy.stats import qmc

from gensig.dataset.distributions import (
    KEYS,
    design_points,
    read_distribution,
)

SPECS = {
    "uniform": {"distribution": "uniform", "low": -1.0, "high": 3.0},
    "log_uniform": {"distribution": "log_uniform", "low": 0.1, "high": 10.0},
    "normal": {
        "distribution": "normal",
        "mean": 1.0,
        "std": 2.0,
        "low": -2.0,
        "high": 5.0,
    },
    "integers": {"distribution": "integers", "low": 2, "high": 5},
    "choice": {"distribution": "choice", "values": [1.0, 2.5, 7]},
}
POINTS = (np.arange(4000) + 0.5) / 4000


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(sorted(KEYS)), st.lists(st.floats(0, 1), min_size=1, max_size=20)
)
def test_values_stay_in_range(kind, points):
    spec = SPECS[kind]
    distribution = read_distribution("key", spec)
    values = distribution.values_at(np.array(points))
    assert min(values) >= distribution.least - 1e-12
    if kind == "choice":
        assert set(values) <= set(spec["values"])
    else:
        assert distribution.least == spec["low"]
        assert max(values) <= spec["high"] + 1e-12
    assert all(type(value) in (int, float) for value in values)


@pytest.mark.parametrize("kind", ["uniform", "log_uniform", "normal", "integers"])
def test_values_rise_with_the_point_and_reach_both_ends(kind):
    values = np.array(read_distribution("key", SPECS[kind]).values_at(POINTS))
    assert np.all(np.diff(values) >= 0)
    spec = SPECS[kind]
    assert_allclose(
        [values[0], values[-1]], [spec["low"], spec["high"]], rtol=0.02, atol=0.02
    )


def test_shapes():
    uniform, log_uniform, normal, integers, choice = (
        np.array(read_distribution("key", spec).values_at(POINTS))
        for spec in SPECS.values()
    )
    moments = [uniform.mean(), uniform.std()]
    assert_allclose(moments, [1.0, 4 / np.sqrt(12)], rtol=1e-3, atol=0)
    assert_allclose(np.median(log_uniform), 1.0, rtol=1e-3, atol=0)
    # cut at -1.5 and +2 sigma
    assert_allclose(normal.mean(), 1.0 + 2 * 0.0853, rtol=0.01, atol=0)
    assert np.unique(integers, return_counts=True)[1].tolist() == [1000] * 4
    shares = np.unique(choice, return_counts=True)[1] / len(POINTS)
    assert_allclose(shares, 1 / 3, rtol=0, atol=1e-3)


NORMALS = (
    {"mean": 1.0, "std": 2.0, "low": -2.0, "high": 5.0},  # both sides cut
    {"mean": 0.0, "std": 1.0, "low": -9.0, "high": 0.5},  # one side
    {"mean": 0.0, "std": 1.0, "low": 30.0, "high": 40.0},  # far out in the tail
    {"mean": 20.0, "std": 1e6, "low": 10.0, "high": 30.0},  # as good as uniform
)


def cut_normal_share(value, *, mean, std, low, high):
    """Probability below a value; from the side on which it can be told from rounding."""
    side = 1.0 if low < mean else -1.0

    def tail(x):
        return 0.5 * math.erfc(-side * (x - mean) / std / math.sqrt(2.0))

    return (tail(value) - tail(low)) / (tail(high) - tail(low))


@pytest.mark.parametrize("numbers", NORMALS)
def test_a_cut_normal_has_the_normal_density_between_its_ends(numbers):
    normal = read_distribution("key", {"distribution": "normal", **numbers})
    values = normal.values_at(POINTS)
    shares = [cut_normal_share(value, **numbers) for value in values]
    assert_allclose(shares, POINTS, rtol=0, atol=1e-8)


def test_scipy_is_imported_only_when_it_draws():
    code = "import sys, gensig.dataset.distributions; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


class TestLevels:
    @pytest.mark.parametrize(
        ("kind", "levels", "expected"),
        [
            ("uniform", 5, [-1.0, 0.0, 1.0, 2.0, 3.0]),
            ("log_uniform", 3, [0.1, 1.0, 10.0]),
            ("integers", 4, [2, 3, 4, 5]),
            ("integers", 2, [2, 5]),
        ],
    )
    def test_values(self, kind, levels, expected):
        result = read_distribution("key", {**SPECS[kind], "levels": levels})
        assert_allclose(result.level_values(), expected, rtol=1e-12)

    def test_levels_of_a_normal_share_its_probability(self):
        numbers = {"mean": 2.0, "std": 1.0, "low": -7.0, "high": 11.0}
        spec = {"distribution": "normal", **numbers, "levels": 3}
        result = read_distribution("key", spec).level_values()
        assert_allclose(result, 2.0 + 0.96742157 * np.array([-1, 0, 1]), rtol=1e-7)

    @pytest.mark.parametrize("kind", sorted(set(SPECS) - {"choice"}))
    def test_designs_that_draw_pass_over_them(self, kind):
        free = read_distribution("key", {**SPECS[kind], "levels": None})
        levelled = read_distribution("key", {**SPECS[kind], "levels": 3})
        assert (free.levels, levelled.levels) == (0, 3)
        assert levelled.values_at(POINTS) == free.values_at(POINTS)


UNIFORM = SPECS["uniform"]


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        (
            3,
            "give a distribution, one of uniform, log_uniform, normal, integers, choice",
        ),
        ({"low": 1, "high": 2}, "give a distribution"),
        ({"distribution": "unform", "low": 1, "high": 2}, "give a distribution"),
        ({"distribution": "uniform", "low": 1}, "uniform needs exactly low, high"),
        ({**UNIFORM, "mean": 3}, "uniform needs exactly low, high"),
        ({**UNIFORM, "low": 4}, "low = 4 and high = 3 are no range for uniform"),
        ({**UNIFORM, "high": -1}, "low = -1 and high = -1 are no range for uniform"),
        (
            {**SPECS["integers"], "low": 5},
            "are no range for integers; low must be below",
        ),
        ({**SPECS["normal"], "low": 5.0}, "are no range for normal; low must be below"),
        (
            {**SPECS["log_uniform"], "low": 0},
            "for log_uniform; low must be below and above 0",
        ),
        ({**UNIFORM, "low": "a"}, "low = 'a' is not a finite number"),
        ({**UNIFORM, "high": float("inf")}, "high = inf is not a finite number"),
        ({**UNIFORM, "low": True}, "low = True is not a finite number"),
        ({**SPECS["normal"], "std": 0}, "std = 0 must be positive"),
        ({**SPECS["normal"], "std": -1.5}, "std = -1.5 must be positive"),
        (
            {**SPECS["normal"], "mean": float("nan")},
            "mean = nan is not a finite number",
        ),
        (
            {"distribution": "normal", "mean": 1},
            "normal needs exactly mean, std, low, high",
        ),
        ({**UNIFORM, "levels": 1}, "levels = 1 must be a whole number of at least 2"),
        (
            {**UNIFORM, "levels": 2.5},
            "levels = 2.5 must be a whole number of at least 2",
        ),
        (
            {**SPECS["integers"], "levels": 5},
            "levels = 5, but there are 4 whole numbers",
        ),
        ({**SPECS["choice"], "levels": 3}, "the levels of a choice are its values"),
        ({**SPECS["choice"], "values": []}, "must be a list with at least one entry"),
        ({**SPECS["choice"], "values": ["a"]}, "values must be finite numbers"),
        ({**SPECS["integers"], "low": 0.5}, "low = 0.5 and high = 5 must be whole"),
    ],
)
def test_mistakes_are_answered(spec, text):
    with refused(text) as caught:
        read_distribution("operating.speed_rpm", spec)
    assert "operating.speed_rpm" in str(caught.value)


def drawn(design, n_points, seed):
    """Points of three dimensions."""
    return design_points(design, n_points, 3, np.random.default_rng(seed))


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
@pytest.mark.parametrize("n_points", [1, 7, 64])
class TestDesigns:
    def test_shape_range_and_seed(self, design, n_points):
        one, two, other = (drawn(design, n_points, seed) for seed in (1, 1, 2))
        assert one.shape == (n_points, 3)
        assert 0 <= one.min() <= one.max() < 1
        assert_allclose(one, two, rtol=0, atol=0)
        assert np.abs(one - other).max() > 0

    def test_every_axis_is_filled_evenly(self, design, n_points):
        slots = (drawn(design, n_points, 1) * n_points).astype(int)
        most = max(np.bincount(axis).max() for axis in slots.T)
        assert most <= {"latin_hypercube": 1, "sobol": 2}[design]


def n_cells(one, other):
    """Cells of 16 x 16 that points hit: about 163 by chance, 16 in the order of a sequence."""
    cells = np.stack([16 * one, 16 * other]).astype(int)
    return len(np.unique(cells, axis=1).T)


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
def test_two_designs_of_one_size_have_nothing_in_common(design):
    one, other = (drawn(design, 256, seed).T for seed in (1, 2))
    assert min(map(n_cells, one, other)) > 130
    raw = (qmc.Sobol(1, rng=np.random.default_rng(seed)) for seed in (1, 2))
    assert n_cells(*(points.random_base2(8)[:, 0] for points in raw)) == 16


def test_no_dimension_draws_nothing():
    points = design_points("latin_hypercube", 5, 0, np.random.default_rng(0))
    assert points.shape == (5, 0)


@pytest.mark.parametrize("n_dimensions", [0, 2])
def test_unknown_designs_list_the_known(n_dimensions):
    text = "plan.design = 'factorial'; allowed: latin_hypercube, sobol, grid"
    with refused(text):
        design_points("factorial", 4, n_dimensions, np.random.default_rng(0))
