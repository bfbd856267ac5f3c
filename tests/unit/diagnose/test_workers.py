"""Laws of the processes that train and judge."""

from __future__ import annotations

import multiprocessing
import os
import platform
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks._process_groups import alive_in_group
from diagnose.workers import call_all
from gensig.errors import GensigError

PAGE_FAULTS = """
import resource, sys
import numpy as np
from diagnose.workers import keep_freed_memory

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    np.ones(500_000).sum()
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

if sys.argv[1] == "keep":
    assert keep_freed_memory()
faults()
print(faults())
"""


def page_faults(mode: str) -> int:
    """Pages that a second large array asks of the system, after a first one was freed."""
    command = [sys.executable, "-c", PAGE_FAULTS, mode]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc", reason="the C library is not glibc"
)
def test_a_freed_large_array_is_used_again_without_new_pages() -> None:
    assert page_faults("keep") < 50
    assert page_faults("return") > 500


NAP = """
import time

def nap(_shared, seconds):
    time.sleep(seconds)
"""
# what workers share is more than a pipe holds, as the columns of a data set are
SLEEPERS = """
import sys
from nap import nap
from diagnose.workers import call_all
from gensig.terminal.program import guarded

def run():
    shared = (bytes(10_000_000),)
    call_all(nap, shared, (600, 600), n_workers=2, on_done=print, remedy="")

if __name__ == "__main__":
    sys.exit(guarded("diagnose", run))
"""


def heed_interrupts() -> None:
    """Undo the disposition that a child of a background job inherits."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.parametrize("of_group", [False, True])
@pytest.mark.parametrize(
    ("number", "status", "said_first"),
    [
        (signal.SIGINT, 130, "diagnose: interrupted; "),
        (signal.SIGTERM, 143, "diagnose: stopped by SIGTERM; "),
    ],
)
def test_a_signal_while_workers_start_is_one_line_and_leaves_none(
    tmp_path, number, status, said_first, of_group
) -> None:
    """As from a terminal, which signals the group, and from a batch system, the parent."""
    script = tmp_path / "sleepers.py"
    script.write_text(SLEEPERS)
    (tmp_path / "nap.py").write_text(NAP)
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heed_interrupts,
    )
    while sum("spawn_main" in words for words in alive_in_group(process.pid)) < 2:
        assert process.poll() is None
        time.sleep(0.005)
    send = os.killpg if of_group else os.kill
    send(process.pid, number)
    _, said = process.communicate(timeout=120)
    assert process.returncode == status
    (line,) = said.splitlines()
    assert line.startswith(said_first)
    deadline = time.monotonic() + 60.0
    while left := alive_in_group(process.pid):
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


def once_dead(notes: Path, number: int) -> int:
    """The number; the process of number 1 dies as often as the folder of notes says."""
    if number == 1 and len(list(notes.iterdir())) < 2:
        (notes / f"{os.getpid()}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def poisoned(number: int) -> int:
    if number:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_call_whose_worker_was_killed_runs_again_and_an_error_says_so_in_the_end(
    tmp_path,
) -> None:
    calls = {"n_workers": 2, "on_done": lambda *_: None, "remedy": "use fewer"}
    assert call_all(once_dead, (tmp_path,), (0, 1, 2), **calls) == [0, 1, 2]
    with pytest.raises(
        GensigError, match=r"died 3 times \(out of memory\?\); use fewer"
    ):
        call_all(poisoned, (), (0, 1), **calls)
    for worker in multiprocessing.active_children():  # one may just be ending
        worker.join(timeout=10.0)
    assert multiprocessing.active_children() == []
