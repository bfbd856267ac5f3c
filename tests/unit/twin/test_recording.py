"""Recordings: what is read, and every file that is refused with one line."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.cli import main
from gensig.errors import ConfigError
from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import STANDARD_GRAVITY
from gensig.twin.machine_recording import read_recording
from gensig.twin.speed import find_motion

RATE = 5120.0
SIGNAL = np.random.default_rng(1).standard_normal((2, 20_000))


def csv(path, columns, names):
    np.savetxt(
        path, np.column_stack(columns), "%.9g", ",", header=",".join(names), comments=""
    )
    return str(path)


def timed(path, signal=SIGNAL, names=("a", "b"), rate=RATE):
    return csv(path, [np.arange(signal.shape[1]) / rate, *signal], ["time_s", *names])


class TestRead:
    @pytest.mark.parametrize(
        ("text", "message"),
        [
            (
                "time_s;a\n0,0;0,5\n",
                "separated by ';': save it with commas, decimals with points",
            ),
            ("0.000000;0.228867\n0.1;0.2\n", "separated by ';'"),
            ("time_s\ta\n0\t1\n", "separated by tabs"),
            ("0.000000,0.228867\n0.1,0.2\n", "its first line holds numbers, not names"),
            ("time_s,-1.5e-3\n0.1,0.2\n", "its first line holds numbers, not names"),
        ],
    )
    def test_tables_without_a_header_or_commas_are_refused(
        self, text, message, tmp_path
    ):
        (tmp_path / "r.csv").write_text(text)
        with pytest.raises(ConfigError, match=re.escape(message)):
            read_recording(str(tmp_path / "r.csv"), rate=RATE)

    def test_units(self, tmp_path):
        file = timed(tmp_path / "u.csv", names=("case_g", "lid_m_per_s2"))
        found = read_recording(file)
        assert found.sensors == ("case", "lid")
        assert_allclose(
            found.acceleration.std(axis=1),
            SIGNAL.std(axis=1) * [STANDARD_GRAVITY, 1.0],
            rtol=1e-6,
        )
        plain = timed(tmp_path / "p.csv")
        size = read_recording(plain, unit="g").acceleration.std(axis=1)
        assert_allclose(size, STANDARD_GRAVITY * SIGNAL.std(axis=1), rtol=1e-6)

    def test_channels_in_the_order_asked_for(self, tmp_path):
        found = read_recording(timed(tmp_path / "t.csv"), channels=["b", "a"])
        assert found.sensors == ("b", "a")
        assert_allclose(
            found.acceleration.std(axis=1), SIGNAL[::-1].std(axis=1), rtol=1e-6
        )

    def test_names_become_sensors(self, tmp_path):
        found = read_recording(timed(tmp_path / "t.csv", names=("1 x", "gear case")))
        assert found.sensors == ("s_1_x_a", "gear_case")

    def test_halves(self, tmp_path):
        found = read_recording(timed(tmp_path / "t.csv"))
        first, second = found.part(0.0, 0.5), found.part(0.5, 1.0)
        assert first.acceleration.shape == second.acceleration.shape == (2, 10_000)
        assert_allclose(second.acceleration.mean(axis=1), 0.0, atol=1e-12)


def refused(tmp_path):
    """Text that must be in the line, file and options; more in test_recording_files."""
    np.save(tmp_path / "tall.npy", SIGNAL.T)
    np.save(tmp_path / "short.npy", SIGNAL[:, :100])
    np.save(tmp_path / "still.npy", np.ones((1, 1000)))
    (tmp_path / "garbage.npy").write_bytes(b"no numpy" * 10)
    time = np.arange(20_000) / RATE
    jump = csv(tmp_path / "jump.csv", [time + (time > 1.0), SIGNAL[0]], ["time_s", "a"])
    plain = timed(tmp_path / "plain.csv")
    speed = timed(tmp_path / "speed.csv", names=("a_mm_per_s", "b"))
    alike = timed(tmp_path / "alike.csv", names=("a b", "a-b"))
    rated = {"rate": RATE}
    cases = [
        ("cannot be read", "none.npy", rated),
        (
            "an array tells no rate; give the samples a second with --rate",
            "still.npy",
            {},
        ),
        ("transpose it", "tall.npy", rated),
        ("it is no plain array", "garbage.npy", rated),
        ("too short: 100 samples", "short.npy", rated),
        ("channel_0 holds one value throughout", "still.npy", rated),
    ]
    return [(text, str(tmp_path / name), options) for text, name, options in cases] + [
        ("it has no column time_s; give", csv(tmp_path / "n.csv", SIGNAL, "ab"), {}),
        ("no channel c; it has a, b", plain, {"channels": ["c"]}),
        ("each once", plain, {"channels": ["a", "a"]}),
        ("time_s must rise in even steps", jump, {}),
        ("time_s has 5120 samples a second, --rate says 6000", plain, {"rate": 6000.0}),
        ("--rate 3 must lie in 1000..1000000", plain, {"rate": 3.0}),
        ("--unit mm: allowed: m/s2, g", plain, {"unit": "mm"}),
        ("a_mm_per_s ends in _mm_per_s", speed, {}),
        ("differ in nothing but signs", alike, {}),
    ]


def test_refused(tmp_path):
    for text, file, options in refused(tmp_path):
        with pytest.raises(ConfigError, match=re.escape(text)) as caught:
            read_recording(file, **options)
        assert "\n" not in str(caught.value)


class TestNoMesh:
    TEETH = Teeth(driving=23, driven=46)

    @pytest.mark.parametrize("seed", range(4))
    def test_noise_is_no_gear(self, tmp_path, seed):
        noise = np.random.default_rng(seed).standard_normal((2, 20_000))
        found = read_recording(timed(tmp_path / "n.csv", noise))
        with pytest.raises(ConfigError, match="no sign of the mesh"):
            find_motion(found, self.TEETH, 1200.0)

    def test_too_short_and_too_fast(self, tmp_path):
        found = read_recording(timed(tmp_path / "n.csv"))
        with pytest.raises(ConfigError, match=r"turns of the slower gear, at least 8"):
            find_motion(found, self.TEETH, 100.0)
        with pytest.raises(ConfigError, match="above the usable band"):
            find_motion(found, self.TEETH, 6000.0)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--speed", "0"], "--speed 0 must be positive"),
        (["--module", "-1"], "--module -1 must be positive"),
        (["--torque", "nan"], "--torque nan must be positive"),
        (["--teeth", "5", "46"], "pinion: 5 teeth"),
        (["seed=3"], "twin takes overrides of the gears only"),
        (["gear.pinion.n_teeth=20"], "is what --teeth says"),
        (["gear.pinion.bore_radius_mm=99"], "bore_radius_mm = 99 must lie between"),
        (["gear.pinion.bore=3"], "gear.pinion.bore"),
        (["--check", "OTHER"], "--check"),
        (["--check", "FASTER"], "samples a second, the recording"),
        ([], "no sign of the mesh"),
        (["--out", "USED"], "is there and not an empty folder"),
        (["--out", "a b"], "use letters, digits"),
    ],
)
def test_the_command_refuses_in_one_line(tmp_path, monkeypatch, capsys, words, text):
    monkeypatch.chdir(tmp_path)
    files = {
        "OTHER": timed(tmp_path / "other.csv", names=("a", "c")),
        "FASTER": timed(tmp_path / "faster.csv", rate=2.0 * RATE),
        "USED": "used",
    }
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "file").write_text("x")
    common = ("--teeth", "23", "46", "--speed", "1200", "--out", "mine")
    chosen = [files.get(word, word) for word in words]
    assert main(["twin", timed(tmp_path / "r.csv"), *common, *chosen]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert text in [line for line in lines if line.startswith("gensig: ")][-1]
    assert not (tmp_path / "mine").exists()
