"""A toothed wheel: what speed it shows of a shaft whose speed fluctuates."""

import re
from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError, SimulationError
from gensig.sensing.encoder import Disc
from gensig.sensing.toothed_wheel import (
    ToothedWheel,
    draw_wheel,
    instantaneous_speed,
    passage_times,
)

PERFECT = ToothedWheel(
    node=14, n_teeth=160, eccentricity_error=0.0, tooth_error=0.0, clock_frequency=1e9
)
RATE, MEAN, SHARE, ORDER = 51_200.0, 1688 * np.pi / 30, 0.01, 2.0
TIME = np.arange(25_600) / RATE


def angle_of(order=ORDER, share=SHARE):
    """A shaft with a speed of MEAN (1 + share cos(order w t))."""
    w = order * MEAN
    return MEAN * (TIME + share * np.sin(w * TIME) / w)


def disc_of(wheel, seed=0):
    return draw_wheel(np.random.default_rng(seed), wheel)


def amplitude(signal, order):
    """Of one order of the shaft, over whole turns of it."""
    n_turns = int(TIME[-1] * MEAN / (tau)) - 1
    n = round(n_turns * tau / MEAN * RATE)
    window = np.hanning(n)
    wave = np.exp(-1j * order * MEAN * TIME[:n])
    part = window * (signal[:n] - signal[:n].mean()) @ wave
    return 2 * abs(part) / window.sum()


def test_a_steady_shaft_shows_its_speed():
    speed = instantaneous_speed(PERFECT, disc_of(PERFECT), MEAN * TIME, RATE)
    assert speed.shape == TIME.shape
    assert_allclose(speed, MEAN, rtol=1e-4)


def test_few_teeth_hold_low_orders_only():
    """A mean over one spacing: sinc of order over teeth."""
    for n_teeth, order in ((16, 2.0), (16, 5.0), (160, 5.0)):
        wheel = replace(PERFECT, n_teeth=n_teeth)
        speed = instantaneous_speed(wheel, disc_of(wheel), angle_of(order), RATE)
        # once by the mean over a spacing, once more by the straight lines between
        expected = SHARE * MEAN * np.sinc(order / n_teeth) ** 3
        assert_allclose(amplitude(speed, order), expected, rtol=0.02)
        assert_allclose(speed.mean(), MEAN, rtol=1e-3)


def test_a_slow_clock_makes_steps_of_one_tick():
    wheel = replace(PERFECT, clock_frequency=1e6)
    speed = instantaneous_speed(wheel, disc_of(wheel), MEAN * TIME, RATE)
    gap = wheel.spacing / MEAN
    assert_allclose(np.max(np.abs(speed / MEAN - 1.0)), 1e-6 / gap, rtol=0.7)
    times = passage_times(wheel, disc_of(wheel), MEAN * TIME, RATE)
    assert_allclose(times * 1e6, np.rint(times * 1e6), atol=1e-6)


def test_teeth_out_of_place_show_orders_that_the_shaft_has_not():
    error = np.radians(0.2)
    wheel = replace(PERFECT, eccentricity_error=error)
    shares = []
    for seed in range(12):
        speed = instantaneous_speed(wheel, disc_of(wheel, seed), MEAN * TIME, RATE)
        shares.append(amplitude(speed, 1.0) / MEAN)
        assert amplitude(speed, 7.0) < 0.02 * MEAN * max(shares[-1], 1e-3)
    # a place that errs by e sin(a) errs by e cos(a) of the speed
    assert 0.5 * error < max(shares) <= 1.01 * error


def test_passages_are_where_the_teeth_are():
    disc = Disc(index=0.3, places=np.radians([0.0, 91.0, 180.0, 270.0]))
    wheel = replace(PERFECT, n_teeth=4)
    times = passage_times(wheel, disc, np.linspace(0.0, 10.0, 1001), 100.0)
    expected = [
        0.3 + turn * tau + place for turn in (-1, 0, 1) for place in disc.places
    ]
    assert_allclose(times, [one for one in expected if 0.0 <= one <= 10.0], atol=2e-9)


def test_a_shaft_that_turns_back_or_too_few_teeth_are_refused():
    angle = np.sin(np.linspace(0.0, 6.0, 100))
    with pytest.raises(SimulationError, match="must turn forward throughout"):
        instantaneous_speed(PERFECT, disc_of(PERFECT), angle, RATE)
    with pytest.raises(SimulationError, match="too few or too fast"):
        instantaneous_speed(
            PERFECT, disc_of(PERFECT), np.linspace(0.0, 0.05, 100), RATE
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_teeth": 3}, "n_teeth = 3 must lie in 4..1000"),
        (
            {"eccentricity_error": 0.1},
            "eccentricity_error_deg = 5.72958 must lie in 0..5",
        ),
        ({"tooth_error": 0.01}, "tooth_error_deg = 0.572958 must lie in 0..0.225"),
        (
            {"clock_frequency": 100.0},
            "clock_frequency_hz = 100 must lie in 10000..1e+12",
        ),
    ],
)
def test_values_out_of_range(change, message):
    with pytest.raises(ConfigError, match=re.escape(f"toothed_wheel.{message}")):
        replace(PERFECT, **change)
