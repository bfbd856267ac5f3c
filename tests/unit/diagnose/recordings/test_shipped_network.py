"""The network that comes with gensig: small, described, and it answers without any training."""

import json

import numpy as np
import pytest
from runs import refuses, says

import gensig
from diagnose.recordings.registry import open_network, shipped_network

SMALL = (
    "experiment=many_machines",
    "plan.n_records=24",
    "plan.n_units=6",
    "plan.classes=[healthy,missing_tooth]",
    "plan.vary={quality.iso1328_grade: {distribution: integers, low: 3, high: 4}}",
    "operating.duration_s=0.8",
    "seed=77",
)


@pytest.fixture(scope="module")
def stream():
    return gensig.stream(*SMALL)


def test_it_is_small_and_has_a_card():
    folder = shipped_network()
    assert sum(file.stat().st_size for file in folder.iterdir()) < 4e6
    card = (folder / "README.md").read_text()
    assert "python -m benchmarks.general_model" in card
    assert "No recording of a real machine" in " ".join(card.split())
    description = open_network(folder).description
    assert description.takes_each_channel
    assert description.test_score["n_units"] >= 50


def test_it_names_missing_teeth_of_machines_it_never_saw(stream, recorded, capsys):
    answers = []
    for number in range(len(stream)):
        (record,) = stream.take([number])
        teeth = [int(stream.n_teeth(gear)[number]) for gear in ("pinion", "wheel")]
        file = recorded(record.signals["acceleration"], stream.sampling_rate)
        words = ["predict", file, "--teeth", *teeth, "--json"]
        speed = record.values["speed_rpm"]
        answer = answer_of([*words, "--speed-rpm", speed], capsys)
        answers.append(max(answer["probabilities"], key=answer["probabilities"].get))
    label = np.asarray(stream.column("label_name"))
    is_missing = np.array(answers) == "missing_tooth"
    assert is_missing[label == "missing_tooth"].mean() > 0.7
    assert is_missing[label == "healthy"].mean() < 0.2


def answer_of(words, capsys):
    """Answer of a prediction, whether the recording is like the training or not."""
    from diagnose.cli import main

    assert main([str(word) for word in words]) in (0, 3)
    return json.loads(capsys.readouterr().out)


def test_it_needs_teeth_and_speed(recorded, capsys):
    file = recorded(np.random.default_rng(0).standard_normal((1, 40_000)), 51200)
    refuses(capsys, ["predict", file, "--speed-rpm", "1500"], "--teeth")
    refuses(capsys, ["predict", file, "--teeth", "23", "46"], "--speed-rpm")


def test_evaluate_takes_it_where_no_model_is_given(stream, tmp_path, capsys):
    out = tmp_path / "set"
    counts = ("plan.n_records=8", "plan.n_units=2", "operating.duration_s=0.8")
    gensig.generate("experiment=many_machines", *counts, "seed=78", out=out)
    shown = says(capsys, "evaluate", f"data={out}")
    assert "8 records of 2 machine(s): all records" in shown
