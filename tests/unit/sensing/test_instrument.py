"""The whole chain of one gearbox, and how a configuration describes it."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from sensing_groups import BEARING, HOUSING, MACHINE, changed, instrument, source

from gensig.sensing.chain import add_noise, power


@pytest.mark.parametrize(
    "group",
    [BEARING, HOUSING],
    ids=["bearing", "housing"],
)
def test_without_drift_and_loss_no_bit_changes(group):
    chain = instrument(group)
    emitted = source(chain.sensing, 300)
    signal = chain.measure(emitted)

    assert (signal is emitted) == (group is BEARING)

    rng = default_rng(0)
    assert_array_equal(chain.drifted(signal, rng), signal)

    same, share = chain.transmitted(signal, rng)
    assert same is signal
    assert share == 0.0


def test_measuring_is_linear_and_names_the_sensors():
    chain = instrument(HOUSING)
    first, second = source(chain.sensing, 2000), source(chain.sensing, 2000)[::-1]
    assert chain.sensing.channel_names == (
        "housing_input",
        "housing_output",
        "housing_top",
    )

    together = chain.measure(2.0 * first - second)
    assert together.shape == (3, 2000)
    assert_allclose(
        together,
        2.0 * chain.measure(first) - chain.measure(second),
        atol=1e-9,
    )


@pytest.mark.parametrize("has_lead", [False, True])
def test_filters_have_settled_at_the_first_sample(has_lead, monkeypatch):
    housing = instrument(HOUSING)
    long = source(housing.sensing, 60_000)
    reference = housing.measure(long)[:, -5000:]
    n_lead = has_lead * housing.sensing.n_lead
    monkeypatch.setattr(type(housing.sensing), "n_lead", n_lead)
    error = housing.measure(long[:, -5000 - n_lead :]) - reference
    ratio = np.max(power(error[:, :2560]) / power(reference))

    assert (ratio < 1e-5) == has_lead
    assert (ratio > 1e-3) != has_lead  # without a lead-in it shows


def test_noise_of_the_path_has_the_resonances_of_the_path():
    one_mode = {
        "noise.parts": [{"kind": "path", "share": 1.0}],
        "path.n_modes": [1, 1],
        "path.natural_frequency_hz": [2000, 2000],
    }
    housing = instrument(changed(HOUSING, one_mode))
    clean, rng = np.zeros((3, 51_200)), default_rng(4)
    noise, *_ = housing.record(
        clean,
        np.ones(3),
        rng,
    )
    lines = np.abs(np.fft.rfft(noise, axis=1)) ** 2
    near, far = lines[:, 1900:2100], lines[:, 9000:10_000]

    assert np.all(near.mean(axis=1) > 100.0 * far.mean(axis=1))


def test_no_noise_leaves_converter_and_offset():
    chain = instrument(HOUSING)
    result = chain.record(np.zeros((3, 100)), np.zeros(3), default_rng(0))[0]
    assert np.all(np.ptp(result, axis=1) == 0.0)
    assert_allclose(
        result[:, 0],
        chain.sensors.offset,
        atol=0.5 * 2000 / 2**23,
    )


def test_added_noise_is_white_and_power_ignores_the_mean():
    clean = np.full((1, 65_536), 3.0)
    (noise,) = add_noise(clean, np.array([2.0]), default_rng(2)) - clean
    assert_allclose(noise.var(), 2.0, rtol=0.02)
    assert_allclose(power(noise + 5.0), noise.var())

    bands = (np.abs(np.fft.rfft(noise)[1:]) ** 2).reshape(8, -1).mean(axis=1)
    assert_allclose(bands / bands.mean(), 1.0, atol=0.08)


def test_transverse_motion_of_a_bearing_sensor():
    bearing = instrument(changed(BEARING, {"sensor.transverse_sensitivity": 0.05}))
    still = np.zeros((4, 300))
    still[0] = default_rng(1).standard_normal(300)  # pinion_x alone
    result, share = bearing.measure(still), bearing.sensors.transverse[1]

    assert_allclose(result[1], share * still[0])
    assert abs(share) > 1e-4
    assert not result[2:].any()


def test_gearboxes_differ_and_path_and_sensor_have_their_own_numbers():
    path = [instrument(HOUSING, seed).path.natural_frequency[0] for seed in range(5)]
    assert len(set(path)) == 5
    few_modes = instrument(changed(HOUSING, {"path.n_modes": [3, 3]}))
    assert_array_equal(
        few_modes.sensors.gain,
        instrument(HOUSING).sensors.gain,
    )


def in_columns(signal):
    return np.asfortranarray(signal)


def every_other(signal):
    return np.repeat(signal, 2, axis=1)[:, ::2]


def backwards(signal):
    return np.ascontiguousarray(signal[:, ::-1])[:, ::-1]


@pytest.mark.parametrize("laid_out", [in_columns, every_other, backwards])
@pytest.mark.parametrize(
    "group", [BEARING, HOUSING, MACHINE], ids=("bearing", "housing", "machine")
)
def test_no_order_in_memory_decides_about_a_record(group, laid_out):
    """Sums of a path or a power round as the order says, so the first step sets one."""
    chain = instrument(group)
    emitted = source(chain.sensing, 3000)
    other = laid_out(emitted)
    assert not other.flags.c_contiguous

    expected, measured = chain.measure(emitted), chain.measure(other)
    assert_array_equal(measured, expected)
    assert_array_equal(chain.power(measured), chain.power(expected))

    noise_power = chain.power(expected)
    drifted = [chain.drifted(x, default_rng(1)) for x in (expected, laid_out(expected))]
    assert_array_equal(*drifted)
    noisy = [
        chain.transmitted(
            chain.record(x, noise_power, default_rng(2))[0], default_rng(3)
        )[0]
        for x in (expected, laid_out(expected))
    ]
    assert_array_equal(*noisy)


def test_a_sum_along_another_order_in_memory_differs():
    """The reason why what is measured has one order."""
    signal = default_rng(0).standard_normal((4, 51_200))
    assert np.any(power(in_columns(signal)) != power(signal))
