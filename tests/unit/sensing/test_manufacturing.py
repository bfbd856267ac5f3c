"""Draws of specimens and gearboxes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.sensing.manufacturing import (
    draw_gearbox,
    draw_specimen,
    nominal_gearbox,
    perfect_specimen,
    single_pitch_limit,
)


def rng(seed=0):
    return np.random.default_rng(seed)


def largest_step(error):
    return np.abs(np.diff(np.append(error, error[0]))).max()


def test_single_pitch_limit_of_iso_1328(xiamen):
    # 0.001 x 46 + 0.4 x 2 + 5 = 5.846 um in grade 5, a factor sqrt(2) for every grade
    assert_allclose(single_pitch_limit(xiamen.pair.pinion, 5), 5.846e-6, rtol=1e-9, atol=0)
    assert_allclose(single_pitch_limit(xiamen.pair.pinion, 7), 2 * 5.846e-6, rtol=1e-9, atol=0)


@pytest.mark.parametrize("grade", [3, 5, 8])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_largest_step_is_the_used_share_of_the_limit(xiamen, grade, share):
    quality = replace(xiamen.quality, iso1328_grade=grade, used_share_low=share, used_share_high=share)
    pair = xiamen.pair
    specimen = draw_specimen(rng(1), pair.pinion, pair.wheel, quality)
    for gear, error in ((pair.pinion, specimen.pinion_error), (pair.wheel, specimen.wheel_error)):
        assert error.shape == (gear.n_teeth,)
        assert_allclose(largest_step(error), share * single_pitch_limit(gear, grade), rtol=1e-9, atol=0)
        assert_allclose(error.mean(), 0.0, rtol=0, atol=1e-12)


def test_the_used_share_lies_in_its_range(xiamen):
    quality, pair = xiamen.quality, xiamen.pair
    shares = [
        largest_step(draw_specimen(rng(seed), pair.pinion, pair.wheel, quality).pinion_error)
        / single_pitch_limit(pair.pinion, quality.iso1328_grade)
        for seed in range(60)
    ]
    assert min(shares) >= quality.used_share_low
    assert max(shares) <= quality.used_share_high
    assert np.ptp(shares) > 0.3


def test_no_grade_is_perfect(xiamen):
    specimen = draw_specimen(rng(), xiamen.pair.pinion, xiamen.pair.wheel, replace(xiamen.quality, iso1328_grade=None))
    perfect = perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel)
    for key in ("pinion_error", "wheel_error"):
        assert_allclose(getattr(specimen, key), getattr(perfect, key), rtol=0, atol=0)


def test_gearbox_factors_scatter_as_told(xiamen):
    quality = replace(xiamen.quality, support_stiffness_scatter=0.2, support_damping_scatter=0.1)
    drawn = [draw_gearbox(rng(seed), 4, quality, 0.05) for seed in range(400)]
    for key, scatter in (("stiffness_factor", 0.2), ("damping_factor", 0.1), ("gain", 0.05)):
        logarithm = np.log([getattr(gearbox, key) for gearbox in drawn])
        assert_allclose(logarithm.std(), scatter, rtol=0.06, atol=0)
        assert_allclose(logarithm.mean(), 0.0, rtol=0, atol=0.1 * scatter)


def test_no_scatter_is_nominal(xiamen):
    quality = replace(xiamen.quality, support_stiffness_scatter=0.0, support_damping_scatter=0.0)
    drawn, nominal = draw_gearbox(rng(), 3, quality, 0.0), nominal_gearbox(3)
    for key in ("stiffness_factor", "damping_factor", "gain"):
        assert_allclose(getattr(drawn, key), getattr(nominal, key), rtol=0, atol=0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"iso1328_grade": 12}, "quality.iso1328_grade = 12 must lie in 1..11, or be null"),
        ({"used_share_low": 0.95}, "quality.used_share_low and used_share_high must be ordered"),
        ({"support_damping_scatter": -0.1}, "quality.support_damping_scatter = -0.1 must lie in 0..1"),
    ],
)
def test_values_out_of_range(xiamen, changes, text):
    with pytest.raises(ConfigError, match=re.escape(text)):
        replace(xiamen.quality, **changes)
