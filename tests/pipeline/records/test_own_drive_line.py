"""The example of docs/howto/your_drive_line.md from two tables to records: its files and its
commands, made short."""

import shlex

import h5py
import pytest
from docs_pages import ROOT, blocks

from gensig.cli import main

PAGE = "your_drive_line.md"
SHORT = (
    "operating.duration_s=0.1",
    "plan.n_records=8",
    "plan.n_units=2",
    "plan.n_gearboxes=1",
    "plan.n_repeats=1",
)
FOUND = list(blocks((ROOT / "docs" / "howto" / PAGE).read_text(encoding="utf-8")))
PYTHON, TYPED = (block.code for block in FOUND if "test_own_drive_line" in block.mark)
COMMANDS = TYPED.replace("\\\n", " ").splitlines()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The files of the page, under their names."""
    folder = tmp_path_factory.mktemp("own")
    for block in FOUND:
        if block.mark.startswith("file "):
            path = folder / block.mark.removeprefix("file ")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.code + "\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize("line", COMMANDS, ids=lambda line: line.split()[1])
def test_commands_of_the_page_run(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    words = shlex.split(line)[1:]
    short = {"generate": SHORT, "simulate": SHORT[:1]}.get(words[0], ())
    assert main([*words, *short]) == 0, capsys.readouterr().err
    if words[0] == "generate":
        with h5py.File(
            folder / "runs" / "my_records" / "shards" / "shard-00000.h5"
        ) as file:
            assert {value.decode() for value in file["status"][:]} == {"ok"}


def test_python_of_the_page_runs(capsys):
    exec(compile(PYTHON, PAGE, "exec"), {})
    assert capsys.readouterr().out.startswith("[")
