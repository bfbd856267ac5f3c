"""Pulses at the marks of a shaft: their places, their width, their jitter."""

import math
from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from gensig.sensing.tachometer import Tachometer, draw_mark, pulse_train
from gensig.signals.tacho import pulse_times

RATE = 51_200.0
PLAIN = Tachometer(
    shaft="pinion", pulses_per_turn=1, pulse_width_share=0.05, jitter=0.0
)
MARK = 1.234
SPEED = math.tau * 30.0


def steady(hertz=30.0, duration=0.3):
    return tau * hertz * np.arange(round(duration * RATE)) / RATE


def train(tacho=PLAIN, angle=None, mark=MARK, seed=0):
    angle = steady() if angle is None else angle
    return pulse_train(tacho, mark, angle, RATE, default_rng(seed))


@pytest.mark.parametrize(
    "n_pulses",
    [1, 2, 60],
)
def test_pulses_begin_at_the_marks(n_pulses):
    tacho = replace(PLAIN, pulses_per_turn=n_pulses, pulse_width_share=0.3)
    marks = np.arange(
        MARK % tacho.spacing,
        steady()[-1],
        tacho.spacing,
    )
    assert len(marks) >= 9 * n_pulses - 1

    times = pulse_times(train(tacho), RATE)
    assert_allclose(
        times,
        marks / SPEED,
        rtol=0,
        atol=1e-6 / RATE,
    )


@pytest.mark.parametrize(
    "share",
    [0.05, 0.5, 0.95],
)
def test_high_for_its_share_of_the_turn(share):
    pulses = train(
        replace(PLAIN, pulse_width_share=share),
        steady(duration=10 / 30.0),
    )
    assert_allclose(pulses.mean(), share, atol=1e-4)
    assert pulses.min() >= 0.0
    assert pulses.max() <= 1.0 + 1e-9

    is_edge = (pulses > 1e-9) & (pulses < 1.0 - 1e-9)
    assert is_edge.sum() <= 22  # two of each of eleven pulses


def test_a_record_may_begin_and_end_in_a_pulse():
    angle = steady()
    pulses = train(mark=-0.1)
    assert_allclose(pulses[0], 1.0)
    assert_allclose(
        train(mark=float(angle[-1]) - 0.1)[-1],
        1.0,
    )

    wide = replace(PLAIN, pulse_width_share=0.999)
    assert_allclose(
        train(wide, angle[:100], mark=-3.0).min(),
        1.0,
    )
    assert not train(PLAIN, angle[:100], mark=3.0).any()


def test_jitter_is_as_wide_as_asked_and_new_in_every_pulse():
    jitter = np.radians(0.2)
    tacho = replace(PLAIN, pulses_per_turn=20, pulse_width_share=0.5, jitter=jitter)
    places = pulse_times(train(tacho, steady(duration=2.0)), RATE) * SPEED
    half = 0.5 * tacho.spacing
    off = (places - MARK + half) % tacho.spacing - half

    assert_allclose(len(off), 1200, atol=1)
    assert_allclose(off.std(), jitter, rtol=0.07)
    assert abs(off.mean()) < 0.1 * jitter
    assert abs(np.corrcoef(off[1:], off[:-1])[0, 1]) < 0.1


def test_the_mark_is_anywhere():
    marks = np.array([draw_mark(default_rng(seed)) for seed in range(400)])
    assert marks.min() >= 0.0
    assert marks.max() < tau
    assert_allclose(
        np.histogram(marks, 4, (0.0, tau))[0],
        100,
        atol=30,
    )
