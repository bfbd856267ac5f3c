"""simulate, plan and generate as a user types them; see test_progress.py for what they print."""

import itertools
import re

import h5py
import numpy as np
import pytest
from small_sets import contents

from gensig.cli import main


@pytest.mark.parametrize("suffix", [".h5", ".csv"])
def test_simulate_writes_one_record(gensig, drawn, suffix, tmp_path, capsys):
    file = tmp_path / f"record{suffix}"
    line = (
        "simulate fault=missing_tooth operating.duration_s=0.1 "
        f"sensing.channels=[pinion_y,wheel_y] --output {file.name}"
    )
    gensig(f"{line} --plot r.png")
    if suffix == ".h5":
        with h5py.File(file) as shard:
            assert shard["acceleration"].shape == (1, 2, 5120)
            assert shard.attrs["sampling_rate_hz"] == 51200.0
            assert shard["label_name"].asstr()[0] == "missing_tooth"
        gensig("inspect record.h5")
    else:
        table = np.genfromtxt(file, delimiter=",", names=True)
        assert table.dtype.names == ("time_s", "pinion_y_m_per_s2", "wheel_y_m_per_s2")
        assert len(table) == 5120
        said, _ = gensig("inspect record.csv")
        assert "rate         51200 Hz" in said
        assert "length       5120 samples, 0.1 s" in said
        level = np.sqrt(np.mean(table["wheel_y_m_per_s2"] ** 2))
        assert f"wheel_y_m_per_s2 (RMS {level:.4g})" in said
    wave, spectrum, envelope = drawn[0].values()
    assert wave.get_xlabel() == "time, s"
    assert wave.get_ylabel() == "acceleration, m/s$^2$"
    assert spectrum.get_title().endswith("harmonics of the mesh frequency 690.0 Hz")
    first, last = spectrum.get_xlim()
    assert first == 0
    assert 0.3 * 51.2 < last < 0.5 * 51.2  # kHz, below half the sampling rate
    assert re.fullmatch(r"missing_tooth, .*: 1800.0 r/min, 20 N m", drawn[0].title)
    assert (
        len(envelope.lines) == 13
    )  # with and without the fault, eleven turns of the pinion
    before = file.stat().st_mtime_ns
    assert main(line.split()) == 2
    assert "choose another name, or add --force" in capsys.readouterr().err
    assert file.stat().st_mtime_ns == before
    gensig(f"{line} --force")
    assert file.stat().st_mtime_ns > before
    assert not list(tmp_path.glob(".*"))


def test_plan_predicts_without_writing(gensig, tmp_path):
    line = "plan experiment=quickstart operating.duration_s=0.02"
    said, notes = gensig(f"{line} out=x")
    assert "records    400" in said
    assert "healthy 100" in said
    assert re.fullmatch(r"making \d+ of 500 records to time them\n", notes)
    assert not list(tmp_path.iterdir())
    said, notes = gensig(f"{line} fault=crack")
    assert "crack 400" in said
    classes = "[healthy, crack, pitting, missing_tooth]"
    assert f"gensig: note: fault=crack replaces plan.classes {classes}\n" in notes


def test_existing_folder_is_refused_and_untouched(tmp_path, capsys):
    precious = tmp_path / "precious.txt"
    precious.write_text("mine")
    assert main(["generate", f"out={tmp_path}"]) == 2
    assert "not empty" in capsys.readouterr().err
    assert precious.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [precious]


def test_flags_for_keys_are_understood(gensig, tmp_path):
    small = "plan.n_records=2 operating.duration_s=0.02 sensing.channels=[pinion_y]"
    gensig(f"generate {small} --out flags -j 1 --quiet")
    gensig(f"generate {small} out=keys executor.n_workers=1 --quiet")
    assert contents(tmp_path / "flags") == contents(tmp_path / "keys")
    text = (tmp_path / "flags" / "config.yaml").read_text()
    assert text == (tmp_path / "keys" / "config.yaml").read_text()


def test_plan_of_several_data_sets_has_a_block_for_each(gensig, tmp_path):
    line = "plan -m fault=glob(c*,exclude=comp*) plan.n_records=2,3"
    line += " operating.duration_s=0.02 executor.n_workers=1"
    said, _ = gensig(f"{line} --freeze out=sets")
    blocks = said.split("\n\n")
    names = [block.splitlines()[0] for block in blocks]
    assert names == [
        f"{number}-fault={fault},plan.n_records={count}"
        for number, (fault, count) in enumerate(
            itertools.product(("chipped", "crack"), (2, 3))
        )
    ]
    counts = [re.search(r"^records +(\d+)$", block, re.M)[1] for block in blocks]
    assert counts == ["2", "3", "2", "3"]
    for name in names:
        assert (tmp_path / "sets" / name / "plan.csv").is_file()
    assert main(["plan", "-m", "seed=1,2", "--freeze", "out=sets"]) == 2
