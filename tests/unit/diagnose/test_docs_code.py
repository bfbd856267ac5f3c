"""The code of the pages on using a model runs as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest
import torch
from fake_dataset import CLASSES, FakeDataset

import gensig.dataset.reader
from diagnose.cli import main

HOWTO = Path(__file__).resolve().parents[3] / "docs" / "howto"


def python_of(page):
    (code,) = re.findall(
        r"```python\n(.*?)```", (HOWTO / page).read_text("utf-8"), flags=re.DOTALL
    )
    return code


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.mark.parametrize("classes", [CLASSES, (*CLASSES, "wear")])
def test_a_model_of_ones_own_learns_and_is_judged_on_unseen_units(
    classes, monkeypatch, capsys
):
    data = FakeDataset(
        n_units=16, records_per_unit=8, duration=0.5, noise=0.2, classes=classes
    )
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path, **_: data)
    code = python_of("train_your_model.md")
    assert len(code.strip().splitlines()) <= 30
    names = {}
    exec(compile(code, "train_your_model.md", "exec"), names)
    shown = capsys.readouterr().out
    score = float(shown.rsplit(":", 1)[1])
    assert score > 0.45  # chance is 0.25
    assert shown.count(" of 8: training loss") == 8
    units = data.column("unit_id")
    train = names["train"].record
    assert not set(units[train]) & set(units[names["record"]])


def test_an_exported_model_answers_where_the_page_says(monkeypatch, tmp_path, capsys):
    for name in ("onnx", "onnxscript", "onnxruntime"):
        pytest.importorskip(name, reason="extra onnx")
    data = FakeDataset(n_units=12, records_per_unit=8, duration=0.5)
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: data)
    monkeypatch.chdir(tmp_path)
    words = [
        "window_samples=1200",
        "stride_samples=1000",
        "epochs=1",
        "seeds=[0]",
        "n_bootstrap=20",
        "n_threads=1",
    ]
    words += ["protocols=[by_unit]", "shuffle_control=false", "baselines=false"]
    assert main(["train", "data=good", "out=report", *words]) == 0
    assert (
        main(
            [
                "export",
                "--to",
                "onnx",
                "--model",
                "report/models/by_unit-seed0",
                "--out",
                "gearbox.onnx",
            ]
        )
        == 0
    )
    capsys.readouterr()
    names = {}
    exec(compile(python_of("export.md"), "export.md", "exec"), names)
    probability = names["weight"] / names["weight"].sum()
    assert probability.shape == (4,)
    assert np.isfinite(probability).all()
    assert "healthy" in capsys.readouterr().out
