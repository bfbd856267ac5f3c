"""Noise of every kind at its level, and with the spectrum that its name says."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sensing_groups import MACHINE

from gensig.errors import ConfigError
from gensig.sensing.noise import PARTS, Receiver, band_power, read_noise

RATE = 51200.0
CHANGES = {
    "hum": {"n_harmonics": 3},
    "impulsive": {"knocks_hz": 5.0},
    "machine": {
        "shaft_hz": 25.0,
        "frequency_scatter": 0.0,
        "n_shaft_orders": 3,
        "bearing_order": 3.6,
        "n_bearing_harmonics": 4,
        "n_mesh_harmonics": 3,
    },
}
# parts of the shipped machine, each alone
KINDS = {
    part["kind"]: part | {"share": 1.0} | CHANGES.get(part["kind"], {})
    for part in MACHINE["noise"]["parts"]
}


def receiver(n_samples=51200):
    def through_path(rng):
        return np.cumsum(rng.standard_normal((2, n_samples)), axis=1)

    return Receiver(
        sensors=("a", "b"),
        n_samples=n_samples,
        sampling_rate=RATE,
        through_path=through_path,
    )


def noise(*kinds, band=None):
    return read_noise({"parts": [KINDS[kind] for kind in kinds], "band_hz": band})


def write(kind, path, axis, columns, names):
    """A part of noise by a user's file."""
    header = ",".join([axis, *names])
    table = np.column_stack(columns)
    np.savetxt(path, table, "%.9g", ",", header=header, comments="")
    return {"kind": kind, "share": 1.0, "file": str(path)}


def background(path, columns, *, rate=RATE, names=("background",)):
    time = np.arange(len(columns[0])) / rate
    return write("file", path, "time_s", [time, *columns], names)


def spectrum(path, columns, *, names=("background",)):
    return write("spectrum", path, "frequency_hz", columns, names)


def density(signal):
    return np.abs(np.fft.rfft(signal, axis=1)) ** 2


def test_every_kind_is_tested():
    assert set(KINDS) | {"file", "spectrum"} == set(PARTS)


@pytest.mark.parametrize("n_samples", [2048, 51200])
@pytest.mark.parametrize(
    "kinds", [*[(kind,) for kind in KINDS], tuple(KINDS)], ids="-".join
)
def test_power_is_exact(kinds, n_samples):
    power = np.array([2.0, 0.3])
    made = noise(*kinds).make(power, np.random.default_rng(1), receiver(n_samples))
    assert_allclose(np.var(made, axis=1), power, rtol=1e-9)
    assert_allclose(made.mean(axis=1), 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "kinds", [("white",), ("pink", "hum"), tuple(KINDS)], ids="-".join
)
def test_power_in_a_band(kinds):
    from scipy.signal import butter, sosfilt

    band, power = [300.0, 8000.0], np.array([2.0, 0.3])
    made = noise(*kinds, band=band).make(power, np.random.default_rng(1), receiver())
    sections = butter(8, band, "bandpass", fs=RATE, output="sos")
    within = sosfilt(sections, made, axis=1)
    assert_allclose(np.var(within, axis=1), power, rtol=0.04)
    assert np.all(np.var(made, axis=1) > 1.02 * power)


@pytest.mark.parametrize(
    ("band", "expected"),
    [((900, 1100), 4.5), ((0, 25_600), 4.5), (None, 4.5), ((1200, 2000), 0.0)],
)
def test_band_power_of_a_tone(band, expected):
    tone = 3.0 * np.sin(2 * np.pi * 1000.0 * np.arange(51200) / RATE)[None] + 5.0
    assert_allclose(band_power(tone, RATE, band), expected, rtol=1e-9, atol=1e-9)


def test_shares_are_of_the_power():
    parts = [{**KINDS["white"], "share": 3.0}, {**KINDS["hum"], "share": 1.0}]
    made = read_noise({"parts": parts, "band_hz": None}).make(
        np.ones(2), np.random.default_rng(2), receiver()
    )
    lines = 2.0 * density(made)[:, [50, 100, 150]] / 51200**2
    assert_allclose(lines.sum(axis=1), 0.25, rtol=0.02)
    assert_allclose(lines[:, 1] / lines[:, 0], 0.25, rtol=0.1)


def test_pink_falls_by_three_decibel_an_octave():
    made = noise("pink").make(np.ones(2), np.random.default_rng(3), receiver())
    octaves = [density(made)[:, low : 2 * low].mean() for low in (64, 256, 1024, 4096)]
    assert_allclose(np.array(octaves[1:]) / octaves[:-1], 0.25, rtol=0.15)


