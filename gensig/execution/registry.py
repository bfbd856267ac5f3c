"""Executors by name, and the reader of the group ``executor`` of a configuration."""

from __future__ import annotations

from collections.abc import Callable

from gensig.errors import ConfigError
from gensig.execution.array import ArrayExecutor
from gensig.execution.base import Executor, read_n_workers
from gensig.execution.dask import DaskExecutor
from gensig.execution.local import LocalExecutor
from gensig.options.configuration import Section, whole_number


def _local(section: Section) -> Executor:
    return LocalExecutor(n_workers=read_n_workers(section["n_workers"]))


def _dask(section: Section) -> Executor:
    address = section["address"]
    if address is not None and not isinstance(address, str):
        raise ConfigError(
            f"executor.address = {address!r} must be text such as tcp://10.0.0.1:8786, or null"
        )
    return DaskExecutor(n_workers=read_n_workers(section["n_workers"]), address=address)


def _slurm(section: Section) -> Executor:
    missing = [key for key in ("shard_index", "shard_count") if section[key] is None]
    if missing:
        raise ConfigError(
            f"executor=slurm needs executor.{missing[0]}; a task gives "
            "executor.shard_index=$SLURM_ARRAY_TASK_ID and "
            "executor.shard_count=$SLURM_ARRAY_TASK_COUNT"
        )
    return ArrayExecutor(
        shard_index=whole_number(
            "executor.shard_index", section["shard_index"], at_least=0
        ),
        shard_count=whole_number(
            "executor.shard_count", section["shard_count"], at_least=1
        ),
        n_workers=read_n_workers(section["n_workers"]),
    )


EXECUTORS: dict[str, Callable[[Section], Executor]] = {
    "local": _local,
    "dask": _dask,
    "slurm": _slurm,
}


def read_executor(section: Section) -> Executor:
    """The executor of a configuration.

    Raises
    ------
    ConfigError    for an unknown kind, a value out of range, or a package that is missing
    """
    kind = section["kind"]
    if kind not in EXECUTORS:
        raise ConfigError(f"executor.kind = {kind!r}; there is {', '.join(EXECUTORS)}")
    return EXECUTORS[kind](section)
