"""The code of the pages on using a model runs as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest
from fake_dataset import CLASSES, FakeDataset
from runs import FAST, NETWORK_ONLY, model_of, train

import gensig.dataset.reader
from diagnose.cli import main

HOWTO = Path(__file__).resolve().parents[3] / "docs" / "howto"


def run_page(page):
    """Names that the Python code of a page, at most 30 lines, defines."""
    text = (HOWTO / page).read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    assert len(code.strip().splitlines()) <= 30
    names = {}
    exec(compile(code, page, "exec"), names)
    return names


def test_a_model_of_the_user_learns_and_is_judged_on_unseen_units(monkeypatch, capsys):
    """With five classes, of which the page knows nothing."""
    shape = {"n_units": 16, "records_per_unit": 8, "duration": 0.5}
    data = FakeDataset(**shape, noise=0.2, classes=(*CLASSES, "wear"))
    data.protocols = ("new_machine",)
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path, **_: data)
    names = run_page("models.md")
    shown = capsys.readouterr().out
    assert float(shown.rsplit(":", 1)[1]) > 0.45  # chance is 0.2
    assert shown.count(" of 8: training loss") == 8
    units = data.column("unit_id")
    train_units = set(units[names["train"].record])
    assert not train_units & set(units[names["record"]])


def test_an_exported_model_answers_where_the_page_says(monkeypatch, tmp_path, capsys):
    for name in ("onnx", "onnxscript", "onnxruntime"):
        pytest.importorskip(name, reason="extra onnx")
    monkeypatch.chdir(tmp_path)
    data = FakeDataset(n_units=12, records_per_unit=8, duration=0.5)
    model = model_of(train(Path("report"), data, *FAST, *NETWORK_ONLY, "epochs=1"))
    words = ["export", "--to", "onnx", "--model", model, "--out", "gearbox.onnx"]
    assert main(words) == 0
    capsys.readouterr()
    names = run_page("export.md")
    probability = names["weight"] / names["weight"].sum()
    assert probability.shape == (4,)
    assert np.isfinite(probability).all()
    assert "healthy" in capsys.readouterr().out
