"""A toothed wheel: what speed it shows of a shaft whose speed fluctuates."""

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import given, refused

from gensig.errors import SimulationError
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


def speed_of(wheel, angle=MEAN * TIME, seed=0):
    return instantaneous_speed(wheel, disc_of(wheel, seed), angle, RATE)


def amplitude(signal, order):
    """Of one order of the shaft, over whole turns of it."""
    n_turns = int(TIME[-1] * MEAN / (tau)) - 1
    n = round(n_turns * tau / MEAN * RATE)
    window = np.hanning(n)
    wave = np.exp(-1j * order * MEAN * TIME[:n])
    part = window * (signal[:n] - signal[:n].mean()) @ wave
    return 2 * abs(part) / window.sum()


def test_a_steady_shaft_shows_its_speed():
    speed = speed_of(PERFECT)
    assert speed.shape == TIME.shape
    assert_allclose(speed, MEAN, rtol=1e-4)


@pytest.mark.parametrize(
    ("n_teeth", "order"),
    [(16, 2.0), (16, 5.0), (160, 5.0)],
)
def test_few_teeth_hold_low_orders_only(n_teeth, order):
    """A mean over one spacing: sinc of order over teeth."""
    wheel = replace(PERFECT, n_teeth=n_teeth)
    speed = speed_of(wheel, angle_of(order))
    # once by the mean over a spacing, once more by the straight lines between
    expected = SHARE * MEAN * np.sinc(order / n_teeth) ** 3

    assert_allclose(amplitude(speed, order), expected, rtol=0.02)
    assert_allclose(speed.mean(), MEAN, rtol=1e-3)


def test_a_slow_clock_makes_steps_of_one_tick():
    wheel = replace(PERFECT, clock_frequency=1e6)
    tick = 1e-6 * MEAN / wheel.spacing
    error = np.abs(speed_of(wheel) / MEAN - 1.0).max()

    assert 0.3 * tick < error < 1.7 * tick

    times = passage_times(
        wheel,
        disc_of(wheel),
        MEAN * TIME,
        RATE,
    )
    assert_allclose(
        times * 1e6,
        np.rint(times * 1e6),
        atol=1e-6,
    )


def test_teeth_out_of_place_show_orders_that_the_shaft_has_not():
    error = np.radians(0.2)
    wheel = replace(PERFECT, eccentricity_error=error)
    speeds = [speed_of(wheel, seed=seed) / MEAN for seed in range(12)]
    first, seventh = (
        np.array([amplitude(speed, order) for speed in speeds]) for order in (1.0, 7.0)
    )

    assert np.all(seventh < 0.02 * np.maximum(first, 1e-3))
    # a place that errs by e sin(a) errs by e cos(a) of the speed
    assert 0.5 * error < first.max() <= 1.01 * error


def test_passages_are_where_the_teeth_are():
    disc = Disc(
        index=0.3,
        line_angles=np.radians([0.0, 91.0, 180.0, 270.0]),
    )
    wheel = replace(PERFECT, n_teeth=4)
    times = passage_times(
        wheel,
        disc,
        np.linspace(0.0, 10.0, 1001),
        100.0,
    )
    turns = tau * np.arange(-1, 2)[:, None]
    expected = (0.3 + turns + disc.line_angles).ravel()
    inside = (expected >= 0.0) & (expected <= 10.0)

    assert_allclose(times, expected[inside], atol=2e-9)


@pytest.mark.parametrize(
    ("angle", "message"),
    [
        (np.sin(np.linspace(0.0, 6.0, 100)), "must turn forward throughout"),
        (np.linspace(0.0, 0.05, 100), "too few or too fast"),
    ],
)
def test_a_shaft_that_turns_back_or_too_few_teeth_are_refused(angle, message):
    with refused(message, SimulationError):
        speed_of(PERFECT, angle)


@pytest.mark.parametrize(
    ("change", "message"),
    {
        "n_teeth=3": "n_teeth = 3 must lie in 4..1000",
        "eccentricity_error=0.1": "eccentricity_error_deg = 5.72958 must lie in 0..5",
        "tooth_error=0.01": "tooth_error_deg = 0.572958 must lie in 0..0.225",
        "clock_frequency=100.0": "clock_frequency_hz = 100 must lie in 10000..1e+12",
    }.items(),
)
def test_values_out_of_range(change, message):
    with refused(f"toothed_wheel.{message}"):
        replace(PERFECT, **given(change))
