"""Networks of remaining lives on disk: evaluate, predict and export say what the report said."""

import csv
import json
import re

import numpy as np
import pytest
from fake_dataset import FakeDataset
from fake_lives import FakeLives
from numpy.testing import assert_allclose

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.scoring.life_scores import MEASURES
from diagnose.training.life_store import load_life_model
from diagnose.training.store import load_model
from gensig.errors import DatasetError

FAST = [
    "task=remaining_life", "window_samples=1600", "stride_samples=1600", "epochs=3", "seeds=[0]", "n_bootstrap=50",
    "n_threads=1", "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "epoch_fraction=1",
    "learning_rate=0.01", "normalise=none",
]  # fmt: skip
METHODS = ("cnn", "cnn_and_age")


def fake():
    return FakeLives(n_lives=20, n_censored=4, seed=1)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lives") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())
        assert main(["train", "data=lives", f"out={folder}", *FAST]) == 0
    return folder


@pytest.fixture
def on_fake(monkeypatch):
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())


def model_of(out, method):
    return str(out / "models" / f"by_unit-{method}-seed0")


def recording(folder, record):
    """One record as a file that a user has."""
    data = fake()
    np.savez(
        folder / "mine.npz",
        acceleration=data.signals(record),
        sampling_rate_hz=data.sampling_rate,
    )
    return str(folder / "mine.npz")


def said(capsys, *words):
    capsys.readouterr()
    status = main(list(words))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def told(record, method):
    column = fake().columns
    words = [
        "--speed-rpm",
        str(column["speed_rpm"][record]),
        "--torque-nm",
        str(column["torque_nm"][record]),
    ]
    return words + (
        ["--life-time-h", str(column["life_time_h"][record])]
        if method.endswith("age")
        else []
    )


def test_every_network_is_stored_without_pickle(out):
    folders = sorted((out / "models").iterdir())
    assert [folder.name for folder in folders] == [
        "by_unit-cnn-seed0",
        "by_unit-cnn_and_age-seed0",
    ]
    for folder in folders:
        assert sorted(path.name for path in folder.iterdir()) == [
            "model.json",
            "model.safetensors",
        ]
    facts = load_life_model(folders[1])[2]
    assert facts.told == ("speed_rpm", "torque_nm", "life_time_h")
    assert facts.told_range["torque_nm"] == (20.0, 20.0)


