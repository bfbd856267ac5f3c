"""Compilation of kernels by Numba, which happens once for a kind of machine and takes seconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

_watching: list[tuple[Callable[[], None], Callable[[float], None]]] = []


def _ignore(_seconds: float) -> None:
    """Take no notice of the end of a compilation."""


@contextmanager
def on_compilation(
    begun: Callable[[], None], ended: Callable[[float], None] = _ignore
) -> Iterator[None]:
    """Call functions at the begin and the end of every compilation within the block.

    Parameters
    ----------
    begun : called before a kernel is compiled, with those that it calls
    ended : called after it, with the seconds that it took
    """
    watch = begun, ended
    _watching.append(watch)
    try:
        yield
    finally:
        _watching.remove(watch)


def readable(load: Callable[[], dict[Any, Any]]) -> dict[Any, Any]:
    """The index of a cache on the disk; empty where another version wrote it of types of its own.

    ``load`` reads it.
    """
    try:
        return load()
    except (AttributeError, ImportError):
        return {}


@cache
def watch() -> None:
    """Notice compilations from now on; modules with kernels call it when they are imported.

    A kernel that is read from the cache on the disk is not compiled.
    """
    from numba.core import event

    class Listener(event.Listener):
        depth = 0  # of kernels that are compiled for others
        start = 0.0

        def on_start(self, event: object) -> None:
            self.depth += 1
            if self.depth > 1:
                return
            self.start = time.monotonic()
            for begun, _ in _watching.copy():
                begun()

        def on_end(self, event: object) -> None:
            self.depth -= 1
            if self.depth:
                return
            seconds = time.monotonic() - self.start
            for _, ended in _watching.copy():
                ended(seconds)

    event.register("numba:compile", Listener())
