"""Shards on processes of this machine, with replacement of a process that dies."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, resource_tracker
from typing import Any

from gensig.execution.base import (
    THREAD_VARIABLES,
    TRIES,
    Executor,
    ShardFailure,
    T,
    guarded,
)
from gensig.text.escaping import set_warning_lines


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalExecutor(Executor):
    """Processes of this machine; with one worker, or one shard, everything runs in this process."""

    n_workers: int

    @property
    def n_processes(self) -> int:
        """Shards that are made at a time."""
        return self.n_workers

    def run(
        self, job: Callable[[int], T], shard_indices: Sequence[int]
    ) -> Iterator[tuple[int, T | ShardFailure]]:
        """See ``Executor.run``."""
        if self.n_workers == 1 or len(shard_indices) <= 1:
            for index in shard_indices:
                yield index, guarded(job, index)
            return
        before = set(multiprocessing.active_children())
        waiting, tries = deque(shard_indices), Counter[int]()
        # A pool a worker: when one dies, it is known which shard it had in hand.
        idle = [_worker() for _ in range(min(self.n_workers, len(waiting)))]
        at_work: dict[Future[T | ShardFailure], tuple[ProcessPoolExecutor, int]] = {}
        try:
            while waiting or at_work:
                while waiting and idle:
                    worker, index = idle.pop(), waiting.popleft()
                    worker, future = _submit(worker, job, index)
                    at_work[future] = worker, index
                for future in wait(at_work, return_when=FIRST_COMPLETED).done:
                    worker, index = at_work.pop(future)
                    try:
                        result = future.result()
                    except BrokenProcessPool:
                        worker.shutdown(wait=False)
                        worker = _worker()
                        tries[index] += 1
                        if tries[index] < TRIES:
                            waiting.append(index)
                            idle.append(worker)
                            continue
                        result = ShardFailure(
                            reason=f"its worker process died {TRIES} times"
                        )
                    idle.append(worker)
                    yield index, result
        except BaseException:
            # Interrupted: unfinished shards are temporary files.
            for process in set(multiprocessing.active_children()) - before:
                process.terminate()
            raise
        finally:
            for worker in [*idle, *(pool for pool, _ in at_work.values())]:
                worker.shutdown(cancel_futures=True)


def _worker() -> ProcessPoolExecutor:
    """A pool of one process, which starts with its first job."""
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        1, mp_context=context, initializer=_begin_worker, initargs=(_is_quiet(),)
    )


def _submit(
    worker: ProcessPoolExecutor, job: Callable[[int], T], index: int
) -> tuple[ProcessPoolExecutor, Future[T | ShardFailure]]:
    """Give a worker a job; one that died while it had none is replaced first."""
    with _interrupts_held(), _main_unknown():
        try:
            return worker, worker.submit(guarded, job, index)
        except BrokenProcessPool:
            worker.shutdown(wait=False)
            worker = _worker()
            return worker, worker.submit(guarded, job, index)


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Processes that start in this block never see Ctrl-C, which the parent answers."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # would lift the mask when it starts by itself
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _main_unknown() -> Iterator[None]:
    """Processes that start in this block do not run the user's script again to import it.

    A script that calls ``gensig.generate`` needs no ``if __name__ == "__main__"`` then: jobs are
    importable without it.
    """
    main = sys.modules["__main__"]
    # multiprocessing.spawn.get_preparation_data reads these two.
    names = {"__spec__", "__file__"} & vars(main).keys()
    hidden: dict[str, Any] = {name: vars(main)[name] for name in names}
    main.__spec__ = None
    vars(main).pop("__file__", None)
    try:
        yield
    finally:
        main.__dict__.update(hidden)


def _is_quiet() -> bool:
    """True where this process shows no warnings, as with ``--quiet``."""
    first = warnings.filters[0] if warnings.filters else ("default", None, None)
    return first[0] == "ignore" and first[2] is UserWarning


def _begin_worker(is_quiet: bool) -> None:
    """Leave Ctrl-C to the parent, show warnings as it does, and end when the parent ends."""
    set_warning_lines("gensig")
    if is_quiet:
        warnings.simplefilter("ignore", UserWarning)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: Any) -> None:
    connection.wait([sentinel])
    os._exit(1)
