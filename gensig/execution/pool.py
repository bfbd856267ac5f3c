"""Calls on processes of this machine, one in hand each; a process that dies is replaced.

Shards of data sets and trainings of networks are such calls.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import warnings
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import connection, resource_tracker
from types import FrameType
from typing import Any, TypeVar

from gensig.execution.base import THREAD_VARIABLES, TRIES, ShardFailure, T
from gensig.text.escaping import set_warning_lines

Item = TypeVar("Item")
STOPPING = (signal.SIGINT, signal.SIGTERM)
HELD_SECONDS = 0.2  # longest that a signal waits while results are waited for

_worker: dict[str, Callable[[Any], Any]] = {}


def results_of(
    call: Callable[[Item], T], items: Sequence[Item], *, n_workers: int
) -> Generator[tuple[Item, T | ShardFailure], None, None]:
    """Items and their results as they come.

    One worker, or one item, runs in this process. Otherwise each worker is a process that gets
    ``call`` once and one item at a time. Of a worker that dies it is known which item it had in
    hand; this item is begun again, up to ``TRIES`` times in all, and has a failure then. What a
    call raises is raised here. However this ends, no worker is left.

    Parameters
    ----------
    call : picklable, and safe to run twice on an item
    items : hashable, each once
    """
    if n_workers == 1 or len(items) <= 1:
        for item in items:
            yield item, call(item)
        return
    before = set(multiprocessing.active_children())
    waiting, tries = deque(items), Counter[Item]()
    idle = [_Worker() for _ in range(min(n_workers, len(waiting)))]
    at_work: dict[Future[T], tuple[_Worker, Item]] = {}
    try:
        while waiting or at_work:
            while waiting and idle:
                worker, item = idle.pop(), waiting.popleft()
                worker, future = _submit(worker, call, item)
                at_work[future] = worker, item
            for future in _finished(at_work):
                worker, item = at_work.pop(future)
                result: T | ShardFailure
                try:
                    worker.check()
                    result = future.result()
                except BrokenProcessPool:
                    worker.pool.shutdown(wait=False)
                    worker = _Worker()
                    tries[item] += 1
                    if tries[item] < TRIES:
                        waiting.append(item)
                        idle.append(worker)
                        continue
                    result = ShardFailure(
                        reason=f"its worker process died {TRIES} times"
                    )
                idle.append(worker)
                yield item, result
    except BaseException:
        # What was in hand is lost: it lies in temporary files, if anywhere.
        with stops_held():
            for process in set(multiprocessing.active_children()) - before:
                process.kill()
        raise
    finally:
        with stops_held():
            for worker in [*idle, *(worker for worker, _ in at_work.values())]:
                worker.pool.shutdown(cancel_futures=True)


class _Worker:
    """A process of its own: when it dies, it is known which item it had in hand.

    It gets the call as its first work, not at its beginning. What a process is begun with is
    written to a pipe, and to write more than that holds would wait for ever for a process that was
    killed meanwhile.
    """

    def __init__(self) -> None:
        self.pool = _pool()
        self._has_call: Future[None] | None = None

    def submit(self, call: Callable[[Item], T], item: Item) -> Future[T]:
        """Give the process an item, and first of all the call."""
        if self._has_call is None:
            self._has_call = self.pool.submit(_take, call)
        return self.pool.submit(_call, item)

    def check(self) -> None:
        """Raise what kept the process from taking the call."""
        if self._has_call is not None:
            self._has_call.result()


def _pool() -> ProcessPoolExecutor:
    """A pool of one process, which starts with its first item."""
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        1,
        mp_context=context,
        initializer=_begin_worker,
        initargs=(_is_quiet(),),
    )


def _submit(
    worker: _Worker, call: Callable[[Item], T], item: Item
) -> tuple[_Worker, Future[T]]:
    """Give a worker an item; one that died while it had none is replaced first."""
    with stops_held(), interrupts_unseen(), _main_unknown():
        try:
            return worker, worker.submit(call, item)
        except BrokenProcessPool:
            worker.pool.shutdown(wait=False)
            worker = _Worker()
            return worker, worker.submit(call, item)


def _finished(futures: Iterable[Future[T]]) -> set[Future[T]]:
    """At least one future that is done.

    A signal waits for the locks of the futures, which an exception would leave locked.
    """
    done: set[Future[T]] = set()
    while not done:
        with stops_held():
            done = wait(futures, HELD_SECONDS, return_when=FIRST_COMPLETED).done
    return done


@contextmanager
def stops_held() -> Iterator[None]:
    """A signal that would stop this process takes effect at the end of the block.

    An exception in the midst of the block would lose a process that has just begun. In other
    threads than the main one no signal raises, and where a signal ends the process at once, it
    still does.
    """
    came: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {}
    try:
        for number in STOPPING:
            handler = signal.getsignal(number)
            if callable(handler):
                before[number] = handler
                signal.signal(number, note)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for each in dict.fromkeys(came):
            signal.raise_signal(each)


@contextmanager
def interrupts_unseen() -> Iterator[None]:
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


def _take(call: Callable[[Any], Any]) -> None:
    _worker["call"] = call


def _end_with(sentinel: Any) -> None:
    connection.wait([sentinel])
    os._exit(1)


def _call(item: Any) -> Any:
    return _worker["call"](item)
