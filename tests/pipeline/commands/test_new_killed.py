"""New options whose writing is killed: whole or absent, and taken as they are by the next call."""

import os
import signal

import pytest

from gensig.cli import main
from gensig.commands.new import option_files
from gensig.commands.new.option_files import check_free, write_options
from gensig.errors import ConfigError

TEXTS = {"gear": "n_teeth: 20\n" * 50, "experiment": "seed: 1\n"}


def files_in(folder):
    return {folder / group / "mine.yaml": text for group, text in TEXTS.items()}


def killed_before(number, work):
    """Do the work in a process that is killed before its fsync or rename of that number."""
    process = os.fork()
    if process == 0:
        left = [number]

        def deadly(real):
            def change(*words):
                left[0] -= 1
                if left[0] < 0:
                    os.kill(os.getpid(), signal.SIGKILL)
                return real(*words)

            return change

        for name in ("fsync", "replace"):
            setattr(os, name, deadly(getattr(os, name)))
        try:
            work()
        finally:
            os._exit(0)
    return os.WIFSIGNALED(os.waitpid(process, 0)[1])


def states(tmp_path):
    """Files of options after a kill at each change in turn."""
    for number in range(100):
        files = files_in(tmp_path / f"{number}")
        if not killed_before(number, lambda files=files: write_options(files)):
            return
        yield files


def test_killed_at_any_change_the_same_call_finishes_it(tmp_path):
    n_killed = 0
    for files in states(tmp_path):
        gear, experiment = files
        assert all(file.read_text() == files[file] for file in files if file.exists())
        assert gear.exists() or not experiment.exists()
        check_free(files)
        write_options(files)
        assert {file: file.read_text() for file in files} == files
        n_killed += 1
    assert n_killed == 6


def test_files_that_are_written_in_place_would_be_refused(tmp_path, monkeypatch):
    def in_place(files, **_):
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("w") as file:
                file.write(text[:5])
                file.flush()
                os.fsync(file.fileno())
                file.write(text[5:])

    monkeypatch.setattr(option_files, "write_together", in_place)
    files = next(states(tmp_path))
    with pytest.raises(ConfigError, match="is there already"):
        check_free(files)


def test_a_gear_of_another_text_is_refused(tmp_path, capsys):
    gear = tmp_path / "gear" / "mine.yaml"
    gear.parent.mkdir()
    gear.write_text("n_teeth: 21\n")
    words = "new gearbox mine --teeth 20 45 --module 3 --speed 1500 --torque 60"
    assert main([*words.split(), "--dir", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{gear} is there already" in line
    assert not (tmp_path / "experiment").exists()
