"""The handbook's rule of thumb on signals whose state is known."""

import numpy as np
import pytest
from refusals import refused

from gensig.signals.handbook_rule import (
    MOST_KURTOSIS,
    MOST_LEVEL_DB,
    handbook_answer,
    handbook_rule,
)


def noise(seed=0):
    return np.random.default_rng(seed).standard_normal((2, 20_000))


@pytest.mark.parametrize(
    ("kurtosis", "level_db", "state"),
    [
        (3.0, 0.0, "healthy"),
        (MOST_KURTOSIS, MOST_LEVEL_DB, "healthy"),
        (6.1, 0.0, "one_tooth"),
        (6.1, 9.0, "one_tooth"),
        (3.0, 3.1, "many_teeth"),
        (3.0, -9.0, "healthy"),
    ],
)
def test_impulsive_is_one_tooth_and_loud_is_many(kurtosis, level_db, state):
    assert handbook_rule(kurtosis, level_db) == state


def test_sound_noise_is_healthy_and_its_mean_counts_nothing():
    answer = handbook_answer(noise() + 5.0, [1.0, 1.0])
    assert answer.state == "healthy"
    assert abs(answer.level_db) < 0.2
    assert abs(answer.kurtosis - 3.0) < 0.2


def test_the_loudest_channel_answers():
    signal = noise() * np.array([[1.0], [2.0]])
    answer = handbook_answer(signal, [1.0, 1.0])
    assert answer.state == "many_teeth"
    assert abs(answer.level_db - 20.0 * np.log10(2.0)) < 0.2


def test_rare_impulses_in_one_channel_are_one_tooth():
    signal = noise()
    signal[1, ::2000] += 20.0
    assert handbook_answer(signal, 1.0).state == "one_tooth"


def test_silent_healthy_level_is_refused():
    with refused("above 0", ValueError):
        handbook_answer(noise(), [1.0, 0.0])
