"""Networks on teeth: the accused tooth of a recording, with healthy recordings of the machine."""

import json

import pytest
from runs import metrics_of, model_of, refuses, says

from diagnose.data.targets import GEARS
from diagnose.recordings.accused import accused_tooth
from diagnose.recordings.registry import open_network
from diagnose.recordings.source import Source

TEETH = {"pinion": 23, "wheel": 84}


@pytest.fixture
def files(recorded, known_machines):
    """A recording, a healthy one of the same machine, and the options on its rotation."""
    dataset = known_machines
    names = [recorded(dataset.signals(k), name=f"{k}.npz") for k in (3, 4)]
    speed, sound_speed = dataset.column("speed_rpm")[[3, 4]]
    words = ["--speed-rpm", f"{speed}", "--healthy-speed-rpm", f"{sound_speed}"]
    return names, [*words, "--as-recorded", "--json"]


def test_scores_with_and_without_a_sound_record_stand_side_by_side(tooth_study):
    methods = metrics_of(tooth_study)["protocols"]["by_unit"]["methods"]
    assert {"tooth", "with_reference"} <= set(methods)
    names = {path.name for path in (tooth_study / "models").iterdir()}
    assert names == {"by_unit-seed0", "by_unit-with_reference-seed0"}
    assert "network with a healthy record" in (tooth_study / "report.html").read_text()


def predicted(capsys, *words):
    """Answer in JSON; the status says if the recording is unlike the training."""
    from diagnose.cli import main

    capsys.readouterr()
    assert main([str(word) for word in words]) in (0, 3)
    return json.loads(capsys.readouterr().out)


def test_an_answer_names_gear_and_tooth(tooth_study, files, capsys):
    (recording, _), words = files
    result = predicted(
        capsys, "predict", "--model", model_of(tooth_study), recording, *words
    )
    assert result["gear"] in GEARS
    if result["tooth"] >= 0:
        assert result["tooth"] < TEETH[result["gear"]]
    assert 0 < result["tooth_share"] <= 1


def test_healthy_recordings_are_for_the_network_that_compares(
    tooth_study, files, capsys
):
    (recording, healthy), words = files
    compares = model_of(tooth_study, "by_unit-with_reference-seed0")
    ask = ["predict", "--model", compares, recording, *words]
    alone = predicted(capsys, *ask, "--healthy", healthy)
    twice = predicted(capsys, *ask, "--healthy", healthy, healthy)
    assert twice["probabilities"] == pytest.approx(alone["probabilities"], abs=1e-6)
    assert 0 < alone["probability"] <= 1
    refuses(capsys, ask, "say --healthy FILE")
    plain = ["predict", "--model", model_of(tooth_study), recording, *words]
    refuses(capsys, [*plain, "--healthy", healthy], "takes no healthy recording")
    refuses(capsys, [*ask, "--healthy", "none.npz"], "none.npz")


def test_a_picture_shows_the_most_suspicious_tooth(
    tooth_study, model, files, tmp_path, capsys
):
    (recording, other), words = files
    picture = tmp_path / "tooth.png"
    ask = ["predict", "--model", model_of(tooth_study), recording, *words]
    predicted(capsys, *ask, "--plot", picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    refuses(capsys, [*ask, "--plot", "tooth.pdf"], "must end in .png")
    refuses(capsys, [*ask, other, "--plot", picture], "one recording")
    of_time = ["predict", "--model", model, recording, "--plot", picture]
    refuses(capsys, of_time, "model=tooth does")


def test_the_accused_tooth_has_the_largest_odds(tooth_study, files):
    (recording, _), words = files
    network = open_network(model_of(tooth_study))
    accused = accused_tooth(network, Source(file=recording, speed_rpm=float(words[1])))
    largest = {gear: values.max() for gear, values in accused.log_odds.items()}
    assert accused.gear == max(largest, key=largest.get)
    assert accused.log_odds[accused.gear].argmax() == accused.tooth
    for gear, teeth in TEETH.items():
        assert accused.log_odds[gear].shape == (teeth,)
    assert accused.turn.shape == (TEETH[accused.gear], 16)


def test_evaluate_repeats_the_score_of_the_network_that_compares(
    tooth_study, known_machines, capsys
):
    from runs import serve

    compares = model_of(tooth_study, "by_unit-with_reference-seed0")
    with pytest.MonkeyPatch.context() as patch:
        serve(patch, {"good": known_machines})
        words = ["evaluate", "data=good", f"--model={compares}"]
        text = says(capsys, *words)
    methods = metrics_of(tooth_study)["protocols"]["by_unit"]["methods"]
    score = methods["with_reference"]["balanced_accuracy"]["mean"]
    assert f"balanced_accuracy {score:.3f}" in text
