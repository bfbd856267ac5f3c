"""Indicators of an average turn against closed forms, and what must not change them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.signals.averaging import (
    average_turn,
    difference_signal,
    regular_signal,
    residual_signal,
)
from gensig.signals.averaging import time_synchronous_average as averaged
from gensig.signals.envelope import mesh_envelope
from gensig.signals.history import na4, nb4
from gensig.signals.indicators import energy_ratio, fm0, fm4, m6a, m8a, sideband_ratio

TEETH, PER_TURN = 23, 2300  # a hundred samples a tooth
TURN = np.arange(PER_TURN) / PER_TURN * 2 * np.pi
OF_ONE_TURN = {
    "fm0": fm0,
    "fm4": fm4,
    "m6a": m6a,
    "m8a": m8a,
    "energy_ratio": energy_ratio,
    "sideband_ratio": sideband_ratio,
    "na4": lambda turn, n_teeth: na4(turn[..., None, :], n_teeth)[..., 0],
    "nb4": lambda turn, n_teeth: nb4(turn[..., None, :], n_teeth)[..., 0],
}
every = pytest.mark.parametrize("name", OF_ONE_TURN)


def gear(turn=TURN):
    """A mesh with sidebands, unbalance, and orders that do not belong to it; all below a sixteenth
    of the samples."""
    mesh = (
        5 * np.cos(TEETH * turn + 1)
        + 2 * np.cos(2 * TEETH * turn)
        + np.cos((TEETH + 1) * turn)
        + np.cos(turn)
    )
    return mesh + sum(
        0.3 * np.cos(order * turn + order) for order in (7, 31, 40, 41, 55)
    )


def impact(size, place=900):
    turn = np.zeros(PER_TURN)
    turn[place] = size
    return turn


@every
def test_gain_sign_and_start_tooth_change_nothing(name):
    indicator = OF_ONE_TURN[name]
    turn = gear() + impact(3.0)
    known = indicator(turn, TEETH)
    assert np.isfinite(known)
    assert_allclose(indicator(-1e-3 * turn, TEETH), known, rtol=1e-9)
    for tooth in (1, 9, 22):
        assert_allclose(
            indicator(np.roll(turn, tooth * PER_TURN // TEETH), TEETH), known, rtol=1e-9
        )


@every
def test_phase_between_samples_changes_nothing_but_the_peaks_that_are_sampled(name):
    moved = OF_ONE_TURN[name](gear(TURN + 0.0007), TEETH)
    assert_allclose(
        moved, OF_ONE_TURN[name](gear(), TEETH), rtol=2e-3 if name == "fm0" else 1e-9
    )


@every
def test_leading_axes_are_kept_and_too_few_turns_are_nan(name):
    rng = np.random.default_rng(0)
    turns = gear() + rng.standard_normal((2, 3, 20, PER_TURN))
    found = OF_ONE_TURN[name](average_turn(turns), TEETH)
    assert found.shape == (2, 3)
    assert_allclose(
        found[1, 2], OF_ONE_TURN[name](average_turn(turns[1, 2]), TEETH), rtol=1e-12
    )
    assert np.isnan(OF_ONE_TURN[name](average_turn(turns[..., :19, :]), TEETH)).all()


def test_average_of_few_turns_is_nan_unless_asked_for():
    turns = np.random.default_rng(1).standard_normal((2, 19, 50))
    assert np.isnan(average_turn(turns)).all()
    assert_allclose(average_turn(turns, min_turns=1), turns.mean(axis=1), rtol=1e-12)
    signal = np.tile(np.cos(2 * np.pi * np.arange(100) / 100), 19)
    assert_allclose(averaged(signal, 100.0, 1.0), signal[:100], atol=1e-12)
    assert np.isnan(averaged(signal, 100.0, 1.0, min_turns=20)).all()


def test_a_turn_is_its_regular_part_what_is_left_and_the_shaft():
    turn = gear() + 0.7
    shaft = 0.7 + np.cos(TURN)
    assert_allclose(
        regular_signal(turn, TEETH) + difference_signal(turn, TEETH) + shaft,
        turn,
        atol=1e-9,
    )
    assert_allclose(
        regular_signal(turn, TEETH, n_sidebands=0)
        + residual_signal(turn, TEETH)
        + shaft,
        turn,
        atol=1e-9,
    )
    alone = 5 * np.cos(TEETH * TURN + 1) + 2 * np.cos(2 * TEETH * TURN)
    assert_allclose(regular_signal(turn, TEETH, n_sidebands=0), alone, atol=1e-9)


class TestMeshTone:
    tone = 4 * np.cos(TEETH * TURN)

    def test_values(self):
        assert_allclose(fm0(self.tone, TEETH, n_harmonics=1), 2.0, rtol=1e-9)
        assert_allclose(fm0(self.tone, TEETH), 2.0, rtol=1e-9)
        assert energy_ratio(self.tone, TEETH) == 0.0
        assert_allclose(sideband_ratio(self.tone, TEETH), 0.0, atol=1e-12)

    @pytest.mark.parametrize("name", ["fm4", "m6a", "m8a", "na4", "nb4"])
    def test_nothing_is_left_to_judge(self, name):
        assert np.isnan(OF_ONE_TURN[name](self.tone, TEETH))


def test_fm0_and_nb4_of_amplitude_modulation():
    depth = 0.4
    turn = (1 + depth * np.cos(TURN)) * np.cos(TEETH * TURN)
    assert_allclose(mesh_envelope(turn, TEETH), 1 + depth * np.cos(TURN), atol=1e-12)
    assert_allclose(
        fm0(turn, TEETH), 2 * (1 + depth), rtol=5e-3
    )  # the lowest value lies half a tooth away
    assert_allclose(OF_ONE_TURN["nb4"](turn, TEETH), 1.5, rtol=1e-9)


def test_fm0_counts_the_harmonics_it_is_told():
    turn = np.cos(TEETH * TURN) + 0.5 * np.cos(2 * TEETH * TURN)
    span = np.ptp(turn)
    assert_allclose(fm0(turn, TEETH, n_harmonics=1), span, rtol=1e-9)
    assert_allclose(fm0(turn, TEETH), span / 1.5, rtol=1e-9)


def test_moments_of_one_order_outside_the_mesh():
    turn = 10 * np.cos(TEETH * TURN) + 0.1 * np.cos(30 * TURN)
    assert_allclose(
        [fm4(turn, TEETH), m6a(turn, TEETH), m8a(turn, TEETH)],
        [1.5, 2.5, 4.375],
        rtol=1e-6,
    )


def test_moments_of_gaussian_noise():
    rng = np.random.default_rng(2)
    turn = rng.standard_normal((400, PER_TURN)) + 10 * np.cos(TEETH * TURN)
    n_samples = turn.size
    for indicator, half, expected in ((fm4, 2, 3), (m6a, 3, 15), (m8a, 4, 105)):
        raw = (
            np.prod(np.arange(1, 4 * half, 2)) - expected**2
        )  # variance of the moment itself
        assert_allclose(
            indicator(turn, TEETH).mean(),
            expected,
            atol=5 * np.sqrt(raw / n_samples) + 0.01 * expected,
        )


def test_moments_of_one_impact():
    """With n samples a single one has a moment of n to the power of half its order less one, but
    for its mean."""
    p = 1.0 / PER_TURN
    for indicator, half in ((fm4, 2), (m6a, 3), (m8a, 4)):
        exact = ((1 - p) ** (2 * half) * p + p ** (2 * half) * (1 - p)) / (
            p * (1 - p)
        ) ** half
        assert_allclose(
            indicator(impact(3.0), 2 * PER_TURN), exact, rtol=0.01
        )  # no mesh in the band, orders 0 to 2 lost
        assert_allclose(exact, PER_TURN ** (half - 1), rtol=0.01)


def test_energy_ratio_of_known_amplitudes():
    turn = (
        5 * np.cos(TEETH * TURN)
        + 3 * np.cos((TEETH - 1) * TURN)
        + 2 * np.cos(30 * TURN)
        + 9 * np.cos(TURN)
    )
    assert_allclose(energy_ratio(turn, TEETH), 2 / np.hypot(5, 3), rtol=1e-9)
    assert np.isnan(energy_ratio(np.cos(30 * TURN), TEETH))


def test_envelope_is_of_its_band_only():
    other = 7 * np.cos(2 * TEETH * TURN) + np.cos(TURN) + 3.0
    turn = (1 + 0.2 * np.cos(5 * TURN)) * np.cos(TEETH * TURN) + other
    assert_allclose(mesh_envelope(turn, TEETH), 1 + 0.2 * np.cos(5 * TURN), atol=1e-9)
    assert_allclose(mesh_envelope(turn, TEETH, n_sidebands=4), 1.0, atol=1e-9)
    assert_allclose(mesh_envelope(turn, TEETH, harmonic=2), 7.0, atol=1e-9)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: fm0(np.ones(46), TEETH),
            "46 samples a turn cannot hold mesh order 23",
        ),
        (
            lambda: mesh_envelope(np.ones(60), TEETH),
            "cannot hold the band of mesh orders 12 to 34",
        ),
        (lambda: mesh_envelope(TURN, TEETH, n_sidebands=23), "mesh orders 0 to 46"),
    ],
)
def test_too_few_samples_are_refused(call, said):
    with pytest.raises(ValueError, match=said):
        call()
