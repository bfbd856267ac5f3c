"""Noise of a level in absolute units: of a sensor, of its data sheet, or of a recording."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose
from refusals import refused
from sensing_groups import BEARING, HOUSING, changed

import gensig
from gensig.sensing.noise_parts import band_power
from gensig.sensing.options import read_sensing
from gensig.signals.recording import STANDARD_GRAVITY

QUIET = ("fault=healthy", "plan.n_records=2", "operating.duration_s=0.1")
LEVEL = "sensing.noise.level_m_per_s2"


def powers(changes, *, group=BEARING, n_samples=51_200):
    """Mean square of the noise whatever the signal is, (sensor,)."""
    sensing = read_sensing(changed(group, {"snr_db": None, **changes}))
    return sensing.noise_power(np.zeros(len(sensing.channel_names)), n_samples)


@pytest.mark.parametrize("sensing", ["bearing", "machine"])
def test_a_level_is_that_of_the_noise_however_loud_the_signal_is(sensing):
    words = (f"sensing={sensing}", "sensing.snr_db=null", "dataset.store_clean=true")
    levels = []
    for speed in (300, 3000):
        stream = gensig.stream(
            *QUIET, *words, f"{LEVEL}=0.7", f"operating.speed_rpm={speed}"
        )
        record = stream[0]
        signals = record.signals
        noise = signals["acceleration"].astype(float) - signals["acceleration_clean"]
        band = (10.0, 10_000.0) if sensing == "machine" else None
        measured = band_power(noise, stream.sampling_rate_hz, band)
        # white noise alone has the level on the average; converters add an offset and 1e-4
        assert_allclose(np.sqrt(measured), 0.7, rtol=0.03)
        assert_allclose(signals["noise_power"], 0.49)
        assert np.isnan(record.values["snr_db"])
        levels.append(signals["signal_power"])
    assert np.all(levels[1] > 2.0 * levels[0])


def test_a_density_is_a_level_over_the_band():
    density = {"noise.density_ug_per_sqrt_hz": 400.0}
    power = 400e-6**2 * STANDARD_GRAVITY**2  # of each hertz
    assert_allclose(powers(density), power * 25_600.0)
    banded = density | {"noise.band_hz": [10.0, 10_000.0]}
    assert_allclose(powers(banded, group=HOUSING), power * 9_990.0)
    louder = density | {"noise.offsets_db": [0.0, 10.0, -10.0, 0.0]}
    assert_allclose(powers(louder) / powers(density), [1.0, 10.0, 0.1, 1.0])


def test_a_recording_keeps_its_level(tmp_path):
    file = tmp_path / "background.csv"
    heard = 0.3 * default_rng(4).standard_normal(20_000)
    time = np.arange(heard.size) / 51_200.0
    header = "time_s,background"
    np.savetxt(file, np.c_[time, heard], "%.12g", ",", header=header, comments="")
    part = {"kind": "file", "share": 1.0, "file": str(file)}
    changes = {"noise.parts": [part], "noise.file_level": True}
    assert_allclose(powers(changes, n_samples=4000), np.var(heard), rtol=1e-9)


def test_a_spectrum_keeps_its_level(tmp_path):
    file = tmp_path / "density.csv"
    file.write_text("frequency_hz,background\n0,2e-4\n30000,2e-4\n")
    part = {"kind": "spectrum", "share": 1.0, "file": str(file)}
    changes = {"noise.parts": [part], "noise.file_level": True}
    assert_allclose(powers(changes), 2e-4 * 25_600.0, rtol=1e-4)
    banded = changes | {"noise.band_hz": [1000.0, 2000.0]}
    assert_allclose(powers(banded), 0.2, rtol=2e-3)


def test_no_level_and_no_ratio_is_no_noise():
    assert np.all(powers({}) == 0.0)


def test_a_drawn_ratio_and_a_level_contradict_each_other():
    with refused("both set the level of the noise: add sensing.snr_db=null"):
        gensig.stream("experiment=quickstart", f"{LEVEL}=0.7")
    stream = gensig.stream(
        "experiment=quickstart", f"{LEVEL}=0.7", "sensing.snr_db=null"
    )
    assert np.isnan(stream.column("snr_db")).all()


def test_a_level_can_be_drawn():
    vary = f"plan.vary={{{LEVEL}: {{distribution: uniform, low: 0.2, high: 0.9}}}}"
    stream = gensig.stream(*QUIET, "sensing.snr_db=null", vary)
    drawn = stream.column(f"params/{LEVEL}")
    assert len(set(drawn)) == 2
    made = [record.signals["noise_power"] for record in stream]
    assert_allclose(made, np.repeat(drawn[:, None] ** 2, 4, axis=1))
