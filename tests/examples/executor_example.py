"""Worked example of a new executor: shards one after another in this process, for debugging.

An executor is three files: this module in ``gensig/execution``, an entry of ``EXECUTORS`` in
``gensig/execution/registry.py``, and ``serial.yaml`` beside this file in ``configs/executor``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import final

from gensig.execution.base import Executor, ShardFailure, T, guarded
from gensig.options.configuration import Section


@final
class SerialExecutor(Executor):
    """Makes shards in the process that asks for them."""

    @property
    def n_processes(self) -> int:
        """One shard at a time."""
        return 1

    def run(
        self, job: Callable[[int], T], shard_indices: Sequence[int]
    ) -> Iterator[tuple[int, T | ShardFailure]]:
        """See ``Executor.run``; there is no worker that could die."""
        for index in shard_indices:
            yield index, guarded(job, index)


def read_serial(section: Section) -> Executor:
    """Executor of the group ``executor`` with ``kind: serial``, which has no other key."""
    return SerialExecutor()
