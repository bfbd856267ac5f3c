"""Mesh harmonics, what does not repeat, and the residual of all turns."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.averaging import residual_signal
from gensig.signals.synchronous import (
    mesh_harmonics,
    nonsynchronous_share,
    residual_turns,
)

TURN = np.arange(400) / 400 * 2 * np.pi
MESH = 3 * np.cos(23 * TURN + 1) + 0.5 * np.cos(46 * TURN)
TURNS = np.tile(
    MESH + 0.2 * np.cos(24 * TURN),
    (30, 1),
)
NOISE = np.random.default_rng(0).standard_normal(TURNS.shape)


def test_amplitudes_by_order():
    assert_allclose(
        mesh_harmonics(TURNS[0], 23, 3),
        [3.0, 0.5, 0.0],
        atol=1e-12,
    )
    assert mesh_harmonics(TURNS.reshape(5, 6, 400), 23, 2).shape == (5, 6, 2)


def test_harmonics_beyond_the_band_are_unknown():
    assert np.isnan(mesh_harmonics(TURNS[0], 23, 9)).tolist() == [False] * 8 + [True]


@pytest.mark.parametrize(
    "n_turns",
    [2, 5, 30],
)
def test_share_is_right_on_the_average_for_any_number_of_turns(n_turns):
    rng = np.random.default_rng(n_turns)
    power = 4.5 + 0.125 + 0.02
    deviation = np.sqrt(power / 3)  # a quarter of the whole
    noise = deviation * rng.standard_normal((200, n_turns, 400))
    result = [nonsynchronous_share(TURNS[:n_turns] + each) for each in noise]

    assert_allclose(np.mean(result), 0.25, atol=0.01)


def test_share_of_every_channel_is_that_of_it_alone():
    turns = TURNS + np.array([0.5, 1.0, 2.0])[:, None, None] * NOISE
    result = nonsynchronous_share(turns)
    assert_allclose(result, [nonsynchronous_share(each) for each in turns])
    assert (np.diff(result) > 0.1).all()


def test_share_of_pure_turns_noise_silence_and_one_turn():
    assert_allclose(nonsynchronous_share(TURNS + 7.0), 0.0, atol=1e-12)
    assert_allclose(nonsynchronous_share(NOISE), 1.0, atol=0.03)
    assert np.isnan(nonsynchronous_share(np.ones((3, 8))))
    with refused("one turn", ValueError):
        nonsynchronous_share(TURNS[:1])


def test_residual_of_turns_is_that_of_the_average_and_what_does_not_repeat():
    turns = TURNS + NOISE
    residual = residual_turns(turns, 23)
    expected = residual_signal(turns.mean(axis=0), 23)

    assert_allclose(
        residual.mean(axis=0),
        expected,
        atol=1e-12,
    )
    assert_allclose(
        residual_turns(TURNS, 23)[3],
        0.2 * np.cos(24 * TURN),
        atol=1e-12,
    )
    assert np.var(residual) > 0.9
