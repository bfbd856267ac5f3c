"""Sizes and durations as people read them, numbers as JSON has them."""

import math

import pytest

from gensig.text.amounts import duration_text, finite, size_text


@pytest.mark.parametrize(
    ("n_bytes", "text"),
    [
        (0, "0 B"),
        (999, "999 B"),
        (999_600, "1 MB"),
        (413_142_847, "413 MB"),
        (826_000_000_000, "826 GB"),
        (1.21e12, "1.21 TB"),
        (2e19, "2e+04 PB"),
    ],
)
def test_a_size_has_three_digits_and_the_largest_unit_that_fits(n_bytes, text):
    assert size_text(n_bytes) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.2, "1 s"),
        (59.4, "59 s"),
        (59.6, "1 min 0 s"),
        (190.0, "3 min 10 s"),
        (7500.0, "2 h 5 min"),
        (962_000.0, "11 d 3 h"),
    ],
)
def test_a_duration_has_its_two_largest_units(seconds, text):
    assert duration_text(seconds) == text


@pytest.mark.parametrize(
    ("value", "shown"), [(2, 2.0), (-0.5, -0.5), (math.nan, None), (-math.inf, None)]
)
def test_json_holds_finite_numbers_alone(value, shown):
    assert finite(value) == shown
