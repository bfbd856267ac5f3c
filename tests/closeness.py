"""Comparison of numbers with tolerances that are 0 unless given."""

from numpy.testing import assert_allclose


def assert_close(actual, expected, rtol=0.0, *, atol=0.0):
    """Raise AssertionError unless ``abs(actual - expected) <= atol + rtol * abs(expected)``."""
    assert_allclose(actual, expected, rtol=rtol, atol=atol)
