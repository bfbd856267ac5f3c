"""The exported network answers like torch, from acceleration in m/s2, and says what its numbers mean."""

import json
import subprocess
import sys

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.windows import Segments, load_windows, task_of
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_model

onnx = pytest.importorskip("onnx", reason="extra onnx")
onnxruntime = pytest.importorskip("onnxruntime", reason="extra onnx")
pytest.importorskip("onnxscript", reason="extra onnx")

FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=1", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "protocols=[by_unit]", "shuffle_control=false", "baselines=false",
]  # fmt: skip
SMALL_CNN = ["model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]"]


def fake():
    return FakeDataset(n_units=12, records_per_unit=8, duration=0.5, n_channels=2)


def trained(folder, *overrides):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())
        assert (
            main(["train", "data=good", f"out={folder / 'out'}", *FAST, *overrides])
            == 0
        )
    return str(folder / "out" / "models" / "by_unit-seed0")


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return trained(tmp_path_factory.mktemp("study"), *SMALL_CNN)


@pytest.mark.parametrize(
    "overrides",
    [[*SMALL_CNN], [*SMALL_CNN, "normalise=none"], ["model=wdcnn"], ["model=spectrum"]],
    ids=["cnn", "cnn with level", "wdcnn", "spectrum"],
)
def test_the_file_says_what_torch_says_of_records(overrides, tmp_path, capsys):
    folder = trained(tmp_path, *overrides)
    capsys.readouterr()
    file = tmp_path / "m.onnx"
    assert main(["export", "--to", "onnx", "--model", folder, "--out", str(file)]) == 0
    captured = capsys.readouterr()
    assert len(captured.out.strip().splitlines()) == 1
    assert captured.err == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.onnx", "out"]
    network, description = load_model(folder)
    data = fake()
    task = task_of(
        data, window_samples=1200, stride_samples=1000, normalise=description.normalise
    )
    record = np.array([90])
    whole = Segments(
        record=record, start=np.array([0]), stop=np.array([data.n_samples])
    )
    windows = load_windows(task, whole)
    raw = np.stack(
        [data.signals(90)[:, start : start + 1200] for start in windows.start]
    )
    session = onnxruntime.InferenceSession(
        str(file), providers=["CPUExecutionProvider"]
    )
    found = session.run(None, {"acceleration": raw + np.float32(0.25)})[
        0
    ]  # an offset counts for nothing
    assert_allclose(found, predict_windows(network, windows), rtol=0, atol=1e-4)


def test_metadata_is_the_description(model, tmp_path):
    file = tmp_path / "m.onnx"
    assert main(["export", "--to", "onnx", "--model", model, "--out", str(file)]) == 0
    description = load_model(model)[1]
    facts = onnxruntime.InferenceSession(
        str(file), providers=["CPUExecutionProvider"]
    ).get_modelmeta()
    facts = facts.custom_metadata_map
    assert json.loads(facts["class_names"]) == list(description.class_names)
    assert json.loads(facts["channel_names"]) == list(description.channel_names)
    assert json.loads(facts["temperature"]) == description.temperature
    assert float(facts["sampling_rate_hz"]) == 12800.0
    assert (int(facts["window_samples"]), int(facts["stride_samples"])) == (1200, 1000)
    assert facts["normalise"].startswith("rms")
    assert json.loads(facts["n_teeth"]) == [23, 84]
    (given,) = onnx.load(file).graph.input
    assert [dim.dim_value for dim in given.type.tensor_type.shape.dim] == [
        0,
        2,
        1200,
    ]  # any number of windows


def fails(capsys, words, message):
    capsys.readouterr()
    assert main(["export", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.strip().splitlines()) == 1
    assert message in captured.err


def test_a_file_that_answers_otherwise_is_removed(model, tmp_path, capsys, monkeypatch):
    import diagnose.recordings.onnx_export

    class Louder(diagnose.recordings.onnx_export.RawWindows):
        def forward(self, *inputs):
            return 1.001 * super().forward(*inputs)

    monkeypatch.setattr(diagnose.recordings.onnx_export, "RawWindows", Louder)
    file = tmp_path / "m.onnx"
    fails(
        capsys,
        ["--to", "onnx", "--model", model, "--out", str(file)],
        "answered unlike torch by 0.001",
    )
    assert not file.exists()


def test_what_torch_cannot_write_leaves_no_file(model, tmp_path, capsys, monkeypatch):
    def stopped(*_, **__):
        (tmp_path / "m.onnx").write_bytes(b"half")
        raise RuntimeError("no such\noperator")

    monkeypatch.setattr(torch.onnx, "export", stopped)
    words = ["--to", "onnx", "--model", model, "--out", str(tmp_path / "m.onnx")]
    fails(capsys, words, "cannot be written as ONNX: no such operator")
    assert list(tmp_path.iterdir()) == []


def test_mistakes_are_one_line(model, tmp_path, capsys):
    (tmp_path / "there.onnx").write_text("mine")
    for out, message in [
        ("m.pt", "the name must end in .onnx"),
        ("there.onnx", "exists; choose another"),
        ("none/m.onnx", "there is no folder"),
    ]:
        fails(
            capsys,
            ["--to", "onnx", "--model", model, "--out", str(tmp_path / out)],
            message,
        )
    assert (tmp_path / "there.onnx").read_text() == "mine"
    fails(
        capsys,
        ["--to", "tflite", "--model", model, "--out", "m.onnx"],
        "tflite is not one of onnx",
    )
    fails(
        capsys,
        ["--to", "onnx", "--model", str(tmp_path), "--out", str(tmp_path / "m.onnx")],
        "holds no model.json",
    )


def test_without_the_extra_one_line_says_what_to_install(model, tmp_path):
    code = (
        "import sys; sys.modules['onnxscript'] = None\nfrom diagnose.cli import main\n"
        f"sys.exit(main(['export', '--to', 'onnx', '--model', {model!r}, '--out', {str(tmp_path / 'm.onnx')!r}]))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert shown.returncode == 2
    assert shown.stderr.strip() == (
        "diagnose: export --to onnx needs the package onnxscript: pip install 'gensig[onnx]'"
    )
