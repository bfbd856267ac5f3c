"""The door to the terminal: whatever is printed, no foreign character controls it."""

import io
import json
import sys
import warnings
from functools import partial

import pytest
from rich.console import Console

from diagnose.progress import _bar, progress
from gensig.commands.console import remark, step
from gensig.dataset.folder.layout import LOG
from gensig.dataset.folder.run_log import log
from gensig.errors import ConfigError
from gensig.terminal import run_progress
from gensig.terminal.printing import show, show_text, tell, tell_text
from gensig.terminal.program import guarded
from gensig.terminal.warning_lines import one_line_warnings

HOSTILE = "crack\x1b[2K\r\x9b1m\u202e\u2028\nforged: all is whole"
SHOWN = "crack\\x1b[2K\\r\\x9b1m\\u202e\\u2028\\nforged: all is whole"
BEGINNING = "[0/1] training; each step tells a line when it is done\n"
ON_ONE_LINE = SHOWN.replace("\\n", " ")


def test_lines_are_escaped_and_those_of_the_program_stay(capsys):
    show("one", HOSTILE)
    tell("two", HOSTILE)
    show_text("a\n  b\n")
    tell_text("c\n")
    printed = capsys.readouterr()
    assert printed.out == f"one\n{SHOWN}\na\n  b\n"
    assert printed.err == f"two\n{SHOWN}\nc\n"


def test_json_keeps_its_values(capsys):
    show_text(json.dumps({"name": HOSTILE}, indent=1))
    printed = capsys.readouterr().out
    assert printed.isascii()
    assert json.loads(printed) == {"name": HOSTILE}


def test_a_terminal_that_lacks_a_letter_shows_its_number(monkeypatch):
    file = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", file)
    show("\u00b5m")
    assert file.buffer.getvalue() == b"\\xb5m\n"


def fail(_text=HOSTILE):
    raise ConfigError(_text)


def lose(_text=HOSTILE):
    raise FileNotFoundError(2, "No such file", _text)


def warn():
    with one_line_warnings("gensig"):
        warnings.warn(HOSTILE, stacklevel=1)


def work():
    with progress(1) as advance:
        advance(HOSTILE)


@pytest.mark.parametrize(
    "act",
    [
        lambda: guarded("gensig", fail),
        lambda: guarded("diagnose", lose),
        warn,
        work,
        lambda: remark(HOSTILE),
        lambda: step(HOSTILE),
    ],
)
def test_what_goes_to_stderr_is_one_line(act, capsys):
    act()
    printed = capsys.readouterr().err.removeprefix(BEGINNING)
    assert printed.count("\n") == 1
    assert printed.removesuffix("\n").isprintable()
    assert SHOWN in printed or ON_ONE_LINE in printed


@pytest.fixture
def terminal(monkeypatch):
    """Text that is shown on a terminal."""
    shown = io.StringIO()
    console = partial(Console, file=shown, force_terminal=True, width=200)
    monkeypatch.setattr("rich.console.Console", lambda stderr: console())
    monkeypatch.setattr(run_progress, "_is_interactive", lambda: True)
    return shown


def test_the_bar_of_a_run_counts_records_of_all(terminal):
    with run_progress.RunProgress(quiet=False, n_records=8) as on_shard:
        for n_done in (0, 3):
            state = run_progress.Progress(
                n_done=n_done,
                n_records=8,
                n_failed=0,
                n_made=n_done,
                n_bytes=100,
                reason="",
            )
            on_shard(state)
    assert "3/8" in terminal.getvalue()


def test_the_bar_shows_brackets_of_a_name_as_they_are(terminal):
    with _bar(2, "training") as advance:
        advance("set [bold]a[/bold]")
    assert "set [bold]a[/bold]" in terminal.getvalue()
    assert "1/2" in terminal.getvalue()


def test_the_log_of_a_run_is_escaped(tmp_path):
    log(tmp_path, HOSTILE)
    (line,) = (tmp_path / LOG).read_text().split("\n")[:-1]
    assert line.endswith(ON_ONE_LINE)
