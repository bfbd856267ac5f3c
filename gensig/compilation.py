"""Compilation of kernels by Numba, which happens once on a machine and takes seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

_waiting: list[Callable[[], None]] = []


@contextmanager
def on_compilation(tell: Callable[[], None]) -> Iterator[None]:
    """Call ``tell`` when the first kernel is compiled within the block, and not again."""
    _waiting.append(tell)
    try:
        yield
    finally:
        if tell in _waiting:
            _waiting.remove(tell)


@cache
def watch() -> None:
    """Notice compilations from now on; modules with kernels call it when they are imported.

    A kernel that is read from the cache on the disk is not compiled.
    """
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, event: object) -> None:
            waiting = _waiting.copy()
            _waiting.clear()
            for tell in waiting:
                tell()

        def on_end(self, event: object) -> None:
            pass

    event.register("numba:compile", Listener())
