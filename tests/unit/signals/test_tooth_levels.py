"""Levels by tooth: the tooth that changed is named, wherever the record starts and however loud
the sensor is."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.signals.tooth_levels import changed_teeth, tooth_levels

RATE, ROTATION, TEETH, BAND = 10_000.0, 5.0, 20, (1000.0, 3000.0)


def rattle(*, start=0.0, gains=None, seconds=4.0, seed=0):
    """Noise whose amplitude follows the tooth in mesh; the first sample is `start` teeth after
    tooth 0 came in."""
    time = np.arange(round(seconds * RATE)) / RATE
    tooth = np.floor(time * ROTATION * TEETH + start).astype(int) % TEETH
    gains = np.ones(TEETH) if gains is None else gains
    return gains[tooth] * default_rng(seed).normal(size=time.size)


def levels(signal, start=0.0):
    return tooth_levels(signal, RATE, ROTATION, TEETH, band=BAND, start=start)


def levels_of(*, start=0.0, **changes):
    return levels(rattle(start=start, **changes), start)


@pytest.mark.parametrize(
    "start",
    [0.0, 7.0, 13.4, 59.9],
)
def test_a_tooth_twice_as_loud_is_six_decibels_up_under_its_own_number(start):
    gains = np.ones(TEETH)
    gains[11] = 2.0
    loud, even = (levels_of(start=start, gains=values) for values in (gains, None))
    result = loud - even

    assert result.argmax() == 11
    # the filter smears the edges of a passage of 10 ms by less than one
    assert_allclose(
        result[11],
        20 * np.log10(2),
        atol=0.6,
    )
    assert_allclose(
        np.delete(result, [10, 11, 12]),
        0.0,
        atol=1e-3,
    )


def test_channels_side_by_side_are_each_their_own():
    both = np.stack([rattle(seed=1), rattle(seed=2)])
    assert_allclose(
        levels(both),
        [levels(channel) for channel in both],
    )


def test_changes_do_not_see_gain_and_are_none_where_nothing_changed():
    quiet, other = levels_of(seed=3), levels_of(seed=4)
    change = changed_teeth(quiet, other)
    assert_allclose(
        changed_teeth(quiet + 12.0, other),
        change,
        atol=1e-9,
    )
    assert_array_equal(changed_teeth(quiet, quiet), np.zeros(TEETH))


def test_a_pattern_of_the_machine_goes_away_and_the_tooth_stays():
    pattern = 10 ** default_rng(5).uniform(-0.5, 0.5, TEETH)
    bad = pattern.copy()
    loudest = int(pattern.argmax())
    bad[loudest] *= 0.6
    alone = levels_of(gains=bad, seed=6)
    result = changed_teeth(
        alone,
        levels_of(gains=pattern, seed=7),
    )

    assert result.argmin() == loudest
    assert result[loudest] < -3.0
    assert alone.argmin() != loudest  # without the reference the pattern hides it


def test_a_silent_signal_is_finite_and_a_short_one_refused():
    assert np.isfinite(levels(np.zeros(40_000))).all()
    with refused("no whole turn", ValueError):
        levels(rattle(seconds=0.15))
    with refused("must lie inside", ValueError):
        tooth_levels(
            rattle(),
            RATE,
            ROTATION,
            TEETH,
            band=(4000.0, 6000.0),
        )
