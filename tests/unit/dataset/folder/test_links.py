"""Symbolic links in the folder of a data set, which every reader and verb refuses."""

import os
import shutil
import signal

import pytest
from dataset_samples import build, make_plan
from refusals import refused

from gensig.cli import main
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.inspection import inspect
from gensig.dataset.folder.layout import read_config
from gensig.dataset.folder.run_log import log
from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.dataset.splitting.splits import read_split
from gensig.errors import DatasetError

NAMES = (
    "manifest.json",
    "config.yaml",
    "overrides.yaml",
    "plan.csv",
    "index.h5",
    "README.md",
    "croissant.json",
    "run.log",
    "SHA256SUMS",
    "splits",
    "splits/by_unit.csv",
    "shards",
    "shards/shard-00002.h5",
    "figures",
    "figures/1-crack.png",
)
VERBS = ("resume", "finalize", "inspect", "reproduce", "report")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole") / "set"
    build(out, make_plan(), close=False, labelled=True)
    log(out, "one line")
    finalize(out)
    return out


@pytest.fixture
def folder(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "set")


def linked(folder, name, target):
    """Put a part of a folder to another name, with a link in its place."""
    (folder / name).rename(target)
    (folder / name).symlink_to(target, target_is_directory=target.is_dir())


@pytest.mark.parametrize("inside", [False, True], ids=["outside", "inside"])
@pytest.mark.parametrize("name", NAMES)
def test_a_link_is_refused_in_one_line_wherever_the_folder_is_read(
    folder, tmp_path, capsys, name, inside
):
    target = (folder if inside else tmp_path) / "kept"
    linked(folder, name, target)
    line = f"{folder / name} is a symbolic link"
    for read in (open_dataset, inspect):
        with refused(name, DatasetError) as caught:
            read(folder)
        assert str(caught.value).startswith(line)
    assert [problem[: len(line)] for problem in verify(folder).problems] == [line]
    export = ["export", str(folder), "--to", "npz", "--out", str(tmp_path / "x.npz")]
    for words in (*([verb, str(folder)] for verb in VERBS), export):
        capsys.readouterr()
        assert main(words) == 2
        (said,) = capsys.readouterr().err.splitlines()
        assert line in said
    assert main(["verify", str(folder)]) == 1
    assert line in capsys.readouterr().out


@pytest.fixture
def impatient():
    """The test ends where a pipe is waited for."""
    signal.alarm(60)
    yield
    signal.alarm(0)


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("name", NAMES)
def test_a_pipe_in_place_of_a_part_is_refused_in_one_line(
    folder, tmp_path, capsys, name
):
    path = folder / name
    path.rename(tmp_path / "kept")
    os.mkfifo(path)
    line = f"{path} is no ordinary f"
    for verb in ("resume", "inspect"):
        assert main([verb, str(folder)]) == 2
        (said,) = capsys.readouterr().err.splitlines()
        assert line in said
    with refused("is no ordinary f", DatasetError):
        open_dataset(folder)
    if name != "manifest.json":
        assert [problem[: len(line)] for problem in verify(folder).problems] == [line]


@pytest.mark.parametrize("name", ["plan.csv", "index.h5", "run.log"])
def test_a_folder_in_place_of_a_file_is_refused(folder, name):
    (folder / name).unlink()
    (folder / name).mkdir()
    with refused(f"{name} is no ordinary file", DatasetError):
        open_dataset(folder)


def test_links_that_are_no_part_of_the_set_are_left_alone(folder, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (folder / "notes.txt").symlink_to(tmp_path / "notes.txt")
    (tmp_path / "name").symlink_to(folder)
    for path in (folder, tmp_path / "name"):
        assert verify(path).problems == []
        with open_dataset(path) as data:
            assert data.split("by_unit")["train"]
            assert data.signals(35).shape == (2, 200)


@pytest.mark.parametrize(
    ("name", "read"),
    [
        (
            "splits/by_unit.csv",
            lambda folder: read_split(folder / "splits/by_unit.csv"),
        ),
        ("config.yaml", read_config),
    ],
)
def test_a_link_made_after_the_look_at_the_names_is_not_followed(
    folder, tmp_path, name, read
):
    read(folder)
    linked(folder, name, tmp_path / "kept")
    with refused("is a symbolic link", DatasetError):
        read(folder)


def test_the_log_writes_through_no_link(folder, tmp_path):
    linked(folder, "run.log", tmp_path / "kept")
    before = (tmp_path / "kept").read_text()
    log(folder, "outside")
    assert (tmp_path / "kept").read_text() == before
