"""Data sets for torch: windows of stored records, or of records simulated during training."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
import torch.utils.data

from diagnose.data.windows import (
    IntArray,
    Segments,
    Task,
    normalised,
    plan_windows,
    read_signal,
    subset_segments,
    task_of,
)
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


Item = tuple[torch.Tensor, int]


class VibrationDataset(torch.utils.data.Dataset[Item]):
    """Windows of one subset of a split, read on demand; safe in forked and spawned workers.

    Windows are cut after the split. Each lies inside the stretch that the split gives to its
    subset.

    Parameters
    ----------
    dataset : as opened by `gensig.dataset.reader.open_dataset`
    protocol : name of the split, one of ``dataset.protocols``
    subset : ``"train"``, ``"validation"`` or ``"test"``
    window_samples, stride_samples : length of a window and step from one to the next
    channels, classes : names to keep, in this order; all where None
    normalise : ``"rms"`` divides each channel of a window by its RMS, ``"none"`` keeps m/s^2

    Raises
    ------
    ConfigError    for a name that does not exist or a subset that would be empty

    Notes
    -----
    An item is ``(window, label)``: (channel, sample) float32 and an index into ``class_names``.
    ``record`` (window,) is the record of every window, for averages of predictions over records.
    """

    def __init__(
        self,
        dataset: Dataset,
        protocol: str,
        subset: str,
        *,
        window_samples: int,
        stride_samples: int,
        channels: Sequence[str] | None = None,
        classes: Sequence[str] | None = None,
        normalise: str = "rms",
    ) -> None:
        self._task = task_of(
            dataset,
            window_samples=window_samples,
            stride_samples=stride_samples,
            normalise=normalise,
            classes=classes,
            channels=channels,
        )
        segments = subset_segments(self._task, protocol, subset)
        segment, self.start = plan_windows(segments, window_samples, stride_samples)
        self.record = segments.record[segment]
        self.label = self._task.labels()[self.record]
        self.class_names = self._task.class_names

    def __len__(self) -> int:
        return int(self.record.size)

    def __getitem__(self, index: int) -> Item:
        task, start = self._task, int(self.start[index])
        stop = start + task.window_samples
        signal = read_signal(task, int(self.record[index]), start, stop)
        window = torch.from_numpy(normalised(signal, task.normalise))
        return window, int(self.label[index])


class StreamingDataset(torch.utils.data.IterableDataset[Item]):
    """Windows of records that are simulated during training; safe in forked and spawned workers.

    Nothing is stored. Each record goes to one of the workers of a loader. On several computers,
    give each its ``stream.shard(rank, n_machines)``. Without ``shuffle_buffer`` and workers, the
    items are those of `VibrationDataset` on the stored data set, in the same order and with the
    same bits.

    Parameters
    ----------
    stream : as made by ``gensig.stream``, or a part of it
    protocol, subset : as for `VibrationDataset`; all records if both are None
    window_samples, stride_samples, channels, classes, normalise : as for `VibrationDataset`
    n_epochs : epochs in one pass, each with other random draws, of units too; None never ends
    shuffle_buffer : windows that every worker holds back and draws from at random; 0 keeps the
        plan's order

    Raises
    ------
    ConfigError    for a name that does not exist or a subset that would be empty

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
        window_samples: int,
        stride_samples: int,
        channels: Sequence[str] | None = None,
        classes: Sequence[str] | None = None,
        normalise: str = "rms",
        n_epochs: int | None = 1,
        shuffle_buffer: int = 0,
    ) -> None:
        if (protocol is None) != (subset is None):
            raise ConfigError("give protocol and subset, or neither of them")
        if (n_epochs is not None and n_epochs < 1) or shuffle_buffer < 0:
            raise ConfigError(
                "n_epochs must be at least 1 or None, shuffle_buffer at least 0"
            )
        self._stream, self._part = stream, (protocol, subset)
        self._options: dict[str, Any] = {
            "window_samples": window_samples,
            "stride_samples": stride_samples,
            "normalise": normalise,
            "classes": classes,
            "channels": channels,
        }
        self.n_epochs, self.shuffle_buffer = n_epochs, shuffle_buffer
        task, windows = self._plan(stream)
        self.class_names = task.class_names
        self.n_windows = sum(len(starts) for starts in windows.values())
        # shared memory, so that workers that stay alive between passes see a new epoch
        self._epoch = torch.tensor(stream.epoch).share_memory_()

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._epoch.share_memory_()

    @property
    def epoch(self) -> int:
        """The epoch at which the next pass begins."""
        return int(self._epoch)

    def set_epoch(self, epoch: int) -> None:
        """Begin the next pass at another epoch, in every worker."""
        if epoch < 0:
            raise ConfigError(f"epoch = {epoch} must be at least 0")
        self._epoch.fill_(epoch)

    def __iter__(self) -> Iterator[Item]:
        worker = torch.utils.data.get_worker_info()
        index, n_workers = 0, 1
        if worker is not None:
            index, n_workers = worker.id, worker.num_workers
        epoch = self.epoch
        items = self._items(epoch, index, n_workers)
        if self.shuffle_buffer:
            rng = np.random.default_rng([self._stream.seed, epoch, index])
            items = _shuffled(items, self.shuffle_buffer, rng)
        return items

    def _items(self, first_epoch: int, worker: int, n_workers: int) -> Iterator[Item]:
        """The items of one worker in the plan's order."""
        for epoch in itertools.count(first_epoch):
            if self.n_epochs is not None and epoch == first_epoch + self.n_epochs:
                return
            stream = self._stream.at_epoch(epoch)
            task, windows = self._plan(stream)
            part = stream.take(sorted(windows)).shard(worker, n_workers)
            if self.n_epochs is None and not len(part):
                return  # fewer conditions than workers: no record will ever come
            record_ids = stream.column("record_id").tolist()
            index_of = {name: index for index, name in enumerate(record_ids)}
            labels = task.labels()
            for record in part:
                if record.values["status"] == "ok":
                    index = index_of[record.values["record_id"]]
                    for window in _cut(task, record, windows[index]):
                        yield window, int(labels[index])

    def _plan(self, stream: Any) -> tuple[Task, dict[int, IntArray]]:
        """Task of one epoch; record -> first samples of its windows, without empty ones."""
        task = task_of(stream, **self._options)
        protocol, subset = self._part
        if protocol is None or subset is None:
            segments = _whole_records(task)
        else:
            segments = subset_segments(task, protocol, subset)
        segment, start = plan_windows(
            segments, task.window_samples, task.stride_samples
        )
        record = segments.record[segment]
        order = np.argsort(record, kind="stable")
        records, first = np.unique(record[order], return_index=True)
        starts = np.split(start[order], first[1:])
        return task, dict(zip(records.tolist(), starts, strict=True))


def _whole_records(task: Task) -> Segments:
    """Every record of the task's classes."""
    record = np.flatnonzero(task.labels() >= 0)
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


def _cut(task: Task, record: Any, starts: IntArray) -> Iterator[torch.Tensor]:
    """Windows (channel, sample) of one record, normalised as those of a stored one.

    Refuses what is not finite.
    """
    signal = record.signals["acceleration"][task.channels]
    if not np.isfinite(signal).all():
        raise DatasetError(
            f"record {record.values['record_id']}: "
            "its signal holds values that are not finite"
        )
    for start in starts:
        window = np.ascontiguousarray(signal[:, start : start + task.window_samples])
        yield torch.from_numpy(normalised(window, task.normalise))


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
