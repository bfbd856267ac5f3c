"""Gains that drift over a record, and samples that get lost."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from gensig.sensing.dropped import draw_dropped, filled
from gensig.sensing.gain_drift import draw_drift

N = 10_000


def logarithms(seeds, *, scatter=0.1, time=0.5, n_samples=501, rate=500.0):
    """(record and sensor, sample)"""
    drawn = [
        draw_drift(default_rng(seed), scatter, time, 2, n_samples, rate)
        for seed in seeds
    ]
    return np.log(np.concatenate(drawn))


def test_drift_is_stationary_and_forgets_itself():
    walk = logarithms(range(2000))  # 4000 of 1 s
    points = walk[:, ::25]  # every 50 ms is a point of the walk at 25 ms
    assert_allclose(
        points.std(axis=0),
        0.1,
        rtol=0.06,
    )
    assert_allclose(
        points.mean(axis=0),
        0.0,
        atol=0.006,
    )
    for lag in (0, 125, 250, 500):  # samples
        result = np.mean(walk[:, 0] * walk[:, lag]) / 0.1**2
        assert_allclose(
            result,
            np.exp(-lag / 500.0 / 0.5),
            atol=0.06,
        )


def test_drift_is_slow_and_each_sensors_own():
    walk = logarithms(range(300), time=10.0)
    assert np.abs(np.diff(walk, axis=1)).max() < 0.01 * 0.1 * 4
    assert abs(np.corrcoef(walk[::2, 0], walk[1::2, 0])[0, 1]) < 0.2


def test_a_longer_record_begins_as_a_shorter_one():
    short, long = (
        draw_drift(default_rng(1), 0.1, 0.3, 2, n, 1000.0) for n in (200, 900)
    )
    assert_allclose(long[:, :200], short)


@pytest.mark.parametrize("run", [1, 64])
def test_the_asked_share_is_lost_in_whole_packets(run):
    streams = map(default_rng, range(200))
    lost = np.array([draw_dropped(rng, 0.1, run, N) for rng in streams])
    assert lost.shape == (200, N)

    spread = np.sqrt(0.09 * run / lost.size)
    assert_allclose(lost.mean(), 0.1, atol=4.0 * spread)
    for record in lost:
        edges = np.flatnonzero(np.diff(record.astype(int)))
        assert len(edges) > 5
        assert np.all(np.diff(edges) % run == 0)


def test_the_first_packet_begins_anywhere():
    ends = set()
    for seed in range(300):
        lost = draw_dropped(default_rng(seed), 0.5, 8, 100)
        ends |= set((np.flatnonzero(np.diff(lost.astype(int))) % 8).tolist())
    assert ends == set(range(8))


@pytest.mark.parametrize(
    ("fill", "expected"),
    [("zero", [0, 2, 3, 0, 0, 6, 0, 8]), ("hold", [2, 2, 3, 3, 3, 6, 6, 8])],
)
def test_filling(fill, expected):
    signal = np.outer(
        [1.0, 10.0],
        np.arange(1, 9),
    )
    dropped = np.array(
        [1, 0, 0, 1, 1, 0, 1, 0],
        dtype=bool,
    )
    result = filled(signal, dropped, fill)

    assert_array_equal(
        result,
        np.outer([1, 10], expected),
    )
    assert not filled(signal, np.ones(8, dtype=bool), fill).any()
