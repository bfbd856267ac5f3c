"""Recordings: what is read, and every file that is refused with one line."""

import numpy as np
from numpy.testing import assert_allclose
from refusals import refusals, refused

from gensig.cli import main
from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import STANDARD_GRAVITY
from gensig.twin.machine_recording import read_recording
from gensig.twin.speed import find_motion

RATE = 5120.0
SIGNAL = np.random.default_rng(1).standard_normal((2, 20_000))


def csv(path, columns, names):
    table = np.column_stack(columns)
    np.savetxt(path, table, "%.9g", ",", header=",".join(names), comments="")
    return str(path)


def timed(path, signal=SIGNAL, names=("a", "b"), rate=RATE):
    return csv(path, [np.arange(signal.shape[1]) / rate, *signal], ["time_s", *names])


class TestRead:
    @refusals(
        {
            "by ';': save it with commas, decimals with points": "time_s;a\n0,0;0,5\n",
            "separated by ';'": "0.000000;0.228867\n0.1;0.2\n",
            "separated by tabs": "time_s\ta\n0\t1\n",
            "its first line holds numbers, not names": "0.000000,0.228867\n0.1,0.2\n",
            "first line holds numbers, not names": "time_s,-1.5e-3\n0.1,0.2\n",
        }
    )
    def test_tables_without_a_header_or_commas(self, words, given, tmp_path):
        (tmp_path / "r.csv").write_text(given)
        check_refused(tmp_path / "r.csv", words, rate=RATE)

    def test_units_and_order_of_channels(self, tmp_path):
        file = timed(tmp_path / "u.csv", names=("case_g", "lid_m_per_s2"))
        size = SIGNAL.std(axis=1)
        result = read_recording(file)
        assert result.sensors == ("case", "lid")
        expected = size * [STANDARD_GRAVITY, 1.0]
        assert_allclose(result.acceleration.std(axis=1), expected, rtol=1e-6)
        plain = timed(tmp_path / "p.csv")
        result = read_recording(plain, unit="g", channels=["b", "a"])
        assert result.sensors == ("b", "a")
        expected = STANDARD_GRAVITY * size[::-1]
        assert_allclose(result.acceleration.std(axis=1), expected, rtol=1e-6)

    def test_names_become_sensors(self, tmp_path):
        result = read_recording(timed(tmp_path / "t.csv", names=("1 x", "gear case")))
        assert result.sensors == ("s_1_x_a", "gear_case")

    def test_halves(self, tmp_path):
        result = read_recording(timed(tmp_path / "t.csv"))
        first, second = result.part(0.0, 0.5), result.part(0.5, 1.0)
        assert first.acceleration.shape == second.acceleration.shape == (2, 10_000)
        assert_allclose(second.acceleration.mean(axis=1), 0.0, atol=1e-12)


@refusals(
    {  # more in test_recording_files
        "no channel c; it has a, b": {"channels": ["c"]},
        "each once": {"channels": ["a", "a"]},
        "time_s has 5120 samples a second, --rate says 6000": {"rate": 6000.0},
        "--rate 3 must lie in 1000..1000000": {"rate": 3.0},
        "--unit mm: allowed: m/s2, g": {"unit": "mm"},
    }
)
def test_refused_options(tmp_path, words, given):
    check_refused(timed(tmp_path / "r.csv"), words, **given)


@refusals(
    {
        "a_mm_per_s ends in _mm_per_s": ("a_mm_per_s", "b"),
        "differ in nothing but signs": ("a b", "a-b"),
    }
)
def test_refused_channels(tmp_path, words, given):
    check_refused(timed(tmp_path / "r.csv", names=given), words)


def check_refused(file, words, **options):
    with refused(words):
        read_recording(str(file), **options)


def test_refused_samples(tmp_path):
    file = tmp_path / "r.npy"
    check_refused(file, "cannot be read", rate=RATE)
    np.save(file, SIGNAL[:, :100])
    check_refused(file, "too short: 100 samples", rate=RATE)
    np.save(file, np.ones((1, 1000)))
    check_refused(file, "channel_0 holds one value throughout", rate=RATE)
    check_refused(file, "give the samples a second with --rate")
    check_refused(
        csv(tmp_path / "n.csv", SIGNAL, "ab"), "it has no column time_s; give"
    )
    time = np.arange(20_000) / RATE
    jump = [time + (time > 1.0), SIGNAL[0]]
    file = csv(tmp_path / "jump.csv", jump, ["time_s", "a"])
    check_refused(file, "time_s must rise in even steps")


class TestNoMesh:
    TEETH = Teeth(driving=23, driven=46)

    @refusals(
        {
            "no sign of the mesh": 1200.0,
            "turns of the slower gear, at least 8": 100.0,
            "above the usable band": 6000.0,
        }
    )
    def test_noise_at_a_speed(self, tmp_path, words, given):
        result = read_recording(timed(tmp_path / "n.csv"))
        with refused(words):
            find_motion(result, self.TEETH, given)


@refusals(
    {
        "--speed 0 must be positive": ["--speed", "0"],
        "--torque nan must be positive": ["--torque", "nan"],
        "pinion: 5 teeth": ["--teeth", "5", "46"],
        "twin takes overrides of the gears only": ["seed=3"],
        "is what --teeth says": ["gear.pinion.n_teeth=20"],
        "bore_radius_mm = 99 must lie between": ["gear.pinion.bore_radius_mm=99"],
        "gear.pinion.bore": ["gear.pinion.bore=3"],
        "--check": ["--check", "OTHER"],
        "samples a second, the recording": ["--check", "FASTER"],
        "no sign of the mesh": [],
        "is there and not an empty folder": ["--out", "USED"],
        "use letters, digits": ["--out", "a b"],
    }
)
def test_the_command_refuses_in_one_line(tmp_path, monkeypatch, capsys, words, given):
    monkeypatch.chdir(tmp_path)
    files = {
        "OTHER": timed(tmp_path / "other.csv", names=("a", "c")),
        "FASTER": timed(tmp_path / "faster.csv", rate=2.0 * RATE),
        "USED": "used",
    }
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "file").write_text("x")
    common = ("--teeth", "23", "46", "--speed", "1200", "--out", "mine")
    chosen = [files.get(word, word) for word in given]
    assert main(["twin", timed(tmp_path / "r.csv"), *common, *chosen]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert words in [line for line in lines if line.startswith("gensig: ")][-1]
    assert not (tmp_path / "mine").exists()
