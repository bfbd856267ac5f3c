"""The angle domain by a known angle, and an angle found in the mesh alone."""

from math import tau

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose
from refusals import refused

from gensig.signals.averaging import resample_to_angle
from gensig.signals.rotation import (
    find_mesh_frequency,
    mesh_phase_angle,
    resample_by_angle,
)
from gensig.signals.spectrum import spectrum_of_turns

RATE, TEETH = 10_000.0, 23
TIME = np.arange(40_000) / RATE
# 20 Hz, 0.8 % up and down
TURNS = 20.0 * TIME + 0.16 / (tau * 0.4) * np.sin(tau * 0.4 * TIME)


def mesh(turns, *harmonics):
    return sum(
        a * np.cos(tau * (k + 1) * TEETH * turns + k) for k, a in enumerate(harmonics)
    )


def test_a_steady_angle_gives_what_a_steady_speed_gives():
    x = default_rng(0).standard_normal((2, TIME.size)).cumsum(axis=-1)
    by_angle = resample_by_angle(x, tau * 17.3 * TIME, 578)
    by_speed = resample_to_angle(x, RATE, 17.3, 578)

    assert by_angle.shape == by_speed.shape
    assert_allclose(
        by_angle,
        by_speed,
        atol=1e-9 * np.abs(x).max(),
    )


def test_a_turn_gets_the_samples_of_the_slowest_by_itself_and_orders_stay_sharp():
    turns = resample_by_angle(
        mesh(TURNS, 1.0, 0.5),
        tau * TURNS,
    )
    assert turns.shape[-1] == 506  # even, at 19.84 Hz 504.03

    order, amplitude = spectrum_of_turns(turns)
    is_mesh = np.isin(order, [TEETH, 2 * TEETH])
    assert_allclose(
        amplitude[is_mesh],
        [1.0, 0.5],
        rtol=2e-3,
    )
    assert amplitude[~is_mesh].max() < 2e-3


@pytest.mark.parametrize(
    ("angle", "message"),
    [
        (np.zeros(100), "must rise"),
        (-np.arange(100.0), "must rise"),
        (np.arange(99.0), "must rise"),
        (np.full(100, np.nan), "must rise"),
        (np.linspace(0, np.pi, 100), "0.5 turns"),
    ],
)
def test_angles_that_do_not_rise_by_a_turn_are_refused(angle, message):
    with refused(message, ValueError):
        resample_by_angle(np.ones(100), angle, 10)


@pytest.fixture
def rotation():
    """Frequency of the shaft in Hz by the mesh of a signal, searched around 20 Hz."""

    def search(x, **options):
        return find_mesh_frequency(x, RATE, TEETH, 20.0, **options) / TEETH

    return search


@pytest.mark.parametrize(
    "true",
    [19.71, 20.0, 20.33],
)
def test_mesh_frequency_is_found_through_noise_and_sidebands(rotation, true):
    turns = true * TIME
    modulated = (1 + 0.8 * np.cos(tau * turns)) * mesh(turns, 1.0, 0.3, 0.5)
    x = modulated + default_rng(1).standard_normal(TIME.size)
    assert_allclose(rotation(x), true, rtol=2e-5)


def test_a_foreign_tone_near_one_harmonic_is_not_taken_for_the_mesh(rotation):
    x = mesh(20.1 * TIME, 0.2, 0.1, 0.2, 0.1) + mesh(19.8 * TIME, 2.0)
    x += 0.5 * default_rng(4).standard_normal(TIME.size)
    assert_allclose(rotation(x), 20.1, rtol=1e-4)
    assert_allclose(
        rotation(x, n_harmonics=1),
        19.8,
        rtol=1e-4,
    )


def test_channels_are_searched_together(rotation):
    x = default_rng(2).standard_normal((2, TIME.size))
    x[1] += 0.3 * mesh(20.21 * TIME, 1.0)
    assert_allclose(rotation(x), 20.21, rtol=1e-4)


def test_a_search_that_reaches_sidebands_or_folds_is_refused():
    with refused("reaches sidebands", ValueError):
        find_mesh_frequency(TIME, RATE, 84, 5.0)
    with refused("above half", ValueError):
        find_mesh_frequency(TIME, RATE, TEETH, 300.0)


def test_angle_from_the_mesh_phase():
    x = (1 + 0.5 * np.cos(tau * TURNS)) * mesh(TURNS, 1.0, 0.4)
    x += 0.3 * default_rng(3).standard_normal(TIME.size)
    inner = slice(500, -500)  # a turn at either end is averaged over fewer samples

    for harmonic in (1, 2):
        angle = mesh_phase_angle(
            x,
            RATE,
            TEETH,
            TEETH * 20.0,
            harmonic=harmonic,
        )
        error = (angle - tau * TURNS)[inner]
        assert np.ptp(error) < np.radians(1.0)  # noise in the band

    steady = (tau * 20.0 * TIME - tau * TURNS)[inner]
    assert np.ptp(steady) > np.radians(40)


def test_no_line_no_angle():
    noise = default_rng(5).standard_normal(TIME.size)
    with refused("no steady line stands out at 460 Hz", ValueError):
        mesh_phase_angle(noise, RATE, TEETH, TEETH * 20.0)
    mesh_phase_angle(
        noise + mesh(20.0 * TIME, 0.5),
        RATE,
        TEETH,
        TEETH * 20.0,
    )
