"""The worked example of a baseline: run by the ordinary study, shown on the ordinary page."""

import json
import sys
from pathlib import Path

import pytest
import torch
from baseline_example import NearestCrest

import gensig.dataset.reader
from diagnose.baselines.registry import BASELINES
from diagnose.cli import main

sys.path.append(str(Path(__file__).parent.parent / "unit" / "diagnose"))
from fake_dataset import FakeDataset

SMALL = [
    "window_samples=1200", "epochs=1", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "protocols=[by_unit]", "shuffle_control=false", "metadata_probe=false",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]",
]  # fmt: skip


@pytest.fixture
def data(monkeypatch):
    """Small data sets in place of folders."""
    torch.set_num_threads(1)
    sets = {
        "good": FakeDataset(n_units=16, records_per_unit=4, strength=3.0),
        "sham": FakeDataset(n_units=16, records_per_unit=4, sham=True),
    }
    for name, dataset in sets.items():
        dataset.folder = Path(name)
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: sets[str(path)]
    )


def train(out, *words):
    return main(["train", "data=good", f"out={out}", *SMALL, *words])


def test_it_runs_in_a_study_and_stands_on_the_page(data, monkeypatch, tmp_path):
    monkeypatch.setitem(BASELINES, NearestCrest.text.name, NearestCrest)
    out = tmp_path / "out"
    assert train(out, "baselines=[nearest_crest]", "sham=sham") == 0

    result = json.loads((out / "metrics.json").read_text())["protocols"]["by_unit"]
    methods = result["methods"]
    assert methods["nearest_crest"]["detail"][0].startswith("class means ")
    assert methods["nearest_crest"]["balanced_accuracy"]["mean"] > 0.4  # chance is 0.25
    assert methods["sham_nearest_crest"]["balanced_accuracy"]["mean"] < 0.5
    assert result["answers"]["best_baseline"] == "nearest_crest"

    page = (out / "report.html").read_text()
    for words in (
        NearestCrest.text.label,
        NearestCrest.text.meaning,
        "sham, nearest crest factor",
    ):
        assert words in page
    assert "nearest_crest" in (out / "predictions.csv").read_text()


def test_without_its_line_in_the_registry_it_is_refused(data, tmp_path, capsys):
    assert train(tmp_path / "out", "baselines=[nearest_crest]") == 2
    assert (
        "baselines must be false or a list of different names"
        in capsys.readouterr().err
    )
