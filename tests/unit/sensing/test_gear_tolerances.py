"""Limits of ISO 1328-1:2013 against numbers worked out by hand from its formulas."""

import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.sensing.gear_tolerances import (
    cumulative_pitch_limit,
    profile_form_limit,
    profile_slope_limit,
    runout_limit,
    single_pitch_limit,
)

UM = 1e-6
LIMITS = (
    single_pitch_limit,
    cumulative_pitch_limit,
    profile_slope_limit,
    profile_form_limit,
    runout_limit,
)
# grade 5, module 2 mm, 23 teeth (d = 46 mm, root 6.78233) and 84 teeth (d = 168 mm, root 12.96148)
BY_HAND = {
    single_pitch_limit: (0.046 + 0.8 + 5, 0.168 + 0.8 + 5),
    cumulative_pitch_limit: (0.092 + 3.730282 + 1.4 + 12, 0.336 + 7.128815 + 1.4 + 12),
    profile_slope_limit: (0.8 + 0.046 + 4, 0.8 + 0.168 + 4),
    profile_form_limit: (1.1 + 5, 1.1 + 5),
    runout_limit: (0.9 * 17.222282, 0.9 * 20.864815),
}


@pytest.mark.parametrize("limit", LIMITS)
def test_grade_5_by_hand(xiamen, limit):
    for gear, expected in zip(
        (xiamen.pair.pinion, xiamen.pair.wheel), BY_HAND[limit], strict=True
    ):
        assert_allclose(
            limit(gear, 5),
            expected * UM,
            rtol=1e-6,
        )


@pytest.mark.parametrize("limit", LIMITS)
def test_two_grades_are_a_factor_of_two(xiamen, limit):
    for gear in (xiamen.pair.pinion, xiamen.pair.wheel):
        assert_allclose(
            limit(gear, 7),
            2 * limit(gear, 5),
        )
        assert_allclose(
            limit(gear, 5.5) ** 2,
            limit(gear, 5) * limit(gear, 6),
        )


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("grade", [0.9, 12])
def test_grades_that_there_are_not(xiamen, limit, grade):
    with refused(f"has the grades 1 to 11, not {grade:g}"):
        limit(xiamen.pair.pinion, grade)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"n_teeth": 1001},
            "covers 5 to 1000 teeth, the pinion has 1001; set quality.iso1328_grade=null",
        ),
        ({"normal_module": 0.4e-3}, "covers 0.5 to 70 mm module, the pinion has 0.4;"),
        (
            {"normal_module": 20e-3, "n_teeth": 800},
            "covers 5 to 15000 mm reference diameter, the pinion has 16000;",
        ),
    ],
)
def test_gears_that_are_not_covered(gear_with, changes, text):
    for limit in LIMITS:
        with refused(text):
            limit(gear_with(**changes), 5)


def test_the_ends_of_the_range_are_covered(gear_with):
    for changes in (
        {"n_teeth": 1000},
        {"normal_module": 0.5e-3},
        {"normal_module": 70e-3},
    ):
        assert single_pitch_limit(gear_with(**changes), 5) > 0.0
