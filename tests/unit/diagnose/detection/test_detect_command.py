"""``diagnose detect`` from files: answers, exit statuses, one line for a mistake."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from fake_gearbox import SPEED, Box, Fault

from diagnose.cli import main
from diagnose.detection.gear_stages import stages_of
from diagnose.detection.healthy_machine import HealthyMachine
from gensig.signals.recording import Recording

OPTIONS = ("--teeth", "32", "80", "48", "64", "--speed-rpm", "1746")
RATE = ("--sampling-rate", "5000")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Healthy recordings a, b, c, a healthy one and a faulty one."""
    folder = tmp_path_factory.mktemp("recordings")
    faulty = Box().record(20, fault=Fault(shaft=1, n_teeth=48, tooth=7))
    for name, recording in (
        *((name, Box().record(session)) for session, name in enumerate("abc")),
        ("healthy", Box().record(10)),
        ("faulty", faulty),
        ("short", Box().record(11, seconds=0.4)),
    ):
        np.save(folder / f"{name}.npy", recording.acceleration[0])
    return folder


def detect(folder, *words, healthy=("a", "b", "c"), options=OPTIONS, rate=RATE):
    recordings = [str(folder / f"{name}.npy") for name in words]
    sound = [str(folder / f"{name}.npy") for name in healthy]
    return main(["detect", *recordings, "--healthy", *sound, *options, *rate])


def test_answers_in_words_and_exit_status(folder, capsys):
    assert detect(folder, "healthy", "faulty") == 3
    printed = capsys.readouterr().out
    assert "healthy.npy: healthy, score 0." in printed
    assert "faulty.npy: CHANGED, score" in printed
    assert "where: intermediate shaft, tooth" in printed
    assert "of the driving gear of stage 2" in printed
    assert printed.count("handbook rule: ") == 2
    assert "3 held-back healthy recordings promise" in printed
    assert all(len(line) < 400 for line in printed.splitlines())


def test_json_of_a_healthy_recording(folder, capsys):
    assert detect(folder, "healthy", options=(*OPTIONS, "--json")) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["kind"] == "healthy"
    assert content["where"] is None
    assert content["handbook"]["state"] == "healthy"
    assert content["speed_rpm"] == pytest.approx(SPEED, rel=1e-3)
    assert 0.0 < content["score"] < 1.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            {"options": ("--teeth", "32", "80", "48", "--speed-rpm", "1746")},
            "3 number(s)",
        ),
        ({"options": OPTIONS[:5]}, "give --speed-rpm, or --tacho"),
        (
            {"options": (*OPTIONS[:5], "--speed-rpm", "1300")},
            "another machine or speed?",
        ),
        ({"options": (*OPTIONS, "--false-alarms", "2")}, "between 0 and 0.5"),
        ({"rate": ("--sampling-rate", "4000")}, "at least 5000 are needed"),
        ({"healthy": ("short", "a")}, "turns of the slowest shaft"),
        ({"healthy": ("missing",)}, "cannot be read"),
        ({"options": (*OPTIONS, "--tacho", "pulses")}, "no channel pulses"),
        ({"options": (*OPTIONS, "--channels", "left")}, "no channel left"),
    ],
)
def test_a_mistake_is_one_line(folder, capsys, words, said):
    assert detect(folder, "healthy", **words) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def measured(name):
    """Arrays of a measured file; skips where the folder is not given."""
    folder = os.environ.get("GENSIG_MEASURED")
    if not folder or not (Path(folder) / name).exists():
        pytest.skip("GENSIG_MEASURED names no such folder")
    with np.load(Path(folder) / name) as arrays:
        return {key: arrays[key] for key in arrays.files}


def judged(healthy, own, rate, teeth, speed_rpm):
    sensors = tuple(f"sensor_{index}" for index in range(len(healthy)))
    healthy, own = (
        Recording(
            sensors=sensors,
            acceleration=rows - rows.mean(axis=1, keepdims=True),
            sampling_rate=rate,
        )
        for rows in (np.asarray(healthy, float), np.asarray(own, float))
    )
    machine = HealthyMachine.fit([healthy], stages_of(teeth), speed_rpm)
    return machine.judge(own, speed_rpm)


@pytest.mark.parametrize("channel", [0, 3])
def test_halves_of_a_measured_healthy_recording_are_alike(channel):
    rows = measured("healthy_23_46_2000rpm.npz")["acceleration"][channel : channel + 1]
    half = rows.shape[1] // 2
    finding = judged(rows[:, :half], rows[:, half:], 25600.0, (23, 46), 2000.0)
    assert not finding.is_changed


@pytest.mark.parametrize(("channels", "is_changed"), [([0, 1, 2], True), ([3], False)])
def test_measured_negative_control_is_a_mounting(channels, is_changed):
    content = measured("negative_control_32_80_48_64.npz")
    healthy = content["healthy__load50"][channels]
    other = content["broken_tooth__load50"][channels]
    finding = judged(healthy, other, 12800.0, (32, 80, 48, 64), 1800.0)
    assert finding.is_changed == is_changed
    assert finding.is_level_alone == is_changed
