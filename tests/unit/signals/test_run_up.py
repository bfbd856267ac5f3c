"""Laws of order maps and waterfalls over the speed of a run-up."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused
from scipy.signal import lsim

from gensig.signals.run_up.level_map import decibels, peaks_over_speed
from gensig.signals.run_up.speed_maps import (
    LEAST_TURNS,
    MOST_CHANGE,
    frequency_map,
    order_map,
    speed_change,
)

RATE = 8192.0
DURATION = 20.0
TIME = np.arange(int(RATE * DURATION)) / RATE
LOW, HIGH = 8.0, 24.0  # turns a second
AMPLITUDE = 3.0


def ramp(time=TIME, low=LOW, high=HIGH, duration=DURATION):
    """Angle of a shaft whose speed rises evenly, (sample,) rad."""
    return 2.0 * np.pi * (low * time + 0.5 * (high - low) / duration * time**2)


ANGLE = ramp()


@pytest.mark.parametrize("order", [1.0, 5.0, 23.0])
def test_a_chirp_of_an_order_is_a_ridge_there_with_its_level(order):
    result = order_map(AMPLITUDE * np.sin(order * ANGLE), ANGLE, RATE)
    assert_allclose(result.axis[np.nanargmax(result.rms, axis=-1)], order)
    assert_allclose(result.at(order), AMPLITUDE / np.sqrt(2.0), rtol=3e-3)
    assert_allclose(result.total, AMPLITUDE / np.sqrt(2.0), rtol=2e-2)
    far = np.abs(result.axis - order) > 2.0 * result.resolution
    assert np.nanmax(result.rms[:, far]) < 1e-2 * AMPLITUDE


def test_a_tone_of_a_fixed_frequency_is_no_ridge_of_an_order():
    """The twin of the law above: the tone crosses the orders."""
    result = order_map(np.sin(2.0 * np.pi * 100.0 * TIME), ANGLE, RATE)
    ridge = result.axis[np.nanargmax(result.rms, axis=-1)]
    frequency = ridge * result.speed / (2.0 * np.pi)
    assert ridge.max() > 2.0 * ridge.min()
    assert_allclose(frequency, 100.0, atol=result.resolution * HIGH)


def test_a_tone_of_a_fixed_frequency_is_upright_in_the_waterfall():
    signal = AMPLITUDE * np.sin(2.0 * np.pi * 400.0 * TIME)
    result = frequency_map(signal, ANGLE, RATE, frame=0.25)
    assert_allclose(result.axis[result.rms.argmax(axis=-1)], 400.0)
    assert_allclose(result.at(400.0), AMPLITUDE / np.sqrt(2.0), rtol=1e-6)


def test_speed_and_time_of_the_frames_are_those_of_the_shaft():
    for result in (
        order_map(np.sin(ANGLE), ANGLE, RATE),
        frequency_map(np.sin(ANGLE), ANGLE, RATE, frame=0.25),
    ):
        expected = LOW + (HIGH - LOW) / DURATION * result.time
        assert_allclose(result.speed / (2.0 * np.pi), expected, rtol=2e-3)
    assert_allclose(speed_change(ANGLE), HIGH / LOW - 1.0, rtol=0.02)
    assert speed_change(2.0 * np.pi * 10.0 * TIME) < 1e-9


def test_a_run_down_has_the_levels_of_its_run_up():
    signal = np.sin(5.0 * ANGLE) * (1.0 + ANGLE / ANGLE[-1])
    up = order_map(signal, ANGLE, RATE).by_speed()
    down_angle = ANGLE[-1] - ANGLE[::-1]
    down = order_map(signal[::-1], down_angle, RATE).by_speed()
    assert np.all(np.diff(down.speed) > 0.0)
    assert_allclose(
        np.interp(up.speed, down.speed, down.at(5.0)), up.at(5.0), rtol=0.02
    )


@pytest.mark.parametrize("natural", [60.0, 90.0])
def test_a_resonance_shows_at_the_speed_where_the_order_meets_the_mode(natural):
    """A mass on a spring, pushed at order 5."""
    omega, damping = 2.0 * np.pi * natural, 0.02
    state = [[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]]
    system = state, [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]]
    _, motion, _ = lsim(system, np.sin(5.0 * ANGLE), TIME)
    result = order_map(motion, ANGLE, RATE).by_speed()
    level = decibels(result.at(5.0), 1e-6)
    (peak,) = peaks_over_speed(level)
    rate = result.speed[peak] / (2.0 * np.pi)
    assert_allclose(5.0 * rate, natural, rtol=0.03)
    waterfall = frequency_map(motion, ANGLE, RATE, frame=0.25)
    _, largest = np.unravel_index(waterfall.rms.argmax(), waterfall.rms.shape)
    assert_allclose(waterfall.axis[largest], natural, rtol=0.05)


def test_without_a_resonance_a_level_has_no_peak():
    result = order_map(np.sin(5.0 * ANGLE), ANGLE, RATE).by_speed()
    assert peaks_over_speed(decibels(result.at(5.0), 1e-6)).size == 0


def test_orders_beyond_the_usable_frequency_are_unknown():
    result = order_map(np.sin(ANGLE), ANGLE, RATE)
    usable = np.multiply.outer(result.speed / (2.0 * np.pi), result.axis) <= 0.39 * RATE
    assert np.all(np.isfinite(result.rms[usable]))
    assert np.all(np.isnan(result.rms[-1, result.axis > 0.4 * RATE / LOW]))


def test_an_order_that_is_unknown_at_high_speeds_stays_known_at_low_ones():
    result = order_map(np.sin(ANGLE), ANGLE, RATE)
    middle = 0.39 * RATE / (0.5 * (LOW + HIGH))  # usable up to the middle of the speeds
    by_speed = result.by_speed().at(middle)
    assert np.all(np.isfinite(by_speed[: len(by_speed) // 3]))
    assert np.all(np.isnan(by_speed[-(len(by_speed) // 3) :]))


def test_channels_go_through_together():
    rows = np.stack([np.sin(5.0 * ANGLE), np.sin(7.0 * ANGLE)])
    both = order_map(rows, ANGLE, RATE)
    assert both.rms.shape[0] == both.total.shape[0] == 2
    assert_allclose(both.rms[1], order_map(rows[1], ANGLE, RATE).rms)
    assert both.by_speed().rms.shape[0] == 2


def test_power_is_kept_from_frames_to_speeds():
    result = order_map(AMPLITUDE * np.sin(5.0 * ANGLE), ANGLE, RATE).by_speed()
    known = np.isfinite(result.total)
    assert known.mean() > 0.9
    assert_allclose(result.at(5.0)[known], AMPLITUDE / np.sqrt(2.0), rtol=3e-3)


@pytest.mark.parametrize(
    ("angle", "words"),
    [
        (ramp(duration=DURATION)[: int(0.5 * RATE)], f"need {LEAST_TURNS}"),
        (ramp(low=2.0, high=300.0), f"need {100.0 * MOST_CHANGE:g} % or less"),
        (ramp(low=10.0, high=-10.0), "stands still or turns back at 10 s"),
    ],
)
def test_a_run_up_that_has_no_orders_is_refused_with_its_numbers(angle, words):
    with pytest.raises(ValueError, match=words):
        order_map(np.zeros(angle.size), angle, RATE)


def test_a_frame_longer_than_the_record_is_refused():
    with refused("shorter than a frame of 30 s", ValueError):
        frequency_map(np.zeros(TIME.size), ANGLE, RATE, frame=30.0)


def test_ten_times_the_reference_is_20_db():
    levels = decibels([0.0, 1e-6, 2e-6, 1e-5], 1e-6)
    assert_allclose(levels, [-np.inf, 0.0, 6.0206, 20.0], atol=1e-4)
