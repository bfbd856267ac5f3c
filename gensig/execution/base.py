"""Interface of executors, which run a job for each shard."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from gensig.options.configuration import whole_number

T = TypeVar("T")

TRIES = 3  # times a shard is begun before the death of its worker is held against it
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShardFailure:
    """Failure of a shard whose worker died or whose job raised."""

    reason: str


class Executor(ABC):
    """Place of the computation of shards; it decides no bit of them.

    Attributes
    ----------
    closes : bool    True where one call makes every shard, so that the data set can be closed
                     afterwards
    """

    closes = True

    @abstractmethod
    def run(
        self, job: Callable[[int], T], shard_indices: Sequence[int]
    ) -> Iterator[tuple[int, T | ShardFailure]]:
        """Run ``job`` for the shards and yield each shard's number and result as they come.

        ``job`` must be picklable and safe to run twice. An exception that it raises is yielded as
        a failure and not tried again, because it would come again; a worker that dies is
        replaced, and the shard that it had in hand is begun again, up to ``TRIES`` times in all.
        """

    def share(self, shard_indices: Sequence[int]) -> list[int]:
        """The shards that ``run`` makes of those given."""
        return list(shard_indices)

    @property
    @abstractmethod
    def n_processes(self) -> int:
        """Shards that are made at a time."""


def guarded(job: Callable[[int], T], index: int) -> T | ShardFailure:
    """Run a job; an exception becomes a failure of one line."""
    try:
        return job(index)
    except Exception as error:
        return ShardFailure(reason=one_line(error))


def one_line(error: BaseException) -> str:
    """Kind and message of an error."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def read_n_workers(requested: Any) -> int:
    """Number of worker processes: as given, else one for each usable core."""
    if requested is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    return whole_number("executor.n_workers", requested, at_least=1, also=", or null")
