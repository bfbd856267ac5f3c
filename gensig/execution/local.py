"""Shards on processes of this machine."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from gensig.execution.base import Executor, ShardFailure, T, guarded
from gensig.execution.pool import results_of


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
        call = functools.partial(guarded, job)
        yield from results_of(call, shard_indices, n_workers=self.n_workers)
