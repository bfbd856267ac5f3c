"""Networks of remaining lives on disk: evaluate, predict and export agree with the report."""

import json
import os
import re
from dataclasses import replace

import numpy as np
import pytest
from fake_dataset import FakeDataset
from fake_lives import FakeLives
from numpy.testing import assert_allclose
from refusals import refused
from runs import metrics_of, model_of, refuses, rows_of, says, serve

from benchmarks._damaged_models import forge
from diagnose.scoring.hours import LifeFacts
from diagnose.scoring.life_scores import MEASURES
from diagnose.training.remaining_life import load_life_model
from diagnose.training.store import load_model
from gensig.errors import DatasetError

METHODS = ("cnn", "cnn_and_age")


@pytest.fixture(scope="module")
def models(life_study):
    """Method -> folder of its network."""
    return {name: model_of(life_study, f"by_unit-{name}-seed0") for name in METHODS}


def description_of(folder):
    with open(f"{folder}/model.json", encoding="utf-8") as file:
        return json.load(file)


def conditions(dataset, record, method):
    """Options on speed, torque and age of a record, as far as a network takes them."""
    words = []
    for name in ("speed_rpm", "torque_nm", "life_time_h")[: 2 + method.endswith("age")]:
        option = name.replace("_", "-")
        words += [f"--{option}", str(dataset.columns[name][record])]
    return words


def test_every_network_is_stored_without_pickle(life_study, models):
    folders = sorted((life_study / "models").iterdir())
    assert [str(folder) for folder in folders] == [*models.values()]
    for folder in folders:
        names = {path.name for path in folder.iterdir()}
        assert names == {"model.json", "model.safetensors"}

    facts = load_life_model(folders[1])[2]
    assert facts.told == ("speed_rpm", "torque_nm", "life_time_h")
    assert facts.told_range["torque_nm"] == (20.0, 20.0)


def test_files_of_a_study_have_the_mode_of_the_umask(life_study):
    """Models too, which are not written by Python's ``open``."""
    umask = os.umask(0)
    os.umask(umask)
    files = [path for path in life_study.rglob("*") if path.is_file()]
    assert len(files) > 5
    assert {path.stat().st_mode & 0o777 for path in files} == {0o666 & ~umask}


@pytest.fixture(scope="module")
def rows(life_study):
    """Rows of the report's predictions by method."""
    stored = rows_of(life_study / "predictions.csv")
    return {name: [row for row in stored if row["method"] == name] for name in METHODS}


@pytest.mark.parametrize("method", METHODS)
def test_evaluate_on_its_test_part_repeats_the_report(
    method, life_study, rows, models, lives, monkeypatch, capsys, tmp_path
):
    serve(monkeypatch, {"lives": lives})
    out = tmp_path / "judged"
    words = ["data=lives", f"--model={models[method]}", f"out={out}"]
    printed = says(capsys, "evaluate", *words)
    result = metrics_of(out)
    reported = metrics_of(life_study)["protocols"]["by_unit"]
    expected = reported["methods"][method]

    for measure in MEASURES:
        assert measure in printed
        for key in ("mean", "low", "high"):
            value = pytest.approx(expected[measure][key], rel=1e-5, abs=1e-9)
            assert result[measure][key] == value, measure
    assert printed.count("95 % interval over lives") == len(MEASURES)
    assert result["n_lives"] == reported["n_lives"]["test"]
    assert f"{result['n_lives']} lives that failed" in printed

    repeated = rows_of(out / "predictions.csv")
    for before, after in zip(rows[method], repeated, strict=True):
        assert after["record_id"] == before["record_id"]
        for end in ("predicted_h", "low_h", "high_h"):
            assert_allclose(float(after[end]), float(before[end]), 1e-4, 1e-4)
    assert (out / "remaining_life.png").is_file()


@pytest.mark.parametrize("method", METHODS)
def test_predict_says_of_a_file_what_the_report_says_of_its_record(
    method, rows, models, lives, recorded, capsys
):
    row = rows[method][11]
    record = int(row["record_id"][1:])
    file = recorded(lives.signals(record))
    words = ["predict", "--model", models[method], file]
    words += conditions(lives, record, method)
    result = json.loads(says(capsys, *words, "--json"))

    for key in ("remaining_life_h", "low_h", "high_h"):
        expected = float(row[key.replace("remaining_life", "predicted")])
        assert_allclose(result[key], expected, rtol=1e-4, atol=1e-3)

    mean = np.mean([window["remaining_life_h"] for window in result["windows"]])
    assert result["low_h"] <= mean <= result["early_life_h"]

    line = says(capsys, *words).strip()
    assert re.fullmatch(
        r".*mine\.npz: .* h (left|or longer), 80% interval .* to .* h.*",
        line,
    )


def test_a_load_or_an_age_that_was_never_trained_raises_the_flag(
    models, lives, recorded, capsys
):
    file = recorded(lives.signals(0))
    words = ["predict", "--model", models["cnn_and_age"], file, "--speed-rpm", "1800"]
    words.append("--torque-nm")
    line = says(capsys, *words, "80", "--life-time-h", "9000", status=3)

    assert "80 N m is outside the 20 to 20 N m of the training" in line
    assert "9000 h is outside" in line

    says(capsys, *words, "20", "--life-time-h", "10")


