"""Laws of the processes that train and judge."""

from __future__ import annotations

import platform
import subprocess
import sys
import time

import pytest

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


SLEEPERS = """
import sys, time
from diagnose.workers import call_all
from gensig.terminal.program import guarded

def run():
    print("begun", flush=True)
    call_all(time.sleep, (), (600, 600), n_workers=2, on_done=print, remedy="")

if __name__ == "__main__":
    sys.exit(guarded("diagnose", run))
"""


def test_sigterm_waits_for_no_call(tmp_path) -> None:
    """The signal reaches the parent alone, as from a batch system."""
    script = tmp_path / "sleepers.py"
    script.write_text(SLEEPERS)
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.0)  # its workers are starting or asleep
    process.terminate()
    _, said = process.communicate(timeout=120)
    assert process.returncode == 143
    (line,) = said.splitlines()
    assert line.startswith("diagnose: stopped by SIGTERM; ")
