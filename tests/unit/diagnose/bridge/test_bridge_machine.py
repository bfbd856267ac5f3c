"""A machine of a measured set for the bridge: what is used, what is left out, what is refused."""

import hashlib
import json
import shlex
from dataclasses import asdict, replace

import numpy as np
import pytest
from made_rig import YAML, write_rig

from diagnose.bridge.bridge_machine import NO_LABEL, VARYING, bridge_machine
from diagnose.bridge.implanted_windows import wrong_teeth
from diagnose.bridge.protocol import FROZEN, BridgeProtocol
from diagnose.cli import main
from diagnose.commands.bridge import source_lines
from gensig.cli import main as gensig_main
from gensig.errors import ConfigError
from gensig.measured import load
from gensig.measured.measured_set import GearTrain
from gensig.plan.request import read_request


def test_healthy_and_faulty_are_told_apart(tmp_path) -> None:
    machine = bridge_machine(load(None, write_rig(tmp_path)), FROZEN)
    assert len(machine.healthy) == 2
    assert len(machine.faulty) == 4
    assert machine.teeth == (20, 40)
    assert machine.labels == ("healthy", "one_tooth", "many_teeth")
    assert machine.slowest_turn() == pytest.approx(2.0 / 25.0)


def test_a_high_rate_is_lowered_and_a_long_recording_cut(tmp_path) -> None:
    protocol = replace(FROZEN, highest_rate=3000.0, most_seconds=4.0)
    machine = bridge_machine(load(None, write_rig(tmp_path)), protocol)
    signal = machine.healthy[0].signal
    assert signal.sampling_rate == 3000.0
    assert signal.acceleration.shape == (1, 12_000)
    spectrum = np.abs(np.fft.rfft(signal.acceleration[0] * np.hanning(12_000)))
    frequency = np.fft.rfftfreq(12_000, 1.0 / 3000.0)
    near = (frequency > 480) & (frequency < 520)
    assert frequency[near][spectrum[near].argmax()] == pytest.approx(500.0, rel=0.005)


def test_recordings_that_are_not_used_are_counted(tmp_path) -> None:
    write_rig(tmp_path)
    text = YAML.replace("many_teeth: many_teeth", "many_teeth: null")
    (tmp_path / "measured.yaml").write_text(text)
    machine = bridge_machine(load(None, tmp_path), FROZEN)
    assert machine.left_out == {NO_LABEL: 2}
    text = YAML.replace(", many_teeth: many_teeth", "")
    entry = "- {pattern: many*, label: many_teeth, speed_varies: true}"
    (tmp_path / "measured.yaml").write_text(f"{text}{entry}\n")
    machine = bridge_machine(load(None, tmp_path), FROZEN)
    assert machine.left_out == {VARYING: 2}


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "sampling_rate_hz: 6000\n",
            "",
            r"sampling_rate_hz must be given in measured\.yaml",
        ),
        ("speed_rpm: 1500\n", "", r"speed_rpm must be given"),
        ("stages: [[20, 40]]\n", "", r"stages must be given"),
        (
            "healthy: healthy",
            "healthy: null",
            r"needs healthy and faulty .* 2 one_tooth",
        ),
        (
            ": one_tooth, many_teeth: many_teeth",
            ": null, many_teeth: null",
            r"has 2 healthy",
        ),
    ],
)
def test_what_is_missing_is_one_line(old, new, says, tmp_path, capsys) -> None:
    write_rig(tmp_path)
    assert old in YAML
    (tmp_path / "measured.yaml").write_text(YAML.replace(old, new))
    with pytest.raises(ConfigError, match=says):
        bridge_machine(load(None, tmp_path), FROZEN)
    assert main(["bridge", "--on", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_without_data_the_command_says_how_to_make_them(tmp_path, capsys) -> None:
    write_rig(tmp_path)
    assert main(["bridge", "--on", str(tmp_path / "measured.yaml")]) == 0
    text = capsys.readouterr().out
    assert "gensig new gearbox measured_machine --teeth 20 40 " in text
    assert "dataset.store_healthy_twin=true" in text


@pytest.mark.parametrize("teeth", ["[20, 40]", "[32, 80], [48, 64]"])
def test_the_commands_that_make_them_work(teeth, tmp_path, monkeypatch) -> None:
    write_rig(tmp_path, n_repeats=1)
    yaml = tmp_path / "measured.yaml"
    yaml.write_text(yaml.read_text().replace("[20, 40]", teeth))
    machine = bridge_machine(load(None, yaml), FROZEN)
    new, generate = (shlex.split(line)[1:] for line in source_lines(machine))
    monkeypatch.chdir(tmp_path)
    assert gensig_main(new) == 0
    assert generate[0] == "generate"
    assert gensig_main(["plan", *generate[1:]]) == 0
    config = read_request(generate[1:]).config
    assert config["dataset"]["store_healthy_twin"]
    assert config["sensing"]["snr_db"] is None


@pytest.mark.parametrize(
    "words",
    [
        ["--on", "seu"],
        ["--on", "seu", "nothere"],
        ["--on", "a", "b", "c"],
        ["--on", ".", "--machine", "other"],
        ["--on", ".", "--data", "nothere", "--out", "out"],
        ["--on", ".", "--data", "nothere"],
    ],
)
def test_words_that_are_wrong_end_with_status_2(
    words, tmp_path, capsys, monkeypatch
) -> None:
    write_rig(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(["bridge", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_the_frozen_protocol_is_version_2() -> None:
    """Whoever changes a number gives the next version."""
    assert BridgeProtocol(version=2) == FROZEN
    rows = dict(FROZEN.rows())
    assert rows["version"] == "2"
    assert len(rows) == len(FROZEN.rows())


@pytest.mark.parametrize("teeth", [(20, 40), (32, 80, 48, 64)])
def test_the_wrong_gearbox_keeps_the_first_mesh_and_no_shaft(teeth) -> None:
    wrong, scale = wrong_teeth(teeth, FROZEN.wrong_teeth)
    assert wrong[0] * scale == pytest.approx(teeth[0])

    def train(numbers: tuple[int, ...]) -> GearTrain:
        return GearTrain(stages=tuple(zip(numbers[::2], numbers[1::2], strict=True)))

    for shaft in range(1, len(teeth) // 2 + 2):
        ratio = (
            scale * train(wrong).shaft_ratio(shaft) / train(teeth).shaft_ratio(shaft)
        )
        assert 1.2 < ratio < 1.6


def test_the_frozen_numbers_are_those_of_their_version():
    """A number of the protocol that changes needs a new version, and new digits here."""
    numbers = json.dumps(asdict(FROZEN), sort_keys=True).encode()
    frozen = FROZEN.version, hashlib.sha256(numbers).hexdigest()[:16]
    assert frozen == (2, "ee7aa2f9380b5439")
