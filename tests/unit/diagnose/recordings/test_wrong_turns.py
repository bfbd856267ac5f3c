"""Recordings whose turns are not where speed and teeth put them get a line and no class."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from runs import model_of, refuses, says

from diagnose.recordings.followed import tracked_if_long
from diagnose.recordings.source import Source, tacho_apart
from gensig.signals.recording import Recording, RecordingFile

RATE = 12800
TEETH = (23, 84)
SPEED_RPM = 1500.0
MESH_HZ = SPEED_RPM / 60 * TEETH[0]


def gearing(duration=1.5, mesh=MESH_HZ, swing=0.0, n_channels=2):
    """Harmonics of a mesh whose frequency may swing by a share, in noise."""
    rng = np.random.default_rng(0)
    time = np.arange(round(duration * RATE)) / RATE
    cycles = mesh * (time - swing * np.cos(np.pi * time))
    harmonics = range(1, 7)
    tones = sum(np.sin(2 * np.pi * k * cycles + k) / k for k in harmonics)
    noise = 0.3 * rng.standard_normal((n_channels, time.size))
    return tones + noise


@pytest.fixture
def ask(tooth_study, recorded):
    """Function that returns the words of a prediction for a signal."""

    def words(signal, *more, name="by_unit-seed0"):
        model = model_of(tooth_study, name)
        return ["predict", "--model", model, recorded(signal), *more]

    return words


SPEED = ("--speed-rpm", SPEED_RPM)


@pytest.mark.parametrize("more", [(), ("--teeth", *TEETH)])
def test_right_speed_and_teeth_get_a_class(ask, more, capsys):
    assert "OUT OF" in says(capsys, *ask(gearing(6.0), *SPEED, *more), status=3)


WRONG = [
    (("--teeth", 26, 84, *SPEED), "--teeth 26 84 at 1500 r/min", "650 Hz", "23 teeth"),
    (("--teeth", 22, 84, *SPEED), "--teeth 22 84 at 1500 r/min", "550 Hz", "23 teeth"),
    (
        ("--teeth", *TEETH, "--speed-rpm", 1800),
        "23 84 at 1800 r/min puts the mesh at 690 Hz",
        "as of 19.2 teeth or 1500 r/min",
    ),
    (("--speed-rpm", 1800), "23 teeth, those of the training", "or 1500 r/min"),
    (("--speed-rpm", 3000), "at 1150 Hz", "or 1500 r/min"),
]


@pytest.mark.parametrize(("words", "messages"), [(row[0], row[1:]) for row in WRONG])
def test_wrong_teeth_or_speed_are_told_where_the_mesh_is(ask, words, messages, capsys):
    place = ("but the recording has one at 57", "check --teeth and --speed-rpm")
    refuses(capsys, ask(gearing(6.0), *words), *messages, *place)


def test_a_speed_that_nothing_tells_must_be_given(ask, capsys):
    message = "give --speed-rpm and --teeth 23 84, or --tacho CHANNEL"
    refuses(capsys, ask(gearing()), message)
    refuses(capsys, ask(gearing(), "--teeth", *TEETH), message)


def test_the_channel_of_a_tacho_is_none_of_the_sensors():
    names, values = ("x", "pulses", "y"), np.arange(12.0).reshape(3, 4)
    content = RecordingFile(
        file="day.npz",
        channels=names,
        named=True,
        values=values,
        sampling_rate=1.0,
        has_level=True,
    )
    for index, name in enumerate(names):
        others = [other for other in range(3) if other != index]
        left, tacho = tacho_apart(content, name)
        assert left.channels == tuple(names[other] for other in others)
        assert (left.values == values[others]).all()
        assert (tacho == values[index]).all()
    alone = replace(content, channels=("pulses",), values=values[:1])
    with refused("no channel beside pulses"):
        tacho_apart(alone, "pulses")
    with refused("no channel tacho; it has x, pulses, y"):
        tacho_apart(content, "tacho")


@pytest.mark.parametrize("speed_rpm", [None, 1490.0, 1510.0, 1400.0, 1600.0])
def test_a_stated_speed_must_be_that_of_the_tacho(speed_rpm):
    time = np.arange(2 * RATE) / RATE
    pulses = (np.mod(SPEED_RPM / 60 * time, 1.0) < 0.1).astype(float)
    recording = Recording(
        sensors=("x",), acceleration=gearing(2.0, n_channels=1), sampling_rate=RATE
    )
    source = Source(file="a", tacho="pulses", pulses_per_turn=1, speed_rpm=speed_rpm)
    if speed_rpm in (1400.0, 1600.0):
        with refused(f"gives 1500 r/min, --speed-rpm says {speed_rpm:g}"):
            tracked_if_long(recording, pulses, source, inputs=None)
    else:
        tracked = tracked_if_long(recording, pulses, source, inputs=None)
        assert tracked.speed_rpm == pytest.approx(SPEED_RPM, rel=1e-4)


def test_a_recording_without_a_mesh_is_refused(ask, capsys):
    noise = np.random.default_rng(1).standard_normal((2, 6 * RATE))
    refuses(capsys, ask(noise, *SPEED), "no sign of the mesh near 575 Hz")
    followed = ask(noise, *SPEED, "--teeth", *TEETH)
    refuses(capsys, followed, "sign of the mesh")


def test_a_speed_that_is_not_exact_must_be_followed(ask, capsys):
    near = (SPEED[0], 1.01 * SPEED_RPM)
    message = (
        "give --teeth 23 84 without --as-recorded, to follow the speed, or say 1499.9"
    )
    refuses(capsys, ask(gearing(6.0), *near), "drift by 34", message)
    says(capsys, *ask(gearing(6.0), *near, "--teeth", *TEETH), status=3)


def test_every_tooth_must_pass(ask, capsys):
    words = ask(gearing(0.1), *SPEED)
    refuses(capsys, words, "2.5 turns of the driving and 0.68", "record 0.146 s")


def test_a_speed_that_cannot_be_followed_counts_as_steady(ask, capsys):
    """Two turns of the slower gear are enough for teeth, not for a wandering speed."""
    short = ask(gearing(0.3), *SPEED, "--teeth", *TEETH)
    assert "speed by mesh" not in says(capsys, *short, status=3)
    wrong = ask(gearing(0.3), "--speed-rpm", "1540", "--teeth", *TEETH)
    refuses(capsys, wrong, "drift by", "say 15")


def test_other_channels_are_named(ask, capsys):
    one = ask(gearing(n_channels=1), *SPEED)
    refuses(capsys, one, "has 1 channel(s)", "the model takes 2")
    words = ask(gearing(n_channels=3), *SPEED, "--channels", "channel_0")
    refuses(capsys, words, "--channels names 1 channel(s)", "the model takes 2")


@pytest.fixture
def compared(ask, recorded):
    """Function that returns the words for a recording and a healthy one."""

    def words(sound, *more):
        healthy = recorded(sound, name="sound.npz")
        name = "by_unit-with_reference-seed0"
        asked = ask(gearing(6.0), *SPEED, "--healthy", healthy, name=name)
        return [*asked, *more]

    return words


def test_a_healthy_recording_of_another_machine_is_refused(compared, capsys):
    says(capsys, *compared(gearing(6.0)), status=3)
    loud = "0.1 times the level of --healthy"
    refuses(capsys, compared(10 * gearing(6.0)), loud, "machine, sensors and --unit")
    other = gearing(6.0, mesh=1.3 * MESH_HZ)
    place = ("sound.npz: 23 teeth", "has one at 747.5", "--healthy-speed-rpm")
    refuses(capsys, compared(other), *place)
    refuses(capsys, compared(other, "--healthy-speed-rpm", 1200), "1950 r/min")
    says(capsys, *compared(other, "--healthy-speed-rpm", 1950), status=3)
