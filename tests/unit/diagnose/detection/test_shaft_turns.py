"""Turns of the shafts hold their own part of a signal and no other's."""

import numpy as np
import pytest

from diagnose.detection.shaft_turns import separate_shafts

PER_TURN, ORDERS, KEPT = 200, (1.0, 0.4, 0.3), (40, 100, 130)


def parts(n_turns=40, start=0):
    """(shaft, sample) periodic parts, of orders that no two shafts share."""
    turned = (start + np.arange(n_turns * PER_TURN)) / PER_TURN
    orders = ((1, 7), (3, 11), (1, 13))
    return np.stack(
        [
            sum(np.cos(2.0 * np.pi * own * order * turned) for own in multiples)
            for order, multiples in zip(ORDERS, orders, strict=True)
        ]
    )


def test_every_shaft_gets_its_part_and_nothing_is_left():
    signal = parts()
    result = separate_shafts(
        signal.sum(axis=0)[None], PER_TURN, ORDERS, start=0, n_orders=KEPT
    )
    for shaft, (own, others) in enumerate([((1, 7), 3), ((3, 11), 1), ((1, 13), 2)]):
        amplitude = (
            2.0 * np.abs(np.fft.rfft(result.turns[shaft][0])) / (2 * KEPT[shaft])
        )
        np.testing.assert_allclose(amplitude[list(own)], 1.0, rtol=0.03)
        assert amplitude[others] < 0.1
    assert np.std(result.rest) < 0.05 * np.std(signal.sum(axis=0))


@pytest.mark.parametrize("start", [137, 5 * PER_TURN])
def test_turns_begin_where_the_recording_does(start):
    whole = separate_shafts(
        parts().sum(axis=0)[None], PER_TURN, ORDERS, start=0, n_orders=KEPT
    )
    block = separate_shafts(
        parts(start=start).sum(axis=0)[None],
        PER_TURN,
        ORDERS,
        start=start,
        n_orders=KEPT,
    )
    for turn, own in zip(whole.turns, block.turns, strict=True):
        np.testing.assert_allclose(own, turn, atol=0.1 * np.abs(turn).max())


def test_noise_stays_in_the_rest():
    noise = np.random.default_rng(1).standard_normal((1, 40 * PER_TURN))
    result = separate_shafts(noise, PER_TURN, ORDERS, start=0, n_orders=KEPT)
    assert np.std(result.rest) > 0.85 * np.std(noise)
