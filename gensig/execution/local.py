"""Shards on processes of this machine; a process that dies is replaced and only its shards run again."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from gensig.errors import ConfigError

T = TypeVar("T")

TRIES = 3
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class ShardFailure:
    """What is left of a shard whose worker died or raised: its number and the reason."""

    def __init__(self, shard_index: int, reason: str) -> None:
        self.shard_index = shard_index
        self.reason = reason


def n_workers(requested: int | None) -> int:
    """Number of worker processes: as asked, else one a usable core."""
    if requested is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if isinstance(requested, bool) or not isinstance(requested, int) or requested < 1:
        raise ConfigError(f"executor.n_workers = {requested!r} must be a whole number of at least 1, or null")
    return requested


def run_shards(
    job: Callable[[int], T], shard_indices: Sequence[int], *, workers: int
) -> Iterator[tuple[int, T | ShardFailure]]:
    """Run ``job`` for every shard and yield results as they come.

    ``job`` must be picklable; it receives the shard's number. An exception of the job is yielded as a failure and
    not tried again (it would come again); a worker that dies takes the shards it had in hand back into the queue, up to
    three times each. With one worker, or one shard, everything runs in this process.
    """
    pending = list(shard_indices)
    if workers == 1 or len(pending) <= 1:
        for index in pending:
            yield index, _guarded(job, index)
        return
    tries = dict.fromkeys(pending, 0)
    while pending:
        pool = _pool(min(workers, len(pending)))
        futures: dict[Future[T | ShardFailure], int] = {pool.submit(_guarded, job, index): index for index in pending}
        pending = []
        try:
            open_futures = set(futures)
            while open_futures:
                done, open_futures = wait(open_futures, return_when=FIRST_COMPLETED)
                for future in done:
                    index = futures[future]
                    try:
                        yield index, future.result()
                    except BrokenProcessPool:
                        tries[index] += 1
                        if tries[index] < TRIES:
                            pending.append(index)
                        else:
                            yield index, ShardFailure(index, f"its worker process died {TRIES} times")
        except BaseException:
            # interrupted: what is half done is a temporary file that nobody will mistake for a shard
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise
        pool.shutdown()


def _pool(workers: int) -> ProcessPoolExecutor:
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, mp_context=context, initializer=_ignore_interrupt)


def _ignore_interrupt() -> None:
    """Ctrl-C is the parent's to answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _guarded(job: Callable[[int], T], index: int) -> T | ShardFailure:
    try:
        return job(index)
    except Exception as error:
        return ShardFailure(index, " ".join(f"{type(error).__name__}: {error}".split()))
