"""The door for files of others: pipes, sockets, devices and folders never hang or pass."""

import os
import socket

import pytest
from refusals import refused

from gensig.cli import main
from gensig.dataset.storage.atomic import read_text
from gensig.errors import DatasetError
from gensig.text.ordinary_file import is_refused, open_ordinary
from gensig.text.user_file import open_table


def bound_socket(path):
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(path.name)


SPECIAL = {
    "pipe": os.mkfifo,
    "socket": bound_socket,
    "device": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.fixture(params=SPECIAL)
def special(request, tmp_path, monkeypatch):
    """A name of what is no ordinary file."""
    monkeypatch.chdir(tmp_path)  # the path of a socket is short
    SPECIAL[request.param](tmp_path / "given")
    return tmp_path / "given"


def test_what_is_no_file_is_refused_at_once(special):
    with refused("no ordinary file", OSError) as caught:
        open_ordinary(special)
    assert is_refused(caught.value)
    with refused("x = y cannot be read: it is no file"):
        open_table("x = y", special)


def test_a_file_a_folder_and_a_link(tmp_path):
    (tmp_path / "file").write_bytes(b"content")
    (tmp_path / "link").symlink_to("file")
    for name in ("file", "link"):
        with open_ordinary(tmp_path / name) as file:
            assert file.read() == b"content"
    with refused("symbolic links", OSError):
        open_ordinary(tmp_path / "link", follow_links=False)
    with pytest.raises(IsADirectoryError) as caught:
        open_ordinary(tmp_path)
    assert not is_refused(caught.value)


RECORDING = "given.csv"
VERBS = {
    "inspect": (["inspect", RECORDING], "no ordinary file"),
    "twin": (
        [
            *["twin", "--teeth", "23", "84", "--speed", "1800", "--out", "new"],
            RECORDING,
        ],
        "it is no file",
    ),
    "config": (["plan", "--config", "given.yaml"], "no ordinary file"),
    "table": (
        ["modes", "system=engine_gear_train", f"system.gears_csv={RECORDING}"],
        "no file",
    ),
    "option": (["options", "gear=given", "--config-dir", "own"], "is no file"),
}


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_names_a_pipe_in_one_line(verb, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own" / "gear").mkdir(parents=True)
    for name in (RECORDING, "given.yaml", "own/gear/given.yaml"):
        os.mkfifo(tmp_path / name)
    words, reason = VERBS[verb]
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "given" in line
    assert reason in line


def test_a_limit_takes_no_memory(tmp_path):
    """A limit far beyond the memory: what is read is the file."""
    path = tmp_path / "plan.csv"
    path.write_text("record_id\n")
    assert read_text(path, limit=2**45) == "record_id\n"
    with refused("has 10 bytes, at most 9", DatasetError):
        read_text(path, limit=9)
