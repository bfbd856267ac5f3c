"""Ctrl-C and SIGTERM: one line that says what is kept and what to do, and a status of its own."""

import os
import signal
import threading

import pytest

from gensig.errors import Interrupted
from gensig.terminal.interruptions import AGAIN
from gensig.terminal.program import guarded


@pytest.fixture(autouse=True)
def plain_disposition():
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    yield
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    signal.signal(signal.SIGTERM, before)


def terminated():
    os.kill(os.getpid(), signal.SIGTERM)
    raise AssertionError("the signal came too late")


def terminated_with_remedy():
    try:
        terminated()
    except KeyboardInterrupt:
        os.kill(os.getpid(), signal.SIGTERM)  # as timeout does, which sends two
        raise Interrupted("a is incomplete, resume it") from None


def interrupted():
    raise KeyboardInterrupt


@pytest.mark.parametrize("program", ["gensig", "diagnose"])
@pytest.mark.parametrize(
    ("run", "status", "line"),
    [
        (terminated, 143, f"stopped by SIGTERM; {AGAIN}"),
        (terminated_with_remedy, 143, "stopped by SIGTERM; a is incomplete, resume it"),
        (interrupted, 130, f"interrupted; {AGAIN}"),
    ],
)
def test_a_signal_is_one_line(program, run, status, line, capsys):
    assert guarded(program, run) == status
    assert capsys.readouterr().err == f"{program}: {line}\n"


def test_a_handler_of_the_calling_program_stays():
    seen = []
    signal.signal(signal.SIGTERM, lambda *_: seen.append(1))
    assert guarded("gensig", lambda: os.kill(os.getpid(), signal.SIGTERM) or 0) == 0
    assert seen == [1]
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def test_in_a_thread_nothing_is_set():
    result = []
    thread = threading.Thread(
        target=lambda: result.append(guarded("gensig", lambda: 3))
    )
    thread.start()
    thread.join()
    assert result == [3]


def test_a_forked_child_dies_of_the_signal():
    def fork_and_end():
        child = os.fork()
        if child == 0:
            os.kill(os.getpid(), signal.SIGTERM)
            os._exit(0)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGTERM

    assert guarded("gensig", fork_and_end) == 1
