"""An accelerometer's response, its scatter and its converter."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import hilbert

from gensig.errors import ConfigError
from gensig.sensing.accelerometer import LIMITS, Accelerometer, draw_sensors

RATE = 51200.0
IDEAL = Accelerometer(
    sensitivity_tolerance=0.0,
    transverse_sensitivity=0.0,
    mounted_resonance=None,
    resonance_damping_ratio=0.02,
    low_cutoff=None,
    dc_offset_m_per_s2=0.0,
    adc_range_m_per_s2=None,
    adc_bits=None,
    max_clipped_fraction=0.001,
    drift_scatter=0.0,
    drift_time=10.0,
    dropped_fraction=0.0,
    dropped_run_samples=64,
    dropped_fill="hold",
)


def gain(sensor, frequency):
    time = np.arange(51200) / RATE
    answer = sensor.filtered(np.sin(2 * np.pi * frequency * time)[None], RATE)[
        0, 25_600:
    ]
    return np.sqrt(2.0 * np.mean(answer**2))


def test_ideal_changes_no_bit():
    signal = default_rng(0).standard_normal((2, 300))
    assert IDEAL.is_ideal
    assert_array_equal(IDEAL.filtered(signal, RATE), signal)

    same, clipped = IDEAL.digitised(signal)
    assert same is signal
    assert clipped == 0.0


@pytest.mark.parametrize(
    "frequency",
    [1000.0, 8000.0, 18_000.0],
)
@pytest.mark.parametrize(
    "resonance",
    [12_000.0, 25_000.0, 40_000.0],
)
def test_mounted_resonance_also_above_half_the_rate(resonance, frequency):
    sensor = replace(IDEAL, mounted_resonance=resonance)
    ratio = frequency / resonance
    exact = 1.0 / abs(1.0 - ratio**2 + 0.04j * ratio)
    assert_allclose(gain(sensor, frequency), exact, rtol=2e-3)


@pytest.mark.parametrize("damping", [0.01, 0.05, 0.2, 0.7])
def test_a_mounted_resonance_is_as_sharp_as_its_damping_says(damping):
    """At resonance the gain of an oscillator is 1 / (2 zeta)."""
    sensor = replace(IDEAL, mounted_resonance=12_000.0, resonance_damping_ratio=damping)
    assert_allclose(gain(sensor, 12_000.0), 0.5 / damping, rtol=2e-3)


@pytest.mark.parametrize("damping", [0.005, 0.02])
def test_a_mounted_resonance_rings_down_as_its_damping_says(damping):
    """After an impulse the envelope falls as exp(-zeta W t)."""
    resonance = 4000.0
    sensor = replace(
        IDEAL, mounted_resonance=resonance, resonance_damping_ratio=damping
    )
    n_settling = round(sensor.memory_of_resonance * RATE)
    impulse = np.zeros((1, 2 * n_settling))
    impulse[0, 0] = 1.0
    envelope = np.abs(hilbert(sensor.filtered(impulse, RATE)[0]))
    time = np.arange(n_settling // 10, n_settling) / RATE
    slope, _ = np.polyfit(time, np.log(envelope[n_settling // 10 : n_settling]), 1)

    rate = 2 * np.pi * resonance * damping
    assert_allclose(slope, -rate, rtol=5e-3)
    assert_allclose(rate * sensor.memory_of_resonance, 5.0)


@pytest.mark.parametrize(
    "frequency",
    [2.0, 5.0, 10.0, 20.0, 200.0],
)
def test_low_cut_off_is_of_first_order(frequency):
    exact = 1.0 / np.sqrt(1.0 + (10.0 / frequency) ** 2)
    assert_allclose(
        gain(replace(IDEAL, low_cutoff=10.0), frequency),
        exact,
        rtol=0.01,
    )


@pytest.mark.parametrize(
    "bits",
    [8, 12, 16],
)
def test_converter_steps_and_range(bits):
    sensor = replace(IDEAL, adc_range_m_per_s2=10.0, adc_bits=bits)
    signal = np.linspace(-11.0, 11.0, 100_001)[None]
    result, clipped = sensor.digitised(signal)
    step = 10.0 / 2 ** (bits - 1)

    assert_allclose(
        result / step,
        np.rint(result / step),
        atol=1e-9,
    )

    limited = signal.clip(-10.0, 10.0 - step)
    assert_allclose(
        result,
        limited,
        rtol=0,
        atol=0.5 * step * (1 + 1e-9),
    )
    assert_allclose(
        [result.min(), result.max()],
        [-10.0, 10.0 - step],
    )
    assert_allclose(clipped, 2.0 / 22.0, atol=step)


def test_scatter_stays_within_the_data_sheet():
    sheet = {"gain": 0.1, "transverse": 0.05, "offset": 0.3}
    sensor = replace(
        IDEAL,
        sensitivity_tolerance=sheet["gain"],
        transverse_sensitivity=sheet["transverse"],
        dc_offset_m_per_s2=sheet["offset"],
    )
    drawn = [draw_sensors(default_rng(seed), sensor, 3) for seed in range(300)]

    for name, most in sheet.items():
        values = np.array([getattr(sensors, name) for sensors in drawn])
        share = (values - (name == "gain")) / most
        assert 0.97 < np.abs(share).max() <= 1 + 1e-12
        assert abs(share.mean()) < 0.1


@pytest.mark.parametrize("name", LIMITS)
def test_limits(name):
    low, high = LIMITS[name]
    for value in (low - 1, 2 * high):
        with pytest.raises(
            ConfigError, match=rf"sensing\.sensor\.{name}.* must lie in"
        ):
            replace(
                IDEAL,
                **{"adc_range_m_per_s2": 1.0, "adc_bits": 12, name: value},
            )
