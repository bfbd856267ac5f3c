"""Shards of one task of an array job, such as SLURM's: each `shard_count`-th shard."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.execution.base import Executor, ShardFailure, T
from gensig.execution.local import LocalExecutor


@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayExecutor(Executor):
    """Task ``shard_index`` of ``shard_count`` independent tasks; ``gensig finalize`` closes."""

    closes = False

    shard_index: int
    shard_count: int
    n_workers: int

    def __post_init__(self) -> None:
        if self.shard_index >= self.shard_count:
            raise ConfigError(
                f"executor.shard_index = {self.shard_index} with executor.shard_count = "
                f"{self.shard_count}: tasks are counted from 0 to {self.shard_count - 1}; write "
                f"#SBATCH --array=0-{self.shard_count - 1}"
            )

    @property
    def n_processes(self) -> int:
        """Shards that are made at a time when every task runs."""
        return self.n_workers * self.shard_count

    def share(self, shard_indices: Sequence[int]) -> list[int]:
        """The shards of this task: what others have made meanwhile does not change them."""
        task, n_tasks = self.shard_index, self.shard_count
        return [index for index in shard_indices if index % n_tasks == task]

    def run(
        self, job: Callable[[int], T], shard_indices: Sequence[int]
    ) -> Iterator[tuple[int, T | ShardFailure]]:
        """See ``Executor.run``."""
        executor = LocalExecutor(n_workers=self.n_workers)
        yield from executor.run(job, self.share(shard_indices))
