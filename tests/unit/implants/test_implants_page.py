"""The commands and the Python of docs/howto/bridge.md on implants, on small files."""

import csv

import pytest
from docs_pages import ROOT, blocks, command_lines
from implant_samples import CARRIER_RATE, carrier
from refusals import refused

import gensig
from gensig.cli import main
from gensig.errors import DatasetError

PAGE = (ROOT / "docs" / "howto" / "bridge.md").read_text(encoding="utf-8")
TEETH = (29, 95, 36, 90)


@pytest.fixture
def folder(tmp_path, monkeypatch, pairs_folder):
    """Files of the names that the page uses."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "faults").symlink_to(pairs_folder)
    for seed, name in enumerate(("monday.csv", "tuesday.csv")):
        recording, _ = carrier(seed, seconds=18.0, teeth=TEETH, speed=1480.0)
        with open(name, "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["time_s", "case_m_per_s2"])
            for index, value in enumerate(recording.acceleration[0]):
                writer.writerow([f"{index / CARRIER_RATE:.9f}", f"{value:.6f}"])
    return tmp_path


def test_commands_and_python(folder):
    words = next(words for _, words in command_lines(PAGE) if words[1] == "implant")
    assert main([*words[1:], "--records", "60", "--path", "none", "--quiet"]) == 0
    names = {}
    for block in blocks(PAGE):
        if block.language == "python":
            exec(block.code, names)
    with refused("monday.csv: samples 0", DatasetError):
        names["refuse_carried"](names["blocks"], names["recording"], name="monday.csv")
    with gensig.open_dataset("runs/mine") as data:
        assert data.gear_names[2] == "stage_2_pinion"
        assert data.n_teeth("stage_2_wheel")[0] == 90
        assert set(data.column("fault_gear").tolist()) == {
            "",
            "stage_1_pinion",
            "stage_2_pinion",
        }
