"""The public recordings of $GENSIG_MEASURED, through a YAML; skipped where there are none."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from gensig.measured import load, read_signal

ROOT = Path(__file__).resolve().parents[3]
YAML = """
name: public
unit: m/s2
files:
- {pattern: "healthy_*.npz", label: healthy, machine: rig, stages: [[23, 46]],
   speed_rpm: 2000, sampling_rate_hz: 25600}
- {pattern: "negative_control_*.npz", array: healthy__load50, label: healthy, machine: control,
   stages: [[32, 80], [48, 64]], speed_rpm: 1800, sampling_rate_hz: 12800, load: 50 %}
- {pattern: "negative_control_*.npz", array: broken_tooth__load50, label: one_tooth,
   machine: control, stages: [[32, 80], [48, 64]], speed_rpm: 1800, sampling_rate_hz: 12800}
"""


@pytest.fixture
def folder(tmp_path):
    given = Path(os.environ.get("GENSIG_MEASURED", ROOT.parent / "shared" / "measured"))
    files = sorted(given.glob("*.npz"))
    if len(files) < 2:
        pytest.skip("no measured recordings here")
    for file in files:
        shutil.copy(file, tmp_path)
    (tmp_path / "measured.yaml").write_text(YAML)
    return tmp_path


def test_they_are_found_and_read(folder) -> None:
    found = load(None, folder)
    assert found.machines() == ("rig", "control")
    assert found.missing == {}
    for one in found.recordings:
        signal = read_signal(one)
        assert signal.acceleration.shape[0] == 4
        assert np.isfinite(signal.acceleration).all()


def test_the_mesh_is_where_teeth_and_speed_say(folder) -> None:
    """23 teeth at 2000 r/min: the strongest line of 700 to 830 Hz is within 1 % of 766.7 Hz."""
    rig = load(None, folder).of_machine("rig")[0]
    signal = read_signal(rig)
    mesh = rig.train.mesh_orders()[0] * rig.shaft_frequency
    power = (np.abs(np.fft.rfft(signal.acceleration, axis=1)) ** 2).sum(axis=0)
    frequency = np.fft.rfftfreq(signal.acceleration.shape[1], 1 / signal.sampling_rate)
    near = (frequency > 700) & (frequency < 830)
    assert frequency[near][np.argmax(power[near])] == pytest.approx(mesh, rel=0.01)
