"""An encoder: steps of one line, an error once a turn, a pattern of its own."""

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.sensing.encoder import Disc, Encoder, draw_disc

PERFECT = Encoder(
    shaft="pinion",
    lines_per_turn=1000,
    eccentricity_error=0.0,
    line_error=0.0,
    quantised=True,
)
ANGLE = np.linspace(-1.0, 40.0, 200_001)


def disc_of(encoder, seed=0):
    return draw_disc(np.random.default_rng(seed), encoder)


def error(encoder, seed=0, angle=ANGLE):
    """Excess of the reading, counted from the index."""
    disc = disc_of(encoder, seed)
    return disc.read(angle, quantised=encoder.quantised) - (angle - disc.index)


def test_a_perfect_one_is_behind_by_at_most_a_line():
    disc = disc_of(PERFECT)
    read = disc.read(ANGLE, quantised=True)
    off = error(PERFECT)

    assert off.max() <= 1e-9
    assert off.min() > -PERFECT.spacing * (1.0 + 1e-9)
    assert_allclose(
        read / PERFECT.spacing,
        np.rint(read / PERFECT.spacing),
        atol=1e-8,
    )
    assert np.all(np.diff(read) >= -1e-12)
    assert_allclose(
        off.std(),
        PERFECT.spacing / np.sqrt(12.0),
        rtol=0.02,
    )


def test_without_quantisation_a_perfect_one_is_exact():
    assert_allclose(
        error(replace(PERFECT, quantised=False)),
        0.0,
        atol=1e-9,
    )


@pytest.mark.parametrize("quantised", [True, False])
def test_errors_are_bounded_by_line_and_errors(quantised):
    eccentricity, line = np.radians([1.0, 0.03])
    errors = {"eccentricity_error": eccentricity, "line_error": line}
    encoder = replace(PERFECT, quantised=quantised, **errors)
    most = (eccentricity + 4.0 * line) * (1 + 1e-9)
    off = np.array([error(encoder, seed) for seed in range(20)])

    assert off.max() <= most
    assert off.min() >= -most - quantised * encoder.spacing
    assert np.all(np.diff(off + ANGLE) >= -1e-12)  # never backwards


def test_eccentricity_errs_once_a_turn():
    encoder = replace(
        PERFECT,
        eccentricity_error=np.radians(1.0),
        quantised=False,
    )
    turn = np.linspace(
        0.0,
        6.0 * np.pi,
        6000,
        endpoint=False,
    )  # three turns
    largest = []

    for seed in range(60):
        spectrum = 2.0 * np.abs(np.fft.rfft(error(encoder, seed, turn))) / len(turn)
        # (e/R)^2: reading and place are not the same
        assert np.delete(spectrum, 3).max() < 0.02 * spectrum[3]
        largest.append(spectrum[3] / np.radians(1.0))
    assert 0.9 < np.max(largest) <= 1.001
    assert np.min(largest) < 0.1


def test_the_pattern_repeats_every_turn_and_is_each_discs_own():
    encoder = replace(
        PERFECT,
        line_error=np.radians(0.02),
        quantised=False,
    )
    turn = np.linspace(0.0, tau, 5000, endpoint=False)
    first, later = error(encoder, 3, turn), error(encoder, 3, turn + 6.0 * np.pi)

    assert_allclose(first, later, atol=1e-9)
    assert abs(np.corrcoef(first, error(encoder, 4, turn))[0, 1]) < 0.1

    off = disc_of(encoder).line_angles - encoder.spacing * np.arange(1000)
    assert_allclose(
        np.std(off),
        np.radians(0.02),
        rtol=0.1,
    )


def test_lines_pass_in_order_at_the_largest_errors():
    encoder = replace(
        PERFECT, eccentricity_error=np.radians(5.0), line_error=0.1 * PERFECT.spacing
    )
    for seed in range(50):
        line_angles = disc_of(encoder, seed).line_angles
        assert np.all(np.diff([*line_angles, line_angles[0] + tau]) > 0.0)


def test_a_line_is_read_where_it_passes():
    disc = Disc(
        index=0.5,
        line_angles=np.array([0.1, np.pi / 2, np.pi, 3 * np.pi / 2]),
    )
    turned = [
        0.0,
        0.05,
        0.11,
        np.pi - 0.01,
        np.pi + 0.01,
        tau + 0.05,
        tau + 0.11,
    ]
    read = disc.read(
        0.5 + np.array(turned),
        quantised=True,
    )
    assert_allclose(
        read / (np.pi / 2),
        [-1, -1, 0, 1, 2, 3, 4],
        atol=1e-12,
    )


def test_a_line_counts_from_where_it_passes_on():
    lines = np.array([0.0, 1.5, 3.0, 4.5])
    read = Disc(index=0.0, line_angles=lines).read(lines, quantised=True)
    assert_allclose(read / (np.pi / 2), [0, 1, 2, 3], atol=1e-12)
    before = Disc(index=0.0, line_angles=lines).read(lines - 1e-9, quantised=True)
    assert_allclose(before / (np.pi / 2), [-1, 0, 1, 2], atol=1e-12)
