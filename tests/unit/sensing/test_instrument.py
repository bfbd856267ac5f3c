"""The whole chain of one gearbox, and how a configuration describes it."""

import copy
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.plan.request import read_request
from gensig.sensing.chain import power
from gensig.sensing.instrument import draw_instrument
from gensig.sensing.options import NESTED, read_sensing

HOUSING = read_request(["sensing=housing"]).config["sensing"]
BEARING = read_request([]).config["sensing"]


def changed(values, **changes):
    own = copy.deepcopy(dict(values))
    for name, value in changes.items():
        *parents, leaf = name.split("__")
        node = own
        for parent in parents:
            node = node[parent]
        node[leaf] = value
    return own


def instrument(values, seed=0):
    return draw_instrument(
        read_sensing(values),
        *(np.random.default_rng(seed + place) for place in range(2)),
    )


def source(sensing, n_samples=51_200):
    return np.random.default_rng(9).standard_normal(
        (len(sensing.channels), sensing.n_lead + n_samples)
    )


def test_on_the_bearing_nothing_changes():
    one = instrument(BEARING)
    signal = source(one.sensing, 500)
    assert one.sensing.n_lead == 0
    assert one.sensing.channel_names == one.sensing.channels
    assert one.measure(signal) is signal


def test_measuring_is_linear_and_names_the_sensors():
    one = instrument(HOUSING)
    first, second = source(one.sensing, 2000), source(one.sensing, 2000)[::-1]
    assert one.sensing.channel_names == (
        "housing_input",
        "housing_output",
        "housing_top",
    )
    together = one.measure(2.0 * first - second)
    assert together.shape == (3, 2000)
    assert_allclose(
        together, 2.0 * one.measure(first) - one.measure(second), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("n_lead", [0, None])
def test_filters_have_settled_at_the_first_sample(n_lead, monkeypatch):
    one = instrument(HOUSING)
    long = source(one.sensing, 60_000)
    reference = one.measure(long)[:, -5000:]
    given = one.sensing.n_lead if n_lead is None else n_lead
    monkeypatch.setattr(type(one.sensing), "n_lead", property(lambda _: given))
    error = one.measure(long[:, -5000 - given :]) - reference
    level = 10.0 * np.log10(np.max(power(error[:, :2560]) / power(reference)))
    if n_lead is None:
        assert level < -50.0
    else:
        assert level > -30.0  # without a lead-in it shows


@pytest.mark.parametrize("snr_db", [-5.0, 20.0])
@pytest.mark.parametrize("n_samples", [5120, 51_200])
def test_achieved_signal_to_noise_ratio_in_the_band(snr_db, n_samples):
    one = instrument(
        changed(HOUSING, sensor__adc_bits=None, sensor__adc_range_m_per_s2=None)
    )
    clean = one.measure(source(one.sensing, n_samples))
    noisy, clipped = one.record(
        clean, one.power(clean) * 10 ** (-snr_db / 10), np.random.default_rng(3)
    )
    found = 10 * np.log10(one.power(clean) / one.power(noisy - clean))
    assert_allclose(found, snr_db, rtol=0, atol=0.1)
    assert clipped == 0.0
    assert not np.allclose(power(noisy - clean), one.power(noisy - clean), rtol=1e-3)


def test_noise_of_the_path_has_the_resonances_of_the_path():
    parts = [{"kind": "path", "share": 1.0}]
    one = instrument(
        changed(
            HOUSING,
            noise__parts=parts,
            path__n_modes=[1, 1],
            path__natural_frequency_hz=[2000, 2000],
        )
    )
    noise = one.record(np.zeros((3, 51_200)), np.ones(3), np.random.default_rng(4))[0]
    lines = np.abs(np.fft.rfft(noise, axis=1)) ** 2
    assert np.all(
        lines[:, 1900:2100].mean(axis=1) > 100.0 * lines[:, 9000:10_000].mean(axis=1)
    )


def test_no_noise_leaves_converter_and_offset():
    one = instrument(HOUSING)
    found = one.record(np.zeros((3, 100)), np.zeros(3), np.random.default_rng(0))[0]
    assert np.all(np.ptp(found, axis=1) == 0.0)
    assert_allclose(found[:, 0], one.sensors.offset, rtol=0, atol=0.5 * 2000 / 2**23)


def test_transverse_motion_of_a_bearing_sensor():
    values = changed(BEARING, sensor__transverse_sensitivity=0.05)
    one = instrument(values)
    still = np.zeros((4, 300))
    still[0] = np.random.default_rng(1).standard_normal(300)  # pinion_x alone
    found = one.measure(still)
    assert_allclose(found[1], one.sensors.transverse[1] * still[0], rtol=1e-12, atol=0)
    assert abs(one.sensors.transverse[1]) > 1e-4
    assert not found[2:].any()


def test_gearboxes_differ_and_path_and_sensor_have_their_own_numbers():
    path = [instrument(HOUSING, seed).path.natural_frequency[0] for seed in range(5)]
    assert len(set(path)) == 5
    calm = changed(HOUSING, path__n_modes=[3, 3])
    assert_allclose(
        instrument(calm).sensors.gain, instrument(HOUSING).sensors.gain, rtol=0, atol=0
    )


NO_PATH = {"noise__parts": [{"kind": "path", "share": 1}]}
ONE_AXIS = {"channels": ["pinion_y"], "sensor__transverse_sensitivity": 0.1}


@pytest.mark.parametrize(
    ("values", "changes", "text"),
    [
        (
            HOUSING,
            {"sensors": None},
            "that a transfer path leads to: give at least one",
        ),
        (
            BEARING,
            {"sensors": ["a"]},
            "leave it null with sensing.path.kind = identity",
        ),
        (HOUSING, {"sensors": ["a", "a"]}, "must name at least one sensor, each once"),
        (HOUSING, {"sensors": ["a b"]}, "sensing.sensors: 'a b'"),
        (HOUSING, {"sensors": ["my_rotation"]}, "not ending in 'rotation'"),
        (HOUSING, {"channels": ["pinion_rotation"]}, "pinion_rotation is no bearing"),
        (HOUSING, {"sampling_rate_hz": 20_000}, "above the usable band of 7812.5 Hz"),
        (
            HOUSING,
            {"sampling_rate_hz": 25_600},
            "=[300,10000]' or a rate of at least 30720 Hz",
        ),
        (
            HOUSING,
            {"noise__band_hz": [10, 30_000]},
            "above half of sensing.sampling_rate_hz",
        ),
        (
            HOUSING,
            {"path": {"kind": "measured", "file": "x"}},
            "tells no transverse motion",
        ),
        (BEARING, NO_PATH, "kind path needs a transfer path"),
        (BEARING, {"path": {"kind": "modal"}}, "sensing.path: missing n_modes"),
        (
            BEARING,
            {"path": {"kind": "short"}},
            "= 'short'; allowed: identity, modal, measured",
        ),
        (BEARING, {"path": None}, "sensing.path.kind = None"),
        (BEARING, {"path": {"kind": "identity", "file": "x"}}, "unknown key 'file'"),
        (
            BEARING,
            {"noise": {"parts": []}},
            "must be a group of the keys parts and band_hz",
        ),
        (BEARING, ONE_AXIS, "without the other axis"),
    ],
)
def test_refusals(values, changes, text):
    with pytest.raises(ConfigError, match=re.escape(text)) as caught:
        read_sensing(changed(values, **changes))
    assert "\n" not in str(caught.value)


def test_a_group_without_its_parts_is_named():
    plain = {key: value for key, value in BEARING.items() if key not in NESTED}
    with pytest.raises(ConfigError, match="sensing: missing path, sensor, noise, nuis"):
        read_sensing(plain)
