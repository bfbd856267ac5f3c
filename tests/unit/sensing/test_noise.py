"""Noise of every kind at its level, and with the spectrum that its name says."""

import math

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose
from refusals import refused
from scipy.signal import butter, sosfilt
from sensing_groups import MACHINE

from gensig.sensing.noise import PARTS, read_noise
from gensig.sensing.noise_parts import Receiver, band_power

RATE = 51200.0
POWER = np.array([2.0, 0.3])
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


def through_path(rng):
    return np.cumsum(
        rng.standard_normal((2, 51_200)),
        axis=1,
    )


def made(parts, *, power=(1.0, 1.0), seed=1, n_samples=51_200, band=None):
    """Noise of two sensors, (sensor, sample)."""
    receiver = Receiver(
        sensors=("a", "b"),
        n_samples=n_samples,
        sampling_rate=RATE,
        through_path=lambda rng: through_path(rng)[:, :n_samples],
    )
    noise = read_noise({"parts": parts, "band_hz": band})
    return noise.make(
        np.array(power),
        default_rng(seed),
        receiver,
    )


def of_kinds(*kinds, **options):
    return made(
        [KINDS[kind] for kind in kinds],
        **options,
    )


def write(kind, path, axis, columns, names):
    """A part of noise by a user's file."""
    header = ",".join([axis, *names])
    table = np.column_stack(columns)
    np.savetxt(path, table, "%.9g", ",", header=header, comments="")
    return {
        "kind": kind,
        "share": 1.0,
        "file": str(path),
    }


def background(path, columns, *, rate=RATE, names=("background",)):
    time = np.arange(len(columns[0])) / rate
    return write(
        "file",
        path,
        "time_s",
        [time, *columns],
        names,
    )


def spectrum(path, columns, *, names=("background",)):
    return write("spectrum", path, "frequency_hz", columns, names)


def density(signal):
    return np.abs(np.fft.rfft(signal, axis=1)) ** 2


def test_every_kind_is_tested():
    assert set(KINDS) | {"file", "spectrum"} == set(PARTS)


@pytest.mark.parametrize("n_samples", [2048, 51_200])
@pytest.mark.parametrize(
    "kinds",
    [*[(kind,) for kind in KINDS], tuple(KINDS)],
    ids="-".join,
)
def test_power_is_exact(kinds, n_samples):
    noise = of_kinds(*kinds, power=POWER, n_samples=n_samples)
    assert_allclose(np.var(noise, axis=1), POWER)
    assert_allclose(
        noise.mean(axis=1),
        0.0,
        atol=1e-9,
    )


@pytest.mark.parametrize(
    "kinds",
    [("white",), ("pink", "hum"), tuple(KINDS)],
    ids="-".join,
)
def test_power_in_a_band(kinds):
    band = [300.0, 8000.0]
    noise = of_kinds(*kinds, power=POWER, band=band)
    sections = butter(8, band, "bandpass", fs=RATE, output="sos")
    within = sosfilt(sections, noise, axis=1)

    assert_allclose(
        np.var(within, axis=1),
        POWER,
        rtol=0.04,
    )
    assert np.all(np.var(noise, axis=1) > 1.02 * POWER)


@pytest.mark.parametrize(
    ("band", "expected"),
    [((900, 1100), 4.5), ((0, 25_600), 4.5), (None, 4.5), ((1200, 2000), 0.0)],
)
def test_band_power_of_a_tone(band, expected):
    time = np.arange(51_200) / RATE
    tone = 3.0 * np.sin(math.tau * 1000.0 * time)[None] + 5.0
    assert_allclose(
        band_power(tone, RATE, band),
        expected,
        atol=1e-9,
    )


def test_shares_are_of_the_power():
    noise = made([KINDS["white"] | {"share": 3.0}, KINDS["hum"]])
    lines = 2.0 * density(noise)[:, [50, 100, 150]] / 51_200**2
    assert_allclose(
        lines.sum(axis=1),
        0.25,
        rtol=0.02,
    )
    assert_allclose(
        lines[:, 1] / lines[:, 0],
        0.25,
        rtol=0.1,
    )


