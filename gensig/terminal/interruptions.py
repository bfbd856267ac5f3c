"""SIGTERM as an interruption: what a run has begun is ended as by Ctrl-C, and one line says so."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED, TERMINATED = 130, 143
AGAIN = (
    "run the same command again; a folder that it left is incomplete, remove it first"
)


class Stop:
    """The signal that stopped a command, as far as one has; its exit status and its name."""

    status = INTERRUPTED
    name = "interrupted"

    def line(self, remedy: str) -> str:
        """Line for stderr: what stopped the command, what is kept, and what to do."""
        return f"{self.name}; {remedy or AGAIN}"


@contextmanager
def terminable() -> Iterator[Stop]:
    """Raise KeyboardInterrupt where SIGTERM comes within the block; the yielded `Stop` says so.

    A second SIGTERM is ignored, because `timeout` and batch systems send several. Where another
    handler is set, as by a program that calls the command, and in threads, nothing changes. A
    forked child dies as it would without the handler.
    """
    stop, process = Stop(), os.getpid()

    def handle(number: int, _frame: FrameType | None) -> None:
        if os.getpid() != process:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
            return
        if stop.status == TERMINATED:
            return
        stop.status, stop.name = TERMINATED, "stopped by SIGTERM"
        raise KeyboardInterrupt

    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield stop
        return
    signal.signal(signal.SIGTERM, handle)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