@pytest.mark.parametrize("method", METHODS)
def test_evaluate_on_the_own_test_part_finds_the_scores_of_the_report(
    method, out, on_fake, capsys, tmp_path
):
    status, printed, _ = said(
        capsys,
        "evaluate",
        "data=lives",
        f"model_dir={model_of(out, method)}",
        f"out={tmp_path / 'judged'}",
    )
    assert status == 0
    result = json.loads((tmp_path / "judged" / "metrics.json").read_text())
    reported = json.loads((out / "metrics.json").read_text())["protocols"]["by_unit"]
    for measure in MEASURES:
        assert result[measure] == pytest.approx(
            reported["methods"][method][measure], rel=1e-5, abs=1e-9
        ), measure
    assert result["n_lives"] == reported["n_lives"]["test"]
    assert f"{result['n_lives']} lives that failed" in printed
    assert "rmse_h" in printed
    with (out / "predictions.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["method"] == method]
    with (tmp_path / "judged" / "predictions.csv").open() as file:
        again = list(csv.DictReader(file))
    assert [row["record_id"] for row in again] == [row["record_id"] for row in rows]
    for column in (
        "predicted_h",
        "low_h",
        "high_h",
    ):  # threads of torch change the last bits
        found, expected = (
            [float(row[column]) for row in these] for these in (again, rows)
        )
        assert_allclose(found, expected, rtol=1e-4, atol=1e-4)
    assert (tmp_path / "judged" / "remaining_life.png").is_file()


@pytest.mark.parametrize("method", METHODS)
def test_predict_says_of_a_file_what_the_report_says_of_its_record(
    method, out, capsys, tmp_path
):
    with (out / "predictions.csv").open() as file:
        row = [row for row in csv.DictReader(file) if row["method"] == method][11]
    record = int(row["record_id"][1:])
    file = recording(tmp_path, record)
    words = ["predict", "--model", model_of(out, method), file, *told(record, method)]
    _, printed, _ = said(capsys, *words, "--json")
    result = json.loads(printed)
    for key, column in (
        ("remaining_life_h", "predicted_h"),
        ("low_h", "low_h"),
        ("high_h", "high_h"),
    ):
        assert_allclose(result[key], float(row[column]), rtol=1e-4, atol=1e-3)
    mean = np.mean([window["remaining_life_h"] for window in result["windows"]])
    assert result["low_h"] <= mean <= result["early_life_h"]
    _, line, _ = said(capsys, *words)
    assert len(line.strip().splitlines()) == 1
    assert re.search(
        r"mine\.npz: .* h (left|or longer), 80 % interval .* to .* h",
        line.replace("80%", "80 %"),
    ), line


def test_a_load_or_an_age_that_was_never_trained_raises_the_flag(out, capsys, tmp_path):
    file = recording(tmp_path, 0)
    words = [
        "predict",
        "--model",
        model_of(out, "cnn_and_age"),
        file,
        "--speed-rpm",
        "1800",
    ]
    status, line, _ = said(capsys, *words, "--torque-nm", "80", "--life-time-h", "9000")
    assert status == 3
    assert "80 N m is outside the 20 to 20 N m of the training" in line
    assert "9000 h is outside" in line
    assert said(capsys, *words, "--torque-nm", "20", "--life-time-h", "10")[0] == 0


@pytest.mark.parametrize(
    ("method", "words", "message"),
    [
        ("cnn", ["--speed-rpm", "1800"], "must know torque_nm of .*: say --torque-nm"),
        ("cnn", ["--torque-nm", "20"], "must know the speed of .*: say --speed-rpm"),
        (
            "cnn_and_age",
            ["--speed-rpm", "1800", "--torque-nm", "20"],
            "must know life_time_h .*: say --life-time-h",
        ),
        (
            "cnn",
            ["--speed-rpm", "1800", "--torque-nm", "20", "--life-time-h", "3"],
            "--life-time-h: cnn is not told life_time_h",
        ),
        (
            "cnn",
            ["--speed-rpm", "1800", "--torque-nm", "-1"],
            "--torque-nm -1 must be 0 or above",
        ),
        (
            "cnn",
            ["--speed-rpm", "1800", "--torque-nm", "nan"],
            "--torque-nm nan must be 0 or above",
        ),
    ],
)
def test_what_the_network_must_know_is_asked_in_one_line(
    method, words, message, out, capsys, tmp_path
):
    status, _, errors = said(
        capsys,
        "predict",
        "--model",
        model_of(out, method),
        recording(tmp_path, 0),
        *words,
    )
    assert status == 2
    (line,) = errors.strip().splitlines()
    assert re.search(message, line), line


def test_another_data_set_is_judged_whole_and_one_without_lives_or_classes_refused(
    out, monkeypatch, capsys
):
    other = FakeLives(n_lives=6, seed=5)
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: other)
    words = ["evaluate", "data=other", f"model_dir={model_of(out, 'cnn')}"]
    status, printed, _ = said(capsys, *words)
    assert status == 0
    assert "48 records of 6 lives that failed (and 0 censored): all records" in printed
    for data, message in (
        (FakeDataset(), "has no column life_id"),
        (
            FakeDataset(classes=("healthy", "crack")),
            "its classes are healthy, crack, the model was trained on missing",
        ),
        (
            FakeLives(n_lives=6).without("torque_nm"),
            "which is told torque_nm: it has no such column",
        ),
        (FakeLives(n_lives=6, n_censored=6), "no life failed"),
    ):
        monkeypatch.setattr(
            gensig.dataset.reader, "open_dataset", lambda path, data=data: data
        )
        status, _, errors = said(capsys, *words)
        assert status == 2
        (line,) = errors.strip().splitlines()
        assert message in line


