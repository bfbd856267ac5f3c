"""Independent calls on every core, each with one thread: same results for any number of workers."""

from __future__ import annotations

import ctypes
import multiprocessing
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from typing import Any

from gensig.errors import GensigError
from gensig.execution.base import ShardFailure
from gensig.execution.pool import results_of
from gensig.text.escaping import set_warning_lines

# glibc, malloc.h: above which size a block has pages of its own, and how much freed memory
# at the end of the heap goes back to the system
_MALLOPT = {"M_TRIM_THRESHOLD": -1, "M_MMAP_THRESHOLD": -3}
_KEPT_BYTES = 1 << 30


def call_all(
    function: Callable[..., Any],
    shared: Sequence[Any],
    items: Sequence[Any],
    *,
    n_workers: int,
    on_done: Callable[[Any, Any], None],
    remedy: str,
) -> list[Any]:
    """Results of ``function(*shared, item)`` in the order of the items.

    The calls run as `gensig.execution.pool.results_of` says.

    Parameters
    ----------
    items : hashable, each once
    on_done : is given each item and its result as soon as it is there
    remedy : advice of the error where a process was killed

    Raises
    ------
    GensigError    as raised by a call, or if a process was killed again and again
    """
    call = partial(_call, function, tuple(shared))
    done: dict[Any, Any] = {}
    with closing(results_of(call, items, n_workers=n_workers)) as results:
        for item, result in results:
            if isinstance(result, ShardFailure):
                raise GensigError(f"{result.reason} (out of memory?); {remedy}")
            done[item] = result
            on_done(item, result)
    return [done[item] for item in items]


def _call(function: Callable[..., Any], shared: tuple[Any, ...], item: Any) -> Any:
    """Result of one call on one thread."""
    if multiprocessing.parent_process() is not None:
        set_warning_lines("diagnose")
    keep_freed_memory()
    with one_thread():
        return function(*shared, item)


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread for the BLAS, and for torch where it is loaded; as before afterwards."""
    from threadpoolctl import threadpool_limits

    torch = sys.modules.get("torch")
    with threadpool_limits(1):
        if torch is None:
            yield
            return
        before = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(before)


def keep_freed_memory() -> bool:
    """True if this process now keeps the memory that it frees, for its next arrays.

    A training step frees its large arrays and asks for the same ones in the next step. glibc
    gives such blocks back to the system, which then hands out every page anew: a fifth of the
    time of a step. Nothing changes where the C library has no ``mallopt``.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return all(bool(mallopt(option, _KEPT_BYTES)) for option in _MALLOPT.values())
