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
from small_studies import SMALL, TINY_CNN


@pytest.fixture
def train(monkeypatch):
    """Function that runs a study with the example on small data sets in place of folders."""
    torch.set_num_threads(1)
    shape = {"n_units": 16, "records_per_unit": 4}
    sets = {
        "good": FakeDataset(strength=3.0, **shape),
        "sham": FakeDataset(sham=True, **shape),
    }
    for name, dataset in sets.items():
        dataset.folder = Path(name)
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: sets[str(path)]
    )
    fast = ["epochs=1", "shuffle_control=false", "metadata_probe=false"]
    words = ["data=good", "baselines=[nearest_crest]", *SMALL, *TINY_CNN, *fast]
    return lambda out, *more: main(["train", f"out={out}", *words, *more])


def test_it_runs_in_a_study_and_is_on_the_page(train, monkeypatch, tmp_path):
    monkeypatch.setitem(BASELINES, NearestCrest.text.name, NearestCrest)
    assert train(tmp_path, "sham=sham") == 0

    metrics = json.loads((tmp_path / "metrics.json").read_text())
    result = metrics["protocols"]["by_unit"]
    methods = result["methods"]
    assert methods["nearest_crest"]["detail"][0].startswith("class means ")
    assert methods["nearest_crest"]["balanced_accuracy"]["mean"] > 0.4  # chance is 0.25
    assert methods["sham_nearest_crest"]["balanced_accuracy"]["mean"] < 0.5
    assert result["answers"]["best_baseline"] == "nearest_crest"

    page = (tmp_path / "report.html").read_text()
    text = NearestCrest.text
    for words in (text.label, text.meaning, "sham, nearest crest factor"):
        assert words in page
    assert "nearest_crest" in (tmp_path / "predictions.csv").read_text()


def test_without_its_line_in_the_registry_it_is_refused(train, tmp_path, capsys):
    assert train(tmp_path / "out") == 2
    message = "no baseline 'nearest_crest'; did you mean 'nearest_spectrum'?"
    assert message in capsys.readouterr().err
