"""Folders that change while a run is going on, or after it: named by the run, mended by resume.

The run looks at them in `gensig.production.run_check`.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from small_sets import TINY, contents, make, resume

import gensig
from gensig.cli import main
from gensig.dataset.folder.layout import read_manifest, shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.storage.atomic import sha256_file
from gensig.errors import DatasetError
from gensig.execution.array import ArrayExecutor
from gensig.execution.local import LocalExecutor
from gensig.plan.request import read_request
from gensig.production.folder import begin_folder, run_folder
from gensig.production.shard_writing import write_shard

N_SHARDS = 6
SPLIT = "splits/random_window_leaky.csv"


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return make(tmp_path_factory.mktemp("reference") / "data")


@pytest.fixture
def planned(tmp_path):
    """The folder of the reference before its first shard."""
    out = tmp_path / "data"
    begin_folder(read_request(TINY).config, TINY, out)
    return out


@pytest.fixture
def data(reference, tmp_path):
    return shutil.copytree(reference, tmp_path / "data")


def run(out, change=lambda out: None, *, at=N_SHARDS, executor=None):
    """Lines of a run on a folder that is changed once so many records are made."""
    left = [change]

    def on_shard(progress):
        if progress.n_made == at and left:
            left.pop()(out)

    executor = executor or LocalExecutor(n_workers=1)
    _, problems = run_folder(out, executor=executor, on_shard=on_shard)
    assert not left, "the change was never made"
    return problems


def outcome(out, change, **options):
    """Lines of a run, or the one with which it was given up."""
    try:
        lines = run(out, change, **options)
    except DatasetError as error:
        lines = [str(error)]
    assert not any("\n" in line for line in lines)
    return lines


def same_bits(out, reference):
    return contents(out) == contents(reference) and not verify(out).problems


def test_an_undisturbed_run_says_nothing_and_has_the_bits_of_the_reference(
    planned, reference
):
    assert run(planned) == []
    assert same_bits(planned, reference)


def zero(path):
    path.write_bytes(bytes(path.stat().st_size))


CHANGES = {
    "shard deleted": (lambda out: shard_path(out, 0).unlink(), "shard-00000.h5"),
    "shard renamed": (
        lambda out: shard_path(out, 1).rename(out / "mine.h5"),
        "shard-00001.h5",
    ),
    "shard zeroed": (lambda out: zero(shard_path(out, 0)), "shard-00000.h5"),
    "shard cut": (lambda out: os.truncate(shard_path(out, 0), 99), "shard-00000.h5"),
    "shards deleted": (lambda out: shutil.rmtree(out / "shards"), "shard"),
    "split deleted": (lambda out: (out / SPLIT).unlink(), SPLIT),
    "splits deleted": (lambda out: shutil.rmtree(out / "splits"), "splits/"),
    "plan deleted": (lambda out: (out / "plan.csv").unlink(), "plan.csv is missing"),
}


@pytest.mark.parametrize("at", [2, N_SHARDS], ids=["in mid run", "at its end"])
@pytest.mark.parametrize("name", CHANGES)
def test_what_is_lost_during_a_run_is_named_and_made_again(
    planned, reference, name, at
):
    change, text = CHANGES[name]
    lines = outcome(planned, change, at=at)
    assert any(text in line for line in lines), lines
    assert not verify(planned).complete
    assert resume(planned) == 0
    assert same_bits(planned, reference)


@pytest.mark.parametrize("at", [2, N_SHARDS], ids=["in mid run", "at its end"])
def test_a_folder_renamed_during_a_run_is_named_and_finished_under_its_new_name(
    planned, reference, at
):
    moved = planned.with_name("moved")
    (line,) = outcome(planned, lambda out: out.rename(moved), at=at)
    assert f"{planned} was deleted or renamed" in line
    assert not planned.exists()
    assert resume(moved) == 0
    assert same_bits(moved, reference)


def test_a_folder_deleted_during_a_run_is_named_and_can_be_made_anew(
    planned, reference
):
    (line,) = outcome(planned, shutil.rmtree)
    assert f"{planned} was deleted or renamed" in line
    assert same_bits(make(planned), reference)


def test_a_manifest_deleted_during_a_run_is_named_and_the_run_goes_on_with_it_back(
    planned, reference, tmp_path
):
    kept = tmp_path / "kept.json"
    (line,) = outcome(
        planned, lambda out: (out / "manifest.json").rename(kept), at=N_SHARDS
    )
    assert f"{planned / 'manifest.json'} was deleted or renamed" in line
    kept.rename(planned / "manifest.json")
    assert resume(planned) == 0
    assert same_bits(planned, reference)


def test_the_configuration_lost_during_a_run_is_named(planned):
    (line,) = outcome(planned, lambda out: (out / "overrides.yaml").unlink())
    assert line.endswith("overrides.yaml is missing; restore it from a copy")
    assert resume(planned) == 2


@pytest.mark.parametrize(
    "part", ["shards/shard-00002.h5", "shards/.shard-00002.h5.done"]
)
def test_a_task_of_an_array_job_names_what_it_lost(planned, reference, part):
    first = ArrayExecutor(shard_index=0, shard_count=2, n_workers=1)
    second = ArrayExecutor(shard_index=1, shard_count=2, n_workers=1)
    (line,) = run(planned, lambda out: (out / part).unlink(), at=3, executor=first)
    assert "shard-00002.h5 or its receipt is missing" in line
    assert run(planned, at=1, executor=first) == []
    assert run(planned, at=3, executor=second) == []
    assert main(["finalize", str(planned)]) == 0
    assert same_bits(planned, reference)


LONGER = ("plan.n_records=40", "operating.duration_s=0.2")


def test_the_command_ends_with_a_line_for_a_shard_that_was_deleted(tmp_path):
    """The process is held still while its folder is changed."""
    out = tmp_path / "data"
    words = ["generate", "--quiet", *TINY, *LONGER, "executor.n_workers=1"]
    process = subprocess.Popen(
        [sys.executable, "-m", "gensig.cli", *words, f"out={out}"],
        stderr=subprocess.PIPE,
        text=True,
    )
    while not shard_path(out, 1).is_file():
        assert process.poll() is None
        time.sleep(0.001)
    process.send_signal(signal.SIGSTOP)
    assert not read_manifest(out).is_complete
    before = sha256_file(shard_path(out, 0))
    shard_path(out, 0).unlink()
    process.send_signal(signal.SIGCONT)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 1
    first, advice = said.splitlines()
    assert "shard 0: shard-00000.h5 is missing" in first
    assert "gensig resume" in advice
    assert resume(out) == 0
    assert sha256_file(shard_path(out, 0)) == before
    assert verify(out).problems == []


RESTORED = {
    "shards/shard-00003.h5": lambda path: path.unlink(),
    "shards/shard-00004.h5": lambda path: os.truncate(path, 1000),
    "shards": shutil.rmtree,
    SPLIT: lambda path: path.unlink(),
    "splits": shutil.rmtree,
    "plan.csv": lambda path: path.unlink(),
    "index.h5": lambda path: path.unlink(),
}


def everything(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize("name", RESTORED)
def test_resume_of_a_complete_set_makes_again_what_is_lost_and_changes_nothing_else(
    data, name
):
    before = everything(data)
    RESTORED[name](data / name)
    assert verify(data).problems
    assert resume(data) == 0
    assert everything(data) == before


@pytest.mark.parametrize(
    "name", ["config.yaml", "README.md", "SHA256SUMS", "run.log", "croissant.json"]
)
def test_resume_of_a_complete_set_names_what_it_cannot_make_again(data, name, capsys):
    (data / name).unlink()
    before = everything(data)
    capsys.readouterr()
    assert resume(data) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{name} is missing" in line
    assert everything(data) == before


def test_reuse_makes_a_lost_shard_again(data):
    before = everything(data)
    shard_path(data, 5).unlink()
    words = {"workers": 1, "progress": False, "reuse": True}
    with gensig.generate(*TINY, out=data, **words) as opened:
        assert opened.signals(5).shape[0] == 1
    assert everything(data) == before


def test_a_lost_shard_with_other_bits_is_not_put_in_its_place(data, capsys):
    """As on a machine that computes other bits: the manifest lists another digest."""
    path = data / "manifest.json"
    content = json.loads(path.read_text())
    content["shards"][2]["sha256"] = "0" * 64
    old = sha256_file(path)
    path.write_text(json.dumps(content))
    sums = data / "SHA256SUMS"
    text = sums.read_text().replace(old, sha256_file(path))
    sums.write_text(text.replace(sha256_file(shard_path(data, 2)), "0" * 64))
    shard_path(data, 2).unlink()
    before = everything(data)
    capsys.readouterr()
    assert resume(data) == 1
    assert "shard-00002.h5 was lost and has other bits" in capsys.readouterr().err
    assert everything(data) == before


def test_a_shard_with_one_row_of_another_is_not_made(tmp_path):
    """Rows of the manifest that were moved from the second shard to the first."""
    out, words = tmp_path / "data", [*TINY, "dataset.records_per_shard=3"]
    begin_folder(read_request(words).config, words, out)
    content = json.loads((out / "manifest.json").read_text())
    for shard, n_rows in zip(content["shards"], (4, 2), strict=True):
        shard["rows"] = n_rows
    (out / "manifest.json").write_text(json.dumps(content))
    with pytest.raises(DatasetError, match="the manifest disagree on shard 0"):
        write_shard(out, 0)
    assert not shard_path(out, 0).exists()
