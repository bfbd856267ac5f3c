"""Laws of the difference between a record and its healthy twin, tooth by tooth."""

import numpy as np
from numpy.testing import assert_allclose

from diagnose.baselines.oracle_teeth import GEAR_FEATURES, difference_features


def gear(damage=0.0):
    """A record and its twin in other noise; one tooth of the record is damaged."""
    rng = np.random.default_rng(0)
    errors = rng.standard_normal((2, 23, 64))
    record, twin = (errors + 0.01 * rng.standard_normal(errors.shape) for _ in "12")
    record[:, 7] += damage * rng.standard_normal((2, 64))
    return record, twin


def largest(record, twin):
    values = difference_features(record, twin)
    assert values.shape == (len(GEAR_FEATURES),)
    return values[GEAR_FEATURES.index("largest_0")]


def test_damage_stands_out_however_large_the_errors_of_sound_teeth():
    sound, damaged = largest(*gear()), largest(*gear(damage=0.1))
    assert damaged > sound + 2
    assert largest(*gear(damage=0.3)) > damaged


def test_features_depend_neither_on_level_nor_on_the_first_tooth():
    record, twin = gear(damage=0.1)
    features = difference_features(record, twin)
    for other in (
        difference_features(100 * record, 100 * twin),
        difference_features(np.roll(record, 5, axis=1), np.roll(twin, 5, axis=1)),
    ):
        assert_allclose(other, features, rtol=1e-6, atol=1e-6)
    assert np.abs(difference_features(*gear()) - features).max() > 0.1


def test_a_gear_of_few_passed_teeth_is_unknown():
    record, twin = gear()
    record[:, 4:], twin[:, 4:] = 0, 0
    assert np.isnan(difference_features(record, twin)).all()
