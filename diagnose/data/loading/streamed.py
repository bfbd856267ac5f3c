"""Windows of records that are simulated during training, of which nothing is stored."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import torch.utils.data
from numpy.typing import NDArray

from diagnose.data.loading.items import (
    Item,
    Target,
    Value,
    known_segments,
    metadata_of,
    target_of,
)
from diagnose.data.loading.transforms import AnyTransform, transformed
from diagnose.data.windows import (
    IntArray,
    Segments,
    Task,
    normalised,
    plan_windows,
    task_of,
)
from gensig.errors import ConfigError, DatasetError


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


class StreamedWindows(torch.utils.data.IterableDataset[Item]):
    """Windows planned on a stream, and the records of each worker of a loader.

    Parameters
    ----------
    stream : as made by ``gensig.stream``, or a part of it
    protocol, subset : as for `VibrationDataset`; all records if both are None
    window_samples, stride_samples, channels, classes, normalise : as for `VibrationDataset`
    transform, target, return_metadata : as for `VibrationDataset`
    n_epochs : epochs in one pass, each with other random draws, of units too; None never ends

    Raises
    ------
    ConfigError    for a name that does not exist, a target that the stream lacks, or a subset
        that would be empty
    """

    def __init__(
        self,
        stream: Any,
        protocol: str | None = None,
        subset: str | None = None,
        *,
        window_samples: int,
        stride_samples: int,
        channels: Sequence[str] | None = None,
        classes: Sequence[str] | None = None,
        normalise: str = "rms",
        transform: AnyTransform | None = None,
        target: str = "class",
        return_metadata: bool = False,
        n_epochs: int | None = 1,
    ) -> None:
        if (protocol is None) != (subset is None):
            raise ConfigError("give protocol and subset, or neither of them")
        if n_epochs is not None and n_epochs < 1:
            raise ConfigError(f"n_epochs must be at least 1 or None, not {n_epochs}")
        self.stream, self.n_epochs = stream, n_epochs
        self.transform, self.return_metadata = transform, return_metadata
        self._protocol, self._subset, self._target = protocol, subset, target
        self._window_samples, self._normalise = window_samples, normalise
        self._task_of = functools.partial(
            task_of,
            window_samples=window_samples,
            stride_samples=stride_samples,
            normalise=normalise,
            classes=classes,
            channels=channels,
            one_class=target != "class",
        )
        task, values, windows = self._planned(stream)
        self.class_names = task.class_names
        self.target_names = values.names
        self._sampling_rate = float(stream.sampling_rate)
        self._n_planned = sum(planned.start.size for planned in windows.values())
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

    def _records(
        self, first_epoch: int, worker: int, n_workers: int
    ) -> Iterator[StreamedRecord]:
        """Records of one worker in the plan's order, failed ones left out.

        Raises
        ------
        DatasetError    for a signal that is not finite
        """
        for epoch in itertools.count(first_epoch):
            if self.n_epochs is not None and epoch == first_epoch + self.n_epochs:
                return
            stream = self.stream.at_epoch(epoch)
            task, target, windows = self._planned(stream)
            part = stream.take(sorted(windows)).shard(worker, n_workers)
            if self.n_epochs is None and not len(part):
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

    def _facts(self, record: StreamedRecord, start: int) -> tuple[Any, ...]:
        """Target of a window, and its metadata where they are wanted."""
        if not self.return_metadata:
            return (record.target,)
        metadata = metadata_of(record.values, start, self._sampling_rate)
        return record.target, metadata

    def _planned(self, stream: Any) -> tuple[Task, Target, dict[int, PlannedWindows]]:
        """Task and target of one epoch; record -> its windows, without empty ones."""
        task = self._task_of(stream)
        target = target_of(task, self._target)
        if self._protocol is None or self._subset is None:
            segments = _whole_records(task, target)
        else:
            segments = known_segments(task, target, self._protocol, self._subset)
        segment, start = plan_windows(
            segments, task.window_samples, task.stride_samples
        )
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


class StreamingDataset(StreamedWindows):
    """Windows of records that are simulated during training; safe in forked and spawned workers.

    Nothing is stored. Each record goes to one of the workers of a loader. On several computers,
    give each its ``stream.shard(rank, n_machines)``. Without ``shuffle_buffer`` and workers, the
    items are those of `VibrationDataset` on the stored data set, in the same order and with the
    same bits.

    Parameters
    ----------
    stream, protocol, subset, options : as for `StreamedWindows`
    shuffle_buffer : windows that every worker holds back and draws from at random; 0 keeps the
        plan's order

    Raises
    ------
    ConfigError    as `StreamedWindows`, and for a buffer below 0

    Notes
    -----
    A pass begins at the epoch of ``set_epoch``, else at that of the stream: without
    ``set_epoch`` every pass is the same. The set of windows depends on nothing else, and their
    order only on the number of workers. Records that failed are left out. ``n_windows`` is the
    number of windows of an epoch in which no record fails.
    """

    def __init__(
        self,
        stream: Any,
        protocol: str | None = None,
        subset: str | None = None,
        *,
        shuffle_buffer: int = 0,
        **options: Any,
    ) -> None:
        if shuffle_buffer < 0:
            raise ConfigError(f"shuffle_buffer = {shuffle_buffer} must be at least 0")
        super().__init__(stream, protocol, subset, **options)
        self.shuffle_buffer, self.n_windows = shuffle_buffer, self._n_planned

    def __iter__(self) -> Iterator[Item]:
        index, n_workers = worker_share()
        epoch = self.epoch
        items = self._items(epoch, index, n_workers)
        if self.shuffle_buffer:
            rng = np.random.default_rng([self.stream.seed, epoch, index])
            items = _shuffled(items, self.shuffle_buffer, rng)
        return items

    def _items(self, first_epoch: int, worker: int, n_workers: int) -> Iterator[Item]:
        """The items of one worker in the plan's order."""
        for record in self._records(first_epoch, worker, n_workers):
            for start in record.windows.start.tolist():
                cut = record.signal[:, start : start + self._window_samples]
                normal = normalised(np.ascontiguousarray(cut), self._normalise)
                window = transformed(torch.from_numpy(normal), self.transform)
                yield window, *self._facts(record, start)


def worker_share() -> tuple[int, int]:
    """Number of this worker of a loader, and of all its workers."""
    worker = torch.utils.data.get_worker_info()
    if worker is None:
        return 0, 1
    return worker.id, worker.num_workers


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


def _shuffled(
    items: Iterable[Item], n_held: int, rng: np.random.Generator
) -> Iterator[Item]:
    """The same items, each drawn at random from ``n_held`` that are held back."""
    held: list[Item] = []
    for item in items:
        if len(held) < n_held:
            held.append(item)
            continue
        drawn = int(rng.integers(n_held))
        yield held[drawn]
        held[drawn] = item
    yield from (held[index] for index in rng.permutation(len(held)))
