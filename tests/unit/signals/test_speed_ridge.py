"""The mesh of a wandering speed is followed to a fraction of a tooth; noise and other speeds are
not followed."""

from math import tau

import numpy as np
import pytest
from numpy.random import default_rng
from refusals import refused

from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import Recording
from gensig.signals.speed_ridge import mesh_frequency_course, wandering_mesh_cycles

RATE = 25600.0
TEETH = Teeth(driving=23, driven=57)
SPEED = 1500.0  # r/min
RATIO = TEETH.driving / TEETH.driven
ORDERS = {
    0.0: 1.0,
    1.0: 0.15,
    -1.0: 0.15,
    RATIO: 0.15,
    -RATIO: 0.15,
}


def recording_of(signal):
    names = tuple("abc"[: len(signal)])
    return Recording(sensors=names, acceleration=signal, sampling_rate=RATE)


def recording(depth, *, noise=1.0, duration=3.0, seed=0):
    """Mesh of four harmonics with sidebands of both shafts, and its cycles, at a speed that swings
    by a share."""
    rng = default_rng(seed)
    time = np.arange(round(duration * RATE)) / RATE
    swing = tau * 0.7
    turned = SPEED / 60 * (time + depth / swing * (1 - np.cos(swing * time)))
    cycles = TEETH.driving * turned
    signal = np.zeros((2, time.size))
    for harmonic in range(1, 5):
        for orders, share in ORDERS.items():
            height = share / harmonic * rng.uniform(0.5, 1.5, (2, 1))
            phase = rng.uniform(0, tau, (2, 1))
            angle = tau * (harmonic * cycles + orders * turned)
            signal += height * np.cos(angle + phase)
    signal += noise * rng.standard_normal(signal.shape)
    return recording_of(signal), cycles


def followed(made, speed_rpm=SPEED):
    return wandering_mesh_cycles(
        made,
        TEETH,
        speed_rpm,
        highest=10_000.0,
        options="the speed",
        longer="record longer",
    )


@pytest.mark.parametrize(
    ("depth", "stated"), [(0.0, 1.0), (0.003, 1.005), (0.02, 0.995)]
)
def test_cycles_are_found_to_a_fraction_of_a_tooth(depth, stated):
    made, cycles = recording(depth)
    result = followed(made, stated * SPEED)
    assert np.std(result - cycles) < 0.05
    assert np.all(np.diff(result) > 0)


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_not_followed(seed):
    shape = 1 + seed % 3, round((0.6 + seed) * RATE)
    noise = np.random.default_rng(seed).standard_normal(shape)
    with refused("sign of the mesh"):
        followed(recording_of(noise))


def test_a_speed_beyond_the_search_is_refused():
    with refused("sign of the mesh"):
        followed(recording(0.0)[0], 1.12 * SPEED)


def test_the_course_is_the_frequency_over_time():
    made, cycles = recording(0.02)
    mesh = SPEED / 60 * TEETH.driving

    def course(**changes):
        options = {"search": 0.03, "highest": 10_000.0} | changes
        signal, teeth = made.acceleration, TEETH.driving
        return mesh_frequency_course(signal, RATE, teeth, mesh, **options)

    time, result = course()
    frequency = np.gradient(cycles) * RATE
    true = np.interp(
        time,
        np.arange(cycles.size) / RATE,
        frequency,
    )
    error = result / true - 1

    assert np.abs(error).max() < 6e-3
    assert np.std(error) < 2e-3
    for wrong in ({"search": 0.05}, {"highest": 500.0}):
        with refused("no course", ValueError):
            course(**wrong)
