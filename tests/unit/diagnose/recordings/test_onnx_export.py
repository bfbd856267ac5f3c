"""The exported network answers like torch, from m/s2, and describes its numbers."""

import json
import sys

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose
from runs import refuses, says
from small_studies import task_on

from diagnose.data.windows import Segments, load_windows
from diagnose.recordings import onnx_export
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_model
from gensig.text.installation import install

onnx = pytest.importorskip("onnx", reason="extra onnx")
onnxruntime = pytest.importorskip("onnxruntime", reason="extra onnx")
pytest.importorskip("onnxscript", reason="extra onnx")


DESCRIBED = (
    "temperature",
    "sampling_rate_hz",
    "window_samples",
    "stride_samples",
    "class_names",
    "channel_names",
)


def exporting(model, file):
    return [
        "export",
        "--to",
        "onnx",
        "--model",
        str(model),
        "--out",
        str(file),
    ]


def session_of(file):
    return onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])


def check_metadata(session, description):
    """The file describes the network and takes any number of windows."""
    stored = session.get_modelmeta().custom_metadata_map
    assert stored.pop("normalise").startswith(description.normalise)
    for name in DESCRIBED:
        expected = getattr(description, name)
        if isinstance(expected, tuple):
            expected = list(expected)
        assert json.loads(stored[name]) == expected
    assert json.loads(stored["n_teeth"]) == [23, 84]
    (given,) = session.get_inputs()
    assert isinstance(given.shape[0], str)
    assert given.shape[1:] == [2, 1200]


@pytest.mark.parametrize(
    "network",
    ["levels_model", "model=cnn"],
)
def test_the_file_answers_like_torch(
    network, two_channels, train_network, request, tmp_path, capsys
):
    if "=" in network:
        folder = train_network("epochs=1", network=(network,))
    else:
        folder = request.getfixturevalue(network)
    file = tmp_path / "m.onnx"
    assert len(says(capsys, *exporting(folder, file)).strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == [file]

    model, description = load_model(folder)
    task = task_on(two_channels, 1200, 1000, description.normalise)
    record, start = np.array([90]), np.array([0])
    stop = np.array([two_channels.n_samples])
    windows = load_windows(
        task,
        Segments(record=record, start=start, stop=stop),
    )
    signal = two_channels.signals(90)
    raw = np.stack([signal[:, start : start + 1200] for start in windows.start])
    # an offset counts for nothing
    inputs = {"acceleration": raw + np.float32(0.25)}
    session = session_of(file)
    (result,) = session.run(None, inputs)
    assert_allclose(result, predict_windows(model, windows), atol=1e-4)

    check_metadata(session, description)


def test_a_file_that_answers_otherwise_is_removed(model, tmp_path, capsys, monkeypatch):
    class Louder(onnx_export.RawWindows):
        def forward(self, *inputs):
            return 1.001 * super().forward(*inputs)

    monkeypatch.setattr(onnx_export, "RawWindows", Louder)
    file = tmp_path / "m.onnx"

    refuses(capsys, exporting(model, file), "answered unlike torch by 0.001")
    assert not file.exists()


def test_a_failed_export_leaves_no_file(model, tmp_path, capsys, monkeypatch):
    file = tmp_path / "m.onnx"

    def stopped(*_, **__):
        file.write_bytes(b"half")
        raise RuntimeError("no such\noperator")

    monkeypatch.setattr(torch.onnx, "export", stopped)
    message = "cannot be written as ONNX: no such operator"

    refuses(capsys, exporting(model, file), message)
    assert not file.exists()


def test_mistakes_are_one_line(model, tmp_path, capsys):
    there = tmp_path / "there.onnx"
    there.write_text("mine")
    for folder, name, message in (
        (model, "m.pt", "the name must end in .onnx"),
        (model, there, "exists; choose another"),
        (model, "none/m.onnx", "there is no folder"),
        (tmp_path, "m.onnx", "holds no model.json"),
    ):
        refuses(capsys, exporting(folder, tmp_path / name), message)
    refuses(capsys, ["export", "--to", "tflite"], "tflite is not one of onnx")
    assert there.read_text() == "mine"


def test_without_the_extra_one_line_says_what_to_install(
    model, tmp_path, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "onnxscript", None)
    message = f"needs the package onnxscript: {install('onnx')}"
    refuses(capsys, exporting(model, tmp_path / "m.onnx"), message)
