"""A recording that crashes its reader: every command that takes recordings says so in a line."""

import numpy as np
import pytest
from scipy import io

import diagnose.cli
import gensig.cli
from gensig.signals import recording

PAIR = ("--teeth", "23", "46")
COMMANDS = {
    "predict": (diagnose.cli.main, ["predict", "r.mat", *PAIR, "--speed-rpm", "1800"]),
    "twin": (gensig.cli.main, ["twin", "r.mat", *PAIR, "--speed", "1800"]),
    "check": (
        gensig.cli.main,
        ["twin", "good.mat", *PAIR, "--speed", "1800", "--check", "r.mat"],
    ),
}
DATA_TYPE = 192  # byte of a .mat file of version 5: type of the first array's values


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A good recording, and one with a byte that makes scipy 1.17 read anywhere."""
    monkeypatch.chdir(tmp_path)
    signal = np.random.default_rng(1).standard_normal((1, 20_000))
    content = {"acceleration": signal, "sampling_rate_hz": 12_800.0}
    io.savemat("good.mat", content)
    data = bytearray((tmp_path / "good.mat").read_bytes())
    data[DATA_TYPE] = 0xC1
    (tmp_path / "r.mat").write_bytes(data)
    return tmp_path


@pytest.mark.parametrize("name", COMMANDS)
def test_the_command_answers_in_one_line(name, files, capsys):
    main, words = COMMANDS[name]
    if main is gensig.cli.main:
        words = [*words, "--out", "mine"]
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "r.mat cannot be read: it" in line
    assert not (files / "mine").exists()


@pytest.mark.parametrize("name", COMMANDS)
def test_a_crash_for_certain_is_one_line(name, files, capsys, monkeypatch):
    """The reader of .mat files is one that reads nowhere."""
    monkeypatch.setattr(recording, "READER_MODULE", "crashing_reader")
    (files / "crashing_reader.py").write_text(
        "import ctypes\n\n\ndef read(file, array):\n    ctypes.string_at(0)\n"
    )
    monkeypatch.syspath_prepend(files)
    monkeypatch.setitem(recording.READERS, ".mat", "read")
    main, words = COMMANDS[name]
    if main is gensig.cli.main:
        words = [*words, "--out", "mine"]
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert ".mat cannot be read: its reader crashed (SIGSEGV)" in line