def test_a_classifiers_verbs_refuse_such_a_network_and_the_other_way_round(
    out, capsys, tmp_path
):
    with pytest.raises(DatasetError, match="says remaining lives and is no classifier"):
        load_model(model_of(out, "cnn"))
    file = recording(tmp_path, 0)
    words = [
        "adapt",
        "--model",
        model_of(out, "cnn"),
        "--healthy",
        file,
        "--method",
        "adabn",
    ]
    status, _, errors = said(capsys, *words, "--out", str(tmp_path / "moved"))
    assert status == 2
    assert "is no classifier" in errors
    content = json.loads(
        (out / "models" / "by_unit-cnn-seed0" / "model.json").read_text()
    )
    plain = tmp_path / "plain"
    plain.mkdir()
    (plain / "model.json").write_text(json.dumps({**content, "remaining_life": None}))
    with pytest.raises(
        DatasetError, match="is a classifier and says no remaining life"
    ):
        load_life_model(plain)


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
def test_a_description_that_is_wrong_is_refused_in_one_line(change, out, tmp_path):
    content = json.loads(
        (out / "models" / "by_unit-cnn-seed0" / "model.json").read_text()
    )
    content["remaining_life"] |= change
    (tmp_path / "model.json").write_text(json.dumps(content))
    with pytest.raises(
        DatasetError, match="does not describe a model of remaining lives"
    ):
        load_life_model(tmp_path)


def test_weights_of_another_network_are_refused(out, tmp_path):
    folder = out / "models"
    (tmp_path / "model.json").write_bytes(
        (folder / "by_unit-cnn-seed0" / "model.json").read_bytes()
    )
    weights = (folder / "by_unit-cnn_and_age-seed0" / "model.safetensors").read_bytes()
    (tmp_path / "model.safetensors").write_bytes(weights)
    with pytest.raises(DatasetError, match="does not fit"):
        load_life_model(tmp_path)


def test_torque_is_not_for_classifiers(monkeypatch, capsys, tmp_path):
    classes = [
        "window_samples=1600",
        "stride_samples=1600",
        "epochs=1",
        "seeds=[0]",
        "n_bootstrap=20",
        "n_threads=1",
    ]
    small = [
        "model.widths=[8,16]",
        "model.kernels=[32,5]",
        "model.strides=[8,4]",
        "protocols=[by_unit]",
    ]
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: FakeDataset()
    )
    quick = ["shuffle_control=false", "baselines=false", "metadata_probe=false"]
    assert (
        main(["train", "data=x", f"out={tmp_path / 'c'}", *classes, *small, *quick])
        == 0
    )
    words = [
        "predict",
        "--model",
        str(tmp_path / "c" / "models" / "by_unit-seed0"),
        recording(tmp_path, 0),
    ]
    status, _, errors = said(capsys, *words, "--torque-nm", "20")
    assert status == 2
    assert "--torque-nm is for models of remaining life" in errors


def test_the_onnx_file_says_the_same_hours(out, capsys, tmp_path):
    for name in ("onnx", "onnxscript"):
        pytest.importorskip(name, reason="extra onnx")
    onnxruntime = pytest.importorskip("onnxruntime", reason="extra onnx")
    record, file = 5, tmp_path / "life.onnx"
    status, printed, errors = said(
        capsys,
        "export",
        "--to",
        "onnx",
        "--model",
        model_of(out, "cnn_and_age"),
        "--out",
        str(file),
    )
    assert status == 0, errors
    assert "of the early level of torch's" in printed
    _, answer, _ = said(
        capsys, "predict", "--model", model_of(out, "cnn_and_age"), recording(tmp_path, record), "--json",
        *told(record, "cnn_and_age"),
    )  # fmt: skip
    session = onnxruntime.InferenceSession(
        str(file), providers=["CPUExecutionProvider"]
    )
    facts = session.get_modelmeta().custom_metadata_map
    columns = json.loads(facts["told"])
    assert columns == ["speed_rpm", "torque_nm", "life_time_h"]
    data = fake()
    windows = data.signals(record).reshape(1, -1, 1600).swapaxes(0, 1)
    beside = np.array(
        [[data.columns[name][record] for name in columns]] * len(windows),
        dtype=np.float32,
    )
    (hours,) = session.run(
        ["remaining_life_h"], {"acceleration": windows, "told": beside}
    )
    level = json.loads(facts["early_life_h"])
    assert_allclose(
        np.clip(hours.mean(), 0, level),
        json.loads(answer)["remaining_life_h"],
        rtol=0,
        atol=1e-3 * level,
    )