REFUSED = [
    ("--speed-rpm 1800 --torque-nm 20", "must know life_time_h of "),
    ("--speed-rpm 1800 --life-time-h 9", "must know torque_nm of "),
    ("--torque-nm 20 --life-time-h 9", "must know the speed of "),
    ("--speed-rpm 1800 --torque-nm -1", "--torque-nm -1 must be 0 or above"),
    ("--speed-rpm 1800 --torque-nm nan", "--torque-nm nan must be 0 or above"),
]


def test_what_the_network_must_know_and_does_not_take_is_said_in_one_line(
    models, lives, recorded, capsys
):
    file = recorded(lives.signals(0))
    for options, message in REFUSED:
        words = ["predict", "--model", models["cnn_and_age"], file, *options.split()]
        refuses(capsys, words, message)

    known = conditions(lives, 0, "cnn_and_age")
    message = "--life-time-h: cnn is not told life_time_h"
    refuses(capsys, ["predict", "--model", models["cnn"], file, *known], message)


def test_another_data_set_is_judged_whole_and_one_without_lives_or_classes_refused(
    models, monkeypatch, capsys
):
    offered = {"other": FakeLives(n_lives=6, seed=5)}
    serve(monkeypatch, offered)
    words = ["evaluate", "data=other", f"--model={models['cnn']}"]
    printed = says(capsys, *words)

    assert "48 records of 6 lives that failed (and 0 censored): all records" in printed

    refused = {
        "has no column life_id": FakeDataset(),
        "its classes are healthy, crack, the model was trained on missing": FakeDataset(
            classes=("healthy", "crack")
        ),
        "which is told torque_nm: it has no such column": FakeLives(n_lives=6).without(
            "torque_nm"
        ),
        "no life failed": FakeLives(n_lives=6, n_censored=6),
    }
    for message, dataset in refused.items():
        offered["other"] = dataset
        refuses(capsys, words, message)


def test_classifiers_and_networks_of_lives_are_not_confused(
    models, model, lives, recorded, capsys, tmp_path
):
    with refused("says remaining lives and is no classifier", DatasetError):
        load_model(models["cnn"])
    with refused("is a classifier and says no remaining", DatasetError):
        load_life_model(model)

    file = recorded(lives.signals(0))
    words = ["predict", "--model", model, file, "--torque-nm", "20"]
    refuses(capsys, words, "--torque-nm is for models of remaining life")


@pytest.mark.parametrize(
    "change",
    [
        {"early_life_h": -3.0},
        {"half_width_h": 1e9},
        {"told": ["torque_nm"]},
        {"coverage": 2},
        {"told_range": 5},
        {"x": 1},
    ],
)
def test_a_wrong_description_is_refused(change, models, tmp_path):
    content = description_of(models["cnn"])
    content["remaining_life"] |= change
    (tmp_path / "model.safetensors").write_bytes(b"")
    forge(tmp_path, content)
    with refused("does not describe a model of remaining lives", DatasetError):
        load_life_model(tmp_path)


def test_intervals_are_from_no_width_to_the_early_life():
    facts = LifeFacts(
        method="cnn",
        early_life_h=3.0,
        half_width_h=0.0,
        coverage=0.9,
        n_calibration_lives=9,
    )
    assert replace(facts, half_width_h=3.0).half_width_h == 3.0
    for hours in (-0.01, 3.01):
        with pytest.raises(ValueError, match="are no hours"):
            replace(facts, half_width_h=hours)


def test_weights_of_another_network_are_refused(life_study, tmp_path):
    folders = life_study / "models"
    for method, name in zip(METHODS, ("model.json", "model.safetensors"), strict=True):
        content = (folders / f"by_unit-{method}-seed0" / name).read_bytes()
        (tmp_path / name).write_bytes(content)
    with refused("was altered", DatasetError):
        load_life_model(tmp_path)
    forge(tmp_path)
    with refused("does not fit", DatasetError):
        load_life_model(tmp_path)


def test_the_onnx_file_gives_the_same_hours(models, lives, recorded, capsys, tmp_path):
    for name in ("onnx", "onnxscript"):
        pytest.importorskip(name, reason="extra onnx")
    onnxruntime = pytest.importorskip("onnxruntime", reason="extra onnx")
    record, file, model = 5, str(tmp_path / "life.onnx"), models["cnn_and_age"]
    words = ["export", "--to", "onnx", "--model", model, "--out", file]

    assert "of the early level of torch's" in says(capsys, *words)

    signal = lives.signals(record)
    words = ["predict", "--model", model, recorded(signal), "--json"]
    answer = says(capsys, *words, *conditions(lives, record, "cnn_and_age"))
    expected = json.loads(answer)["remaining_life_h"]

    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
    stored = session.get_modelmeta().custom_metadata_map
    columns = json.loads(stored["told"])
    assert columns == ["speed_rpm", "torque_nm", "life_time_h"]

    windows = signal.reshape(-1, 1, 1600)
    values = np.array([lives.columns[name][record] for name in columns], np.float32)
    inputs = {"acceleration": windows, "told": np.tile(values, (len(windows), 1))}
    (hours,) = session.run(["remaining_life_h"], inputs)
    level = json.loads(stored["early_life_h"])
    assert_allclose(np.clip(hours.mean(), 0, level), expected, atol=1e-3 * level)