def test_impulsive_has_a_high_kurtosis_and_rings_where_it_says():
    made = noise("impulsive").make(np.ones(2), np.random.default_rng(4), receiver())
    assert np.all(np.mean(made**4, axis=1) > 20.0)
    assert abs(np.argmax(density(made).sum(axis=0)) - 3000) < 200


def test_another_machine_has_its_orders_and_nothing_else():
    made = noise("machine").make(np.ones(2), np.random.default_rng(5), receiver())
    orders = [
        *range(1, 4),
        *(3.6 * k + s for k in range(1, 5) for s in (-1, 0, 1)),
        *(31 * k + s for k in range(1, 4) for s in (-1, 0, 1)),
    ]
    lines = density(made).sum(axis=0)
    ours = lines[[round(25 * order) for order in orders]]
    assert np.all(ours > 0.0)
    assert_allclose(ours.sum(), lines.sum(), rtol=1e-9)


def test_background_takes_a_stretch(tmp_path):
    recording = np.random.default_rng(6).standard_normal((2, 5000))
    part = background(tmp_path / "two.csv", recording, names=("a", "b"))
    made = read_noise({"parts": [part], "band_hz": None}).make(
        np.ones(2), np.random.default_rng(7), receiver(1000)
    )
    starts = []
    for whole, stretch in zip(recording, made, strict=True):
        start = int(np.argmax(np.correlate(whole, stretch, "valid")))
        part = whole[start : start + 1000]
        assert np.corrcoef(part, stretch)[0, 1] > 1 - 1e-6
        starts.append(start)
    assert starts[0] == starts[1]


def test_spectrum_has_the_density_of_its_file(tmp_path):
    columns = [[100.0, 1000.0, 2000.0], [1.0, 1.0, 9.0], [4.0, 1.0, 1.0]]
    part = spectrum(tmp_path / "s.csv", columns, names=("a", "b"))
    noise = read_noise({"parts": [part], "band_hz": None})
    power = np.array([2.0, 0.3])
    made, other = (
        noise.make(power, np.random.default_rng(seed), receiver()) for seed in (3, 4)
    )
    assert_allclose(np.var(made, axis=1), power, rtol=1e-9)
    lines = density(made)[0]
    flat, middle, high = lines[200:900], lines[1400:1600], lines[3000:9000]
    # straight between the lines, held beyond the last
    assert_allclose(high.mean() / flat.mean(), 9.0, rtol=0.15)
    assert_allclose(middle.mean() / flat.mean(), 5.0, rtol=0.25)
    assert abs(np.corrcoef(made[0], other[0])[0, 1]) < 0.05


def test_refused_files(tmp_path):
    """More of files in test_measured_path."""
    lines, good, both = [100.0, 1000.0], [1.0, 2.0], ("a", "b")
    rng = np.random.default_rng(8)
    long = rng.standard_normal((1, 2000))

    def of_spectrum(name, *columns, names=("background",)):
        return spectrum(tmp_path / name, columns, names=names)

    cases = {
        "no column b": of_spectrum("a", lines, good, names=("a",)),
        "must rise": of_spectrum("b", lines[::-1], good),
        "must not be negative": of_spectrum("c", lines, [1.0, -1.0]),
        "nor 0 throughout": of_spectrum("d", lines, [0.0, 0.0], good, names=both),
        "no column a": background(tmp_path / "e", long, names=("c",)),
        "samples a second": background(tmp_path / "f", long, rate=8000),
        "one value throughout": background(tmp_path / "g", np.ones((1, 2000))),
        "too short: 900 rows, at least 1000": background(tmp_path / "h", long[:, :900]),
    }
    for text, part in cases.items():
        noise = read_noise({"parts": [part], "band_hz": None})
        with pytest.raises(ConfigError, match=re.escape(text)) as caught:
            noise.make(np.ones(2), rng, receiver(1000))
        assert "\n" not in str(caught.value)


def test_offsets_make_a_sensor_louder(machine, xiamen):
    changes = {"sensing.channels": ["pinion_x", "pinion_y"]}
    offset = {"sensing.noise.offsets_db": [3.0, -7.0]}
    sensing = machine(changes | offset).sensing
    levels = 10.0 * np.log10(sensing.noise_factor(20.0))
    assert_allclose(levels, [-17.0, -27.0], atol=1e-9)
    assert np.all(xiamen.sensing.noise_factor(13.7) == 10.0 ** (-13.7 / 10.0))
    with pytest.raises(ConfigError, match="has 2 values for 4 sensors"):
        machine(offset)
