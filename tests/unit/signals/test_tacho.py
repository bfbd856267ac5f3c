"""From pulses to speed, and to the angle domain at a speed that changes."""

from math import tau

import numpy as np
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.averaging import resample_to_angle
from gensig.signals.tacho import pulse_times, resample_by_pulses, speed_of_pulses

RATE = 20_000.0


def ramp(n_samples=20_000, start=18.0, slope=12.0):
    """Time, shaft angle in turns, and the instants of whole turns of a shaft that speeds up
    steadily."""
    time = np.arange(n_samples) / RATE
    turns = start * time + 0.5 * slope * time**2
    whole = np.arange(
        1,
        int(turns[-1]) + 1,
    )
    return time, turns, (-start + np.sqrt(start**2 + 2.0 * slope * whole)) / slope


def test_a_train_of_zeros_and_ones_is_right_within_half_a_sample():
    _, turns, instants = ramp()
    result = pulse_times(
        (turns % 1.0 < 0.1) * 5.0 - 2.0,
        RATE,
    )
    assert len(result) == len(instants)
    assert np.abs(result - instants).max() <= 0.5 / RATE * (1 + 1e-9)


def test_speed_between_pulses():
    _, _, instants = ramp()
    time, speed = speed_of_pulses(instants)
    assert_allclose(
        speed, 18.0 + 12.0 * time
    )  # under steady acceleration the mean is that midway

    _, twice = speed_of_pulses(instants, 2)
    assert_allclose(twice, speed / 2.0)


def test_orders_stay_sharp_where_the_speed_changes():
    """A tone of order 7: in the angle domain one line, at the mean speed's constant rate a
    smear."""
    time, turns, instants = ramp()
    signal = np.cos(tau * 7.0 * turns)

    def spectrum(resampled):
        return 2.0 * np.abs(np.fft.rfft(resampled.ravel())) / resampled.size

    tracked = resample_by_pulses(signal, RATE, instants)

    assert tracked.shape[0] == len(instants) - 1

    lines, order = spectrum(tracked), 7 * tracked.shape[0]
    assert_allclose(lines[order], 1.0, rtol=1e-3)
    assert np.delete(lines, order).max() < 1e-3

    plain = resample_to_angle(
        signal,
        RATE,
        turns[-1] / time[-1],
    )
    assert spectrum(plain)[7 * plain.shape[0]] < 0.5


def test_several_pulses_a_turn_and_several_channels():
    _, turns, _ = ramp()
    quarters = np.arange(1, int(4 * turns[-1])) / 4.0
    marks = np.interp(
        quarters,
        turns,
        np.arange(len(turns)) / RATE,
    )

    def waves(turns):
        angle = tau * 3.0 * turns
        return np.stack([np.cos(angle), np.sin(angle)])

    options = {"pulses_per_turn": 4, "samples_per_turn": 64}
    result = resample_by_pulses(waves(turns), RATE, marks, **options)

    assert result.shape == (2, (len(marks) - 1) // 4, 64)

    # the first pulse is a quarter turn after the start
    expected = waves(0.25 + np.arange(64) / 64.0)[:, None]
    assert np.abs(result - expected).max() < 2e-3


def test_too_few_pulses():
    assert pulse_times(np.zeros(100), RATE).shape == (0,)
    with refused("3 pulses at 4 a turn span no whole turn", ValueError):
        resample_by_pulses(
            np.zeros(100),
            RATE,
            [0.0, 0.001, 0.002],
            pulses_per_turn=4,
        )
