"""A machine that is known is measured, fitted, and found again; faults are made for its twin."""

import re

import numpy as np
import pytest
import yaml
from machines import GRADE, RATE, SPEED, TEETH, drifting, measured

from gensig.cli import main
from gensig.dataset.reader import open_dataset
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_records
from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import Recording
from gensig.signals.transfer.path_gain import gain_at, minimum_phase
from gensig.twin import check
from gensig.twin.speed import find_motion
from gensig.twin.writing import DEFAULT_OVERSAMPLING

BOTH = Teeth(driving=TEETH[0], driven=TEETH[1])
WRONG_START = 1.012 * SPEED


def test_what_a_twin_leaves_out_of_its_options_is_the_default():
    solver = read_request([]).config["solver"]
    assert solver["oversampling"] == DEFAULT_OVERSAMPLING


@pytest.fixture(scope="module")
def known():
    return measured()


@pytest.fixture(scope="module")
def twin(known, tmp_path_factory):
    """Folder of the twin, and what the command printed."""
    folder = tmp_path_factory.mktemp("twin")
    file = str(folder / "healthy.npz")
    np.savez(file, acceleration=known.signal)
    teeth = ("--teeth", *map(str, TEETH))
    rates = ("--speed", f"{WRONG_START:g}", "--rate", f"{RATE:g}")
    compared = []

    def noted(*given):
        compared.extend(given[-1])
        return simulate_records(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(check, "simulate_records", noted)
        assert main(["twin", file, *teeth, *rates, "--out", str(folder / "mine")]) == 0
    assert len({row["unit_id"] for row in compared}) == check.N_RECORDS
    return folder / "mine"


@pytest.fixture(scope="module")
def config(twin):
    return read_request(["experiment=mine"], config_dir=twin).config


def recording(known):
    centred = known.signal - known.signal.mean(axis=1, keepdims=True)
    return Recording(sensors=("case", "lid"), acceleration=centred, sampling_rate=RATE)


def test_speed_to_a_hundredth_of_a_percent(known, config):
    assert config["operating"]["speed_rpm"] == pytest.approx(known.speed_rpm, rel=1e-4)


def test_grade(config):
    assert abs(config["quality"]["iso1328_grade"] - GRADE) < 1.5


def test_signal_to_noise_ratio(known, config):
    offsets = np.array(config["sensing"]["noise"]["offsets_db"])
    np.testing.assert_allclose(
        config["sensing"]["snr_db"] - offsets, known.snr_db, atol=2.0
    )


def test_no_drift_is_made_up(config):
    assert config["operating"]["speed_profile"] is None


def test_held_out_levels(twin):
    report = (twin / "report.md").read_text()
    lines = [line for line in report.splitlines() if line.startswith("| ch")]
    assert [line.split()[1] for line in lines] == ["channel_0", "channel_1"]
    for line in lines:
        share, difference = re.findall(r"([\d.]+) (?:%|dB)", line)[:2]
        assert float(share) > 50.0
        assert float(difference) < 3.0  # median of third-octave levels
    assert (twin / "report.png").read_bytes().startswith(b"\x89PNG")
    assert "cannot tell" in report
    assert str(twin.name) in report


def test_assumed_values_are_called_so(twin):
    text = (twin / "gear" / "mine.yaml").read_text()
    assert "normal_module_mm: 2.0   # assumed" in text
    gear = yaml.safe_load(text)
    assert [gear[side]["n_teeth"] for side in ("pinion", "wheel")] == list(TEETH)
    values = re.findall(r"^(?!#|name).*: .*$", text, flags=re.MULTILINE)
    assert values
    assert all("   # " in value for value in values)


def test_nothing_measured_is_copied(known, twin):
    """Path and noise are smooth tables: a few numbers, not samples."""
    for name in ("path.csv", "noise.csv"):
        table = np.loadtxt(twin / name, delimiter=",", skiprows=1)
        assert table.size < 0.05 * known.signal.size


def test_faults_are_generated_for_it(twin, tmp_path):
    out = tmp_path / "set"
    plan = ("plan.n_records=4", "plan.n_units=1", "operating.duration_s=0.2")
    source = ("--config-dir", str(twin), "experiment=mine", "executor.n_workers=1")
    assert main(["generate", "--quiet", *source, *plan, f"out={out}"]) == 0
    data = open_dataset(out)
    names = [str(name) for name in data.column("label_name")]
    assert sorted(names) == ["crack", "healthy", "missing_tooth", "pitting"]
    signals = {name: data.signals(place) for place, name in enumerate(names)}
    assert all(np.all(np.isfinite(signal)) for signal in signals.values())
    assert np.std(signals["missing_tooth"]) > 1.2 * np.std(signals["healthy"])


class TestMotion:
    @pytest.mark.parametrize("start", [0.975, 1.0, 1.025])
    def test_wherever_the_search_begins(self, known, start):
        motion = find_motion(recording(known), BOTH, start * SPEED)
        assert motion.mesh_frequency / TEETH[0] * 60.0 == pytest.approx(
            known.speed_rpm, rel=1e-4
        )

    def test_drift(self):
        profile = drifting(2e-3, 0.25, 3.0, seed=4)
        moving = measured(profile=profile)
        motion = find_motion(recording(moving), BOTH, WRONG_START)
        true = np.std([factor for time, factor in profile if time < 2.4])
        speed_rpm = motion.mesh_frequency / TEETH[0] * 60.0
        assert speed_rpm == pytest.approx(moving.speed_rpm, rel=1e-4)
        assert motion.scatter == pytest.approx(true, rel=0.3)
        assert 0.05 < motion.correlation_time < 0.6
        angle = moving.shaft_angle - moving.shaft_angle[0]
        cycles = angle * TEETH[0] / (2.0 * np.pi)  # 2200
        assert np.ptp(motion.cycles - cycles) < 0.1


def test_minimum_phase_of_a_filter_is_the_filter():
    """Two poles and two zeros inside the unit circle are of minimum phase: their size alone gives
    them back."""
    from scipy.signal import freqz, zpk2tf

    zeros, poles = 0.9 * np.exp([1.2j, -1.2j]), 0.95 * np.exp([0.5j, -0.5j])
    filters = zpk2tf(zeros, poles, 1.0)
    known_at = np.linspace(1.0, 12_800.0, 12_800)
    gain = np.abs(freqz(*filters, known_at, fs=RATE)[1])
    frequency, response = minimum_phase(known_at, gain, RATE, 20.0)
    expected = freqz(*filters, frequency, fs=RATE, include_nyquist=True)[1]
    assert frequency[1] == pytest.approx(20.0)
    np.testing.assert_allclose(response, expected, atol=1e-3 * np.abs(expected).max())
    np.testing.assert_allclose(
        np.abs(response), gain_at(frequency, known_at, gain), rtol=1e-6
    )
