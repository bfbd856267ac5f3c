"""Records of a stream that one worker of a loader simulates, with the windows planned on them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import torch.utils.data
from numpy.typing import NDArray

from diagnose.data.lives import kept_segments
from diagnose.data.loading.items import Target, Value, target_of
from diagnose.data.windows import (
    IntArray,
    Segments,
    Task,
    plan_windows,
    subset_segments,
    task_of,
)
from gensig.errors import ConfigError, DatasetError


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowOptions:
    """Options of the windows of a stream, as `diagnose.data.torch_sets` documents them."""

    protocol: str | None
    subset: str | None
    window_samples: int
    stride_samples: int
    channels: Sequence[str] | None
    classes: Sequence[str] | None
    normalise: str
    target: str
    n_epochs: int | None

    def __post_init__(self) -> None:
        if (self.protocol is None) != (self.subset is None):
            raise ConfigError("give protocol and subset, or neither of them")
        if self.n_epochs is not None and self.n_epochs < 1:
            raise ConfigError(
                f"n_epochs must be at least 1 or None, not {self.n_epochs}"
            )

    def task(self, stream: Any) -> Task:
        """Task of a stream, whose one class is enough where classes are not the target."""
        return task_of(
            stream,
            window_samples=self.window_samples,
            stride_samples=self.stride_samples,
            normalise=self.normalise,
            classes=self.classes,
            channels=self.channels,
            one_class=self.target != "class",
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedWindows:
    """Windows of one record: (window,) first samples.

    Attributes
    ----------
    start : on the plan's grid
    earliest, latest : least and largest start with which the window stays in its stretch
    """

    start: IntArray
    earliest: IntArray
    latest: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StreamedRecord:
    """One simulated record.

    Attributes
    ----------
    seed, number : of its epoch, and its number in the plan of that epoch
    signal : (channel, sample) float32 of the task's channels, m/s^2
    windows : planned on it
    target : of the record
    values : columns of the record by name
    """

    seed: int
    number: int
    signal: NDArray[np.float32]
    windows: PlannedWindows
    target: Value
    values: Mapping[str, Any]


class StreamedWindows:
    """Windows planned on a stream, and the records of each worker of a loader.

    Parameters
    ----------
    stream : as made by ``gensig.stream``, or a part of it
    options : of the windows

    Raises
    ------
    ConfigError    for a name that does not exist, a target that the stream lacks, or a subset
        that would be empty
    """

    def __init__(self, stream: Any, options: WindowOptions) -> None:
        self.stream, self.options = stream, options
        task, target, windows = _plan(stream, options)
        self.class_names = task.class_names
        self.target_names = target.names
        self.sampling_rate = float(stream.sampling_rate)
        self.n_windows = sum(planned.start.size for planned in windows.values())
        # shared memory, so that workers that stay alive between passes see a new epoch
        self._epoch = torch.tensor(stream.epoch).share_memory_()

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._epoch.share_memory_()

    @property
    def epoch(self) -> int:
        """Epoch at which the next pass begins."""
        return int(self._epoch)

    def set_epoch(self, epoch: int) -> None:
        """Begin the next pass at another epoch, in every worker."""
        if epoch < 0:
            raise ConfigError(f"epoch = {epoch} must be at least 0")
        self._epoch.fill_(epoch)

    def records(
        self, first_epoch: int, worker: int, n_workers: int
    ) -> Iterator[StreamedRecord]:
        """Records of one worker in the plan's order, failed ones left out.

        Raises
        ------
        DatasetError    for a signal that is not finite
        """
        for epoch in itertools.count(first_epoch):
            n_epochs = self.options.n_epochs
            if n_epochs is not None and epoch == first_epoch + n_epochs:
                return
            stream = self.stream.at_epoch(epoch)
            task, target, windows = _plan(stream, self.options)
            part = stream.take(sorted(windows)).shard(worker, n_workers)
            if n_epochs is None and not len(part):
                return  # fewer conditions than workers: no record will ever come
            record_ids = stream.column("record_id").tolist()
            index_of = {name: index for index, name in enumerate(record_ids)}
            for record in part:
                if record.values["status"] != "ok":
                    continue
                index = index_of[record.values["record_id"]]
                yield StreamedRecord(
                    seed=int(stream.seed),
                    number=int(stream.numbers[index]),
                    signal=_finite_signal(task, record),
                    windows=windows[index],
                    target=target.of(index),
                    values=record.values,
                )


def worker_share() -> tuple[int, int]:
    """Number of this worker of a loader, and of all its workers."""
    worker = torch.utils.data.get_worker_info()
    if worker is None:
        return 0, 1
    return worker.id, worker.num_workers


def known_segments(task: Task, target: Target, protocol: str, subset: str) -> Segments:
    """Stretches of one subset of a split whose records have a target.

    Raises
    ------
    ConfigError    for a name that does not exist, or a subset without such records
    """
    segments = kept_segments(subset_segments(task, protocol, subset), target.known)
    if not segments.record.size:
        raise ConfigError(
            f"protocol {protocol}: no record of its {subset} part has this target; "
            "take another target or make more records"
        )
    return segments


def _plan(
    stream: Any, options: WindowOptions
) -> tuple[Task, Target, dict[int, PlannedWindows]]:
    """Task and target of one epoch; record -> its windows, without empty ones."""
    task = options.task(stream)
    target = target_of(task, options.target)
    if options.protocol is None or options.subset is None:
        segments = _whole_records(task, target)
    else:
        segments = known_segments(task, target, options.protocol, options.subset)
    segment, start = plan_windows(segments, task.window_samples, task.stride_samples)
    record = segments.record[segment]
    earliest = segments.start[segment]
    latest = segments.stop[segment] - task.window_samples
    order = np.argsort(record, kind="stable")
    records, first = np.unique(record[order], return_index=True)
    parts = np.split(order, first[1:])
    windows = {
        int(number): PlannedWindows(
            start=start[part], earliest=earliest[part], latest=latest[part]
        )
        for number, part in zip(records, parts, strict=True)
    }
    return task, target, windows


def _whole_records(task: Task, target: Target) -> Segments:
    """Every record of the task's classes that has a target."""
    record = np.flatnonzero((task.labels() >= 0) & target.known)
    if record.size == 0:
        raise ConfigError(
            f"the stream has no record of {', '.join(task.class_names)}; "
            "give a larger part of it"
        )
    return Segments(
        record=record,
        start=np.zeros_like(record),
        stop=np.full_like(record, task.dataset.n_samples),
    )


def _finite_signal(task: Task, record: Any) -> NDArray[np.float32]:
    """(channel, sample) m/s^2 of the task's channels; refuses what is not finite."""
    signal: NDArray[np.float32] = record.signals["acceleration"][task.channels]
    if not np.isfinite(signal).all():
        raise DatasetError(
            f"record {record.values['record_id']}: "
            "its signal holds values that are not finite"
        )
    return signal
