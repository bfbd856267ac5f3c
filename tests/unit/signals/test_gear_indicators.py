"""Indicators of an average turn against closed forms, and what must not change them."""

from math import tau

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.averaging import (
    average_turn,
    difference_signal,
    regular_signal,
    remove_orders,
    residual_signal,
)
from gensig.signals.averaging import time_synchronous_average as averaged
from gensig.signals.envelope import mesh_envelope
from gensig.signals.history import na4, nb4
from gensig.signals.indicators import energy_ratio, fm0, fm4, m6a, m8a, sideband_ratio

TEETH, PER_TURN = 23, 2300  # a hundred samples a tooth
TURN = np.arange(PER_TURN) / PER_TURN * tau


def wave(order):
    return np.cos(order * TURN)


MESH = 5 * np.cos(TEETH * TURN + 1) + 2 * wave(2 * TEETH)
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
    lines = {
        23: (5, 1),
        46: (2, 0),
        24: (1, 0),
        1: (1, 0),
    }
    lines |= {order: (0.3, order) for order in (7, 31, 40, 41, 55)}
    return sum(a * np.cos(order * turn + phase) for order, (a, phase) in lines.items())


@every
def test_gain_sign_and_start_tooth_change_nothing(name):
    indicator = OF_ONE_TURN[name]
    turn = gear()
    turn[900] += 3.0
    known = indicator(turn, TEETH)

    assert np.isfinite(known)
    assert_allclose(indicator(-1e-3 * turn, TEETH), known)
    for tooth in (1, 9, 22):
        later = np.roll(turn, tooth * PER_TURN // TEETH)
        assert_allclose(indicator(later, TEETH), known)


@every
def test_phase_between_samples_changes_nothing_but_sampled_peaks(name):
    before, after = (OF_ONE_TURN[name](gear(TURN + s), TEETH) for s in (0.0, 0.0007))
    assert_allclose(after, before, rtol=2e-3 if name == "fm0" else 1e-9)


@every
def test_leading_axes_are_kept_and_too_few_turns_are_nan(name):
    indicator = OF_ONE_TURN[name]
    noise = default_rng(0).standard_normal((2, 3, 20, PER_TURN))
    turns = gear() + noise
    values = indicator(average_turn(turns), TEETH)

    assert values.shape == (2, 3)

    alone = indicator(average_turn(turns[1, 2]), TEETH)
    assert_allclose(values[1, 2], alone)
    assert np.isnan(indicator(average_turn(turns[..., :19, :]), TEETH)).all()


def test_average_of_few_turns_is_nan_unless_asked_for():
    turns = default_rng(1).standard_normal((2, 19, 50))
    assert np.isnan(average_turn(turns)).all()
    assert_allclose(
        average_turn(turns, min_turns=1),
        turns.mean(axis=1),
    )

    signal = np.tile(
        np.cos(tau * np.arange(100) / 100),
        19,
    )
    assert_allclose(
        averaged(signal, 100.0, 1.0),
        signal[:100],
        atol=1e-12,
    )
    assert np.isnan(averaged(signal, 100.0, 1.0, min_turns=20)).all()


def test_a_turn_is_its_regular_part_what_is_left_and_the_shaft():
    shaft = 0.7 + wave(1)
    sideband = wave(TEETH + 1)
    other = 0.3 * wave(31)
    turn = MESH + shaft + sideband + other
    regular = regular_signal(turn, TEETH)

    assert_allclose(regular, MESH + sideband, atol=1e-9)
    assert_allclose(
        regular_signal(turn, TEETH, n_sidebands=0),
        MESH,
        atol=1e-9,
    )
    assert_allclose(
        residual_signal(turn, TEETH),
        sideband + other,
        atol=1e-9,
    )
    assert_allclose(difference_signal(turn, TEETH), other, atol=1e-9)
    assert_allclose(
        remove_orders(other, [31, 5000]),
        0.0,
        atol=1e-9,
    )


def test_a_mesh_tone_alone_leaves_nothing_to_judge():
    tone = 4 * wave(TEETH)
    assert energy_ratio(tone, TEETH) == 0.0
    assert_allclose(sideband_ratio(tone, TEETH), 0.0, atol=1e-12)
    for name in ("fm4", "m6a", "m8a", "na4", "nb4"):
        assert np.isnan(OF_ONE_TURN[name](tone, TEETH))


@pytest.mark.parametrize("n_harmonics", [1, 2])
def test_sidebands_count_on_either_side_alike(n_harmonics):
    lower = {-3: 0.2, -1: 0.5}
    upper = {2: 0.3, 6: 0.4}
    mesh = wave(TEETH) + wave(2 * TEETH)

    def ratio(sides):
        waves = [size * wave(TEETH + step) for step, size in sides.items()]
        return sideband_ratio(mesh + sum(waves), TEETH, n_harmonics=n_harmonics)

    assert_allclose(ratio(lower), 0.7 / n_harmonics)
    assert_allclose(ratio(upper), 0.7 / n_harmonics)
    assert_allclose(ratio(lower | upper), 1.4 / n_harmonics)
    # one beyond the sixth belongs to no harmonic
    assert_allclose(ratio({-7: 0.9, 7: 0.9}), 0.0, atol=1e-12)


def test_fm0_and_nb4_of_amplitude_modulation():
    depth = 0.4
    turn = (1 + depth * wave(1)) * wave(TEETH)
    # the lowest value lies half a tooth away
    assert_allclose(
        fm0(turn, TEETH),
        2 * (1 + depth),
        rtol=5e-3,
    )
    assert_allclose(OF_ONE_TURN["nb4"](turn, TEETH), 1.5)


def test_fm0_counts_the_chosen_harmonics():
    turn = wave(TEETH) + 0.5 * wave(2 * TEETH)
    span = np.ptp(turn)
    assert_allclose(fm0(turn, TEETH, n_harmonics=1), span)
    assert_allclose(fm0(turn, TEETH), span / 1.5)


def test_moments_of_one_order_and_of_gaussian_noise_outside_the_mesh():
    rng = default_rng(2)
    noisy = rng.standard_normal((400, PER_TURN)) + MESH
    one_order = MESH + 0.1 * wave(30)

    for moment, of_order, of_noise in (
        (fm4, 1.5, 3),
        (m6a, 2.5, 15),
        (m8a, 4.375, 105),
    ):
        assert_allclose(moment(one_order, TEETH), of_order, rtol=1e-6)
        assert_allclose(
            moment(noisy, TEETH).mean(),
            of_noise,
            rtol=0.05,
        )


def test_energy_ratio_of_known_amplitudes():
    other = wave(30)
    mesh = 5 * wave(TEETH) + 3 * wave(TEETH - 1)
    turn = mesh + 2 * other + 9 * wave(1)

    assert_allclose(
        energy_ratio(turn, TEETH),
        2 / np.hypot(5, 3),
    )
    assert np.isnan(energy_ratio(other, TEETH))


def test_envelope_is_of_its_band_only():
    other = 7 * wave(2 * TEETH) + wave(1) + 3.0
    modulation = 1 + 0.2 * wave(5)
    turn = modulation * wave(TEETH) + other

    assert_allclose(mesh_envelope(turn, TEETH), modulation, atol=1e-9)
    assert_allclose(
        mesh_envelope(turn, TEETH, n_sidebands=4),
        1.0,
        atol=1e-9,
    )
    assert_allclose(
        mesh_envelope(turn, TEETH, harmonic=2),
        7.0,
        atol=1e-9,
    )


@pytest.mark.parametrize(
    ("indicator", "samples", "options", "message"),
    [
        (fm0, 46, {}, "46 samples a turn cannot hold mesh order 23"),
        (sideband_ratio, 32, {}, "mesh order 23"),
        (mesh_envelope, 60, {}, "cannot hold the band of mesh orders 12 to 34"),
        (mesh_envelope, 2300, {"n_sidebands": 23}, "mesh orders 0 to 46"),
    ],
)
def test_too_few_samples_are_refused(indicator, samples, options, message):
    with refused(message, ValueError):
        indicator(np.ones(samples), TEETH, **options)
