"""Shards on the workers of a Dask cluster, on this machine or by the scheduler's address."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from gensig.errors import ConfigError
from gensig.execution.base import TRIES, Executor, ShardFailure, T, guarded, one_line
from gensig.text.installation import install

CONNECT_SECONDS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class DaskExecutor(Executor):
    """Workers of one thread each, which see the data set's folder at the same path."""

    n_workers: int
    address: str | None

    def __post_init__(self) -> None:
        load_distributed()

    @property
    def n_processes(self) -> int:
        """Shards that are made at a time on a cluster of this machine."""
        return self.n_workers

    def run(
        self, job: Callable[[int], T], shard_indices: Sequence[int]
    ) -> Iterator[tuple[int, T | ShardFailure]]:
        """See ``Executor.run``.

        The scheduler counts the tries, and one of your own counts as it is configured.
        """
        distributed = load_distributed()
        with self._client(distributed) as client:
            futures = client.map(
                functools.partial(guarded, job),
                shard_indices,
                pure=False,
                retries=TRIES - 1,
            )
            keys = [future.key for future in futures]
            numbers = dict(zip(keys, shard_indices, strict=True))
            for future in distributed.as_completed(futures, loop=client.loop):
                try:
                    result = future.result()
                except (Exception, CancelledError) as error:
                    result = ShardFailure(reason=one_line(error))
                future.release()
                yield numbers[future.key], result

    @contextmanager
    def _client(self, distributed: ModuleType) -> Iterator[Any]:
        if self.address is None:
            import dask

            settings = {
                "distributed.scheduler.allowed-failures": TRIES - 1,
                # No shard waits at a worker whose death it would share.
                "distributed.scheduler.worker-saturation": 1.0,
            }
            with (
                dask.config.set(settings),
                distributed.LocalCluster(
                    n_workers=self.n_workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    silence_logs=logging.CRITICAL,
                ) as cluster,
                distributed.Client(cluster, set_as_default=False) as client,
            ):
                yield client
            return
        try:
            client = distributed.Client(
                self.address, timeout=CONNECT_SECONDS, set_as_default=False
            )
        except (OSError, ValueError) as error:
            raise ConfigError(
                f"executor.address = {self.address!r}: no Dask scheduler answers there "
                f"({one_line(error)}); start one with `dask scheduler`"
            ) from error
        with client:
            threads = client.nthreads()
            if not threads:
                raise ConfigError(
                    f"the Dask scheduler at {self.address} has no worker; start some with "
                    f"`dask worker {self.address} --nthreads 1`"
                )
            for worker, n in threads.items():
                if n != 1:
                    raise ConfigError(
                        f"the Dask worker {worker} has {n} threads; start each with --nthreads 1"
                    )
            yield client


def load_distributed() -> ModuleType:
    """The package distributed; ConfigError says that executor=dask needs it."""
    try:
        import distributed
    except ImportError as error:
        raise ConfigError(
            "executor=dask needs the package distributed, which is an extra: "
            f"{install('dask')}"
        ) from error
    return distributed
