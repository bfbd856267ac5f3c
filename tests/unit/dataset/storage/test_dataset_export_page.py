"""The commands and the Python of docs/howto/dataset_export.md run, in the order of the page."""

import datasets
import numpy as np
import pytest
from dataset_samples import build
from docs_pages import ROOT, blocks, command_lines
from split_samples import every_protocol_plan

from gensig.cli import main
from gensig.dataset.reader import open_dataset

PAGE = (ROOT / "docs" / "howto" / "dataset_export.md").read_text(encoding="utf-8")


@pytest.fixture
def names(tmp_path, monkeypatch):
    """Names that the blocks of the page define, after its commands."""
    monkeypatch.setattr(datasets.config, "HF_DATASETS_CACHE", tmp_path / "cache")
    monkeypatch.setattr(datasets.config, "HF_HUB_OFFLINE", True)
    datasets.disable_progress_bars()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    build(tmp_path / "runs" / "quick", every_protocol_plan(), references=True)
    for _, words in command_lines(PAGE):
        if "hf" in words:
            words = [*words, "--protocol", "new_machine"]
        assert main(words[1:]) == 0
    result = {}
    for block in blocks(PAGE):
        if block.language == "python":
            exec(block.code, result)
    return result


def test_page_loads_the_same_training_from_every_format(names):
    with open_dataset("runs/quick") as data:
        dealt = sorted(record for record, _, _ in data.split("new_machine")["train"])
        ids = data.column("record_id")[dealt].tolist()
        signals = np.stack([data.signals(record) for record in dealt])
        classes = data.class_names
    assert names["records"]["train"]["record_id"][:] == ids
    assert names["train"]["record_id"].tolist() == ids
    np.testing.assert_array_equal(names["signals"], signals)
    np.testing.assert_array_equal(names["signal"], signals[0])
    assert names["names"] == classes
    assert names["fault"] == names["train"]["label_name"].iloc[0]
    assert set(names["subset"]) == {"train", "validation", "test", ""}
    assert len(names["stretches"]) == 2