def test_pink_falls_by_three_decibel_an_octave():
    lines = density(of_kinds("pink"))
    octaves = [lines[:, low : 2 * low].mean() for low in (64, 256, 1024, 4096)]
    assert_allclose(
        np.diff(np.log(octaves)),
        np.log(0.25),
        atol=0.15,
    )


def test_impulsive_has_a_high_kurtosis_and_rings_where_it_says():
    noise = of_kinds("impulsive")
    assert np.all(np.mean(noise**4, axis=1) > 20.0)
    assert abs(np.argmax(density(noise).sum(axis=0)) - 3000) < 200


def test_another_machine_has_its_orders_and_nothing_else():
    lines = density(of_kinds("machine")).sum(axis=0)
    orders = [1, 2, 3]
    for side in (-1, 0, 1):
        orders += [3.6 * k + side for k in range(1, 5)]
        orders += [31 * k + side for k in range(1, 4)]
    ours = lines[[round(25 * order) for order in orders]]

    assert np.all(ours > 0.0)
    assert_allclose(ours.sum(), lines.sum())


def test_background_takes_a_stretch(tmp_path):
    recording = default_rng(6).standard_normal((2, 5000))
    part = background(
        tmp_path / "two.csv",
        recording,
        names=("a", "b"),
    )
    noise = made([part], n_samples=1000)
    starts = []

    for whole, stretch in zip(recording, noise, strict=True):
        start = int(np.argmax(np.correlate(whole, stretch, "valid")))
        cut = whole[start : start + 1000]
        assert np.corrcoef(cut, stretch)[0, 1] > 1 - 1e-6
        starts.append(start)
    assert starts[0] == starts[1]


def test_spectrum_has_the_density_of_its_file(tmp_path):
    columns = [
        [100.0, 1000.0, 2000.0],
        [1.0, 1.0, 9.0],
        [4.0, 1.0, 1.0],
    ]
    part = spectrum(
        tmp_path / "s.csv",
        columns,
        names=("a", "b"),
    )
    noise, other = (made([part], power=POWER, seed=seed) for seed in (3, 4))

    assert_allclose(np.var(noise, axis=1), POWER)

    lines = density(noise)[0]
    flat, middle, high = (
        lines[low:stop].mean() for low, stop in ((200, 900), (1400, 1600), (3000, 9000))
    )
    # straight between the lines, held beyond the last
    assert_allclose(high / flat, 9.0, rtol=0.15)
    assert_allclose(middle / flat, 5.0, rtol=0.25)
    assert abs(np.corrcoef(noise[0], other[0])[0, 1]) < 0.05


def test_refused_files(tmp_path):
    """More of files in test_measured_path."""
    lines, good, both = [100.0, 1000.0], [1.0, 2.0], ("a", "b")
    long = default_rng(8).standard_normal((1, 2000))

    def of_spectrum(name, *columns, **names):
        return spectrum(tmp_path / name, columns, **names)

    def of_file(name, columns, **options):
        return background(tmp_path / name, columns, **options)

    cases = {
        "no column b": of_spectrum("a", lines, good, names=("a",)),
        "must rise": of_spectrum("b", lines[::-1], good),
        "must not be negative": of_spectrum("c", lines, [1.0, -1.0]),
        "nor 0 throughout": of_spectrum("d", lines, [0.0, 0.0], good, names=both),
        "no column a": of_file("e", long, names=("c",)),
        "samples a second": of_file("f", long, rate=8000),
        "one value throughout": of_file("g", np.ones((1, 2000))),
        "too short: 900 rows, at least 1000": of_file("h", long[:, :900]),
    }

    for text, part in cases.items():
        with refused(text):
            made([part], n_samples=1000)


def test_offsets_make_a_sensor_louder(machine, xiamen):
    changes = {"sensing.channels": ["pinion_x", "pinion_y"]}
    offset = {"sensing.noise.offsets_db": [3.0, -7.0]}
    sensing = machine(changes | offset).sensing
    levels = 10.0 * np.log10(sensing.noise_factor(20.0))

    assert_allclose(levels, [-17.0, -27.0])
    assert np.all(xiamen.sensing.noise_factor(13.7) == 10.0 ** (-13.7 / 10.0))
    with refused("has 2 values for 4 sensors"):
        machine(offset)
