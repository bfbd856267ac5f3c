"""A command in a copy of this process, with something that happens at its k-th file operation.

Operations are those that change a folder: files opened for writing, fsync, rename, and folders and
files that are made or removed. An audit hook of the copy counts them; the code that is tested knows
nothing of it.
"""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gensig.cli import main as gensig

LONGEST = 300.0  # s; a command that takes longer hangs
MAKING = {"open", "os.mkdir", "os.fsync"}  # what a full disk refuses
CHANGING = MAKING | {"os.rename", "os.remove", "os.rmdir", "os.truncate"}

Act = Callable[[int, str], None]


def kill_at(number: int) -> Act:
    """SIGKILL before the operation of that number, from 1."""

    def act(count: int, _event: str) -> None:
        if count == number:
            os.kill(os.getpid(), signal.SIGKILL)

    return act


def refuse_from(number: int, code: int) -> Act:
    """A disk that refuses from the operation of that number on, with that number of an error."""
    refused = MAKING if code == errno.ENOSPC else CHANGING

    def act(count: int, event: str) -> None:
        if count >= number and event in refused:
            raise OSError(code, os.strerror(code))

    return act


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """End of a command: exit status, negative for a signal; its lines on stderr; operations."""

    status: int
    said: str
    n_operations: int


def run_command(words: Sequence[str], folder: Path, act: Act | None = None) -> Ended:
    """Run ``gensig`` in a copy of this process, in a folder that holds all that it changes."""
    told = folder.with_name(f"{folder.name}.told")
    process = multiprocessing.get_context("fork").Process(
        target=_run, args=(tuple(words), folder, told, act)
    )
    process.start()
    process.join(LONGEST)
    if process.exitcode is None:
        process.kill()
        process.join()
        raise TimeoutError(f"gensig {' '.join(words)} hangs")
    said, _, count = told.read_text(encoding="utf-8").partition("\0")
    told.unlink()
    return Ended(status=process.exitcode, said=said, n_operations=int(count or 0))


def _run(words: tuple[str, ...], folder: Path, told: Path, act: Act | None) -> None:
    file = os.open(told, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(file, 2)
    sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
    os.chdir(folder)
    count = _counted(folder, act)
    status = gensig(words)
    sys.stderr.flush()
    os.write(file, f"\0{count()}".encode())
    os._exit(status)


def _counted(folder: Path, act: Act | None) -> Callable[[], int]:
    """Install the hook; returns the number of operations so far."""
    inside, n_done = f"{folder.resolve()}{os.sep}", 0

    def happens(event: str) -> None:
        nonlocal n_done
        n_done += 1
        if act is not None:
            act(n_done, event)

    def hook(event: str, values: tuple[Any, ...]) -> None:
        if event not in CHANGING or not isinstance(
            values[0], str | bytes | os.PathLike
        ):
            return
        if event == "open" and not values[2] & (os.O_WRONLY | os.O_RDWR):
            return
        if os.path.abspath(os.fsdecode(values[0])).startswith(inside):
            happens(event)

    fsync = os.fsync

    def counted_fsync(descriptor: int) -> None:
        happens("os.fsync")
        fsync(descriptor)

    os.fsync = counted_fsync
    sys.addaudithook(hook)
    return lambda: n_done
