"""Independent calls on every core, each with one thread: same results for any number of workers."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from gensig.errors import GensigError
from gensig.text.escaping import set_warning_lines

# glibc, malloc.h: above which size a block has pages of its own, and how much freed memory
# at the end of the heap goes back to the system
_MALLOPT = {"M_TRIM_THRESHOLD": -1, "M_MMAP_THRESHOLD": -3}
_KEPT_BYTES = 1 << 30

_worker: dict[str, Any] = {}


def n_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


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

    The calls run in spawned processes, or in this one for one worker or one item.

    Parameters
    ----------
    on_done : is given each item and its result as soon as it is there
    remedy : advice of the error where a process was killed

    Raises
    ------
    GensigError    as raised by a call, or if a process was killed
    """
    results = []
    if n_workers == 1 or len(items) == 1:
        keep_freed_memory()
        with one_thread():
            for item in items:
                results.append(function(*shared, item))
                on_done(item, results[-1])
        return results
    before = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(
        min(n_workers, len(items)), context, _start, (function, shared)
    )
    try:
        futures = {executor.submit(_call, item): item for item in items}
        for future in as_completed(futures):
            on_done(futures[future], future.result())
        return [future.result() for future in futures]
    except KeyboardInterrupt:
        # SIGTERM reaches this process alone: no call is waited for.
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    except BrokenProcessPool:
        reason = f"a worker process was killed (out of memory?); {remedy}"
        raise GensigError(reason) from None
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


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


def _start(function: Callable[..., Any], shared: Sequence[Any]) -> None:
    set_warning_lines("diagnose")
    keep_freed_memory()
    limit = one_thread()
    limit.__enter__()
    _worker.update(function=function, shared=shared, limit=limit)


def _call(item: Any) -> Any:
    return _worker["function"](*_worker["shared"], item)
