"""Data sets for torch: windows of stored records, or of records simulated during training."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
import torch.utils.data

from diagnose.data.loading.items import metadata_of, record_values, target_of
from diagnose.data.loading.streamed import (
    StreamedWindows,
    WindowOptions,
    known_segments,
    worker_share,
)
from diagnose.data.loading.transforms import AnyTransform, transformed
from diagnose.data.windows import (
    normalised,
    plan_windows,
    read_signal,
    task_of,
)
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# Window and target; with ``return_metadata`` the metadata are third.
Item = tuple[Any, ...]


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
    transform : function of a window (channel, sample), called after `normalise`
    target : value to learn: ``"class"``, index into ``class_names``; ``"severity"``, float32 from
        0 (sound) to 1; ``"gear"``, index into ``target_names``, of which the first is none;
        ``"life"``, float32 hours until failure. Lives that did not fail are left out there,
        because their hours are a lower bound
    return_metadata : add a third item, a dict of numbers and texts: the columns
        `diagnose.data.loading.items.METADATA` of the record, ``start_sample`` and
        ``sampling_rate_hz``

    Raises
    ------
    ConfigError    for a name that does not exist, a target that the data set lacks, or a subset
        that would be empty

    Notes
    -----
    An item is ``(window, target)``: (channel, sample) float32 and an int or a float32 tensor ().
    ``record`` (window,) is the record of every window, for averages of predictions over records.
    ``label`` (window,) is its class. ``target_names`` are the names that a target is an index of,
    empty for a number.
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
        transform: AnyTransform | None = None,
        target: str = "class",
        return_metadata: bool = False,
    ) -> None:
        self._task = task_of(
            dataset,
            window_samples=window_samples,
            stride_samples=stride_samples,
            normalise=normalise,
            classes=classes,
            channels=channels,
            one_class=target != "class",
        )
        self._target = target_of(self._task, target)
        segments = known_segments(self._task, self._target, protocol, subset)
        segment, self.start = plan_windows(segments, window_samples, stride_samples)
        self.record = segments.record[segment]
        self.label = self._task.labels()[self.record]
        self.class_names = self._task.class_names
        self.target_names = self._target.names
        self.transform, self.return_metadata = transform, return_metadata

    def __len__(self) -> int:
        return int(self.record.size)

    def __getitem__(self, index: int) -> Item:
        task, record = self._task, int(self.record[index])
        start = int(self.start[index])
        signal = read_signal(task, record, start, start + task.window_samples)
        window = torch.from_numpy(normalised(signal, task.normalise))
        item = transformed(window, self.transform), self._target.of(record)
        if not self.return_metadata:
            return item
        rate = float(task.dataset.sampling_rate)
        return *item, metadata_of(record_values(task, record), start, rate)


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
    transform, target, return_metadata : as for `VibrationDataset`
    n_epochs : epochs in one pass, each with other random draws, of units too; None never ends
    shuffle_buffer : windows that every worker holds back and draws from at random; 0 keeps the
        plan's order

    Raises
    ------
    ConfigError    for a name that does not exist, a target that the stream lacks, or a subset
        that would be empty

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
        transform: AnyTransform | None = None,
        target: str = "class",
        return_metadata: bool = False,
        n_epochs: int | None = 1,
        shuffle_buffer: int = 0,
    ) -> None:
        if shuffle_buffer < 0:
            raise ConfigError(f"shuffle_buffer = {shuffle_buffer} must be at least 0")
        options = WindowOptions(
            protocol=protocol,
            subset=subset,
            window_samples=window_samples,
            stride_samples=stride_samples,
            channels=channels,
            classes=classes,
            normalise=normalise,
            target=target,
            n_epochs=n_epochs,
        )
        self._windows = StreamedWindows(stream, options)
        self.class_names = self._windows.class_names
        self.target_names = self._windows.target_names
        self.n_windows = self._windows.n_windows
        self.transform, self.return_metadata = transform, return_metadata
        self.n_epochs, self.shuffle_buffer = n_epochs, shuffle_buffer

    @property
    def epoch(self) -> int:
        """The epoch at which the next pass begins."""
        return self._windows.epoch

    def set_epoch(self, epoch: int) -> None:
        """Begin the next pass at another epoch, in every worker."""
        self._windows.set_epoch(epoch)

    def __iter__(self) -> Iterator[Item]:
        index, n_workers = worker_share()
        epoch = self.epoch
        items = self._items(epoch, index, n_workers)
        if self.shuffle_buffer:
            rng = np.random.default_rng([self._windows.stream.seed, epoch, index])
            items = _shuffled(items, self.shuffle_buffer, rng)
        return items

    def _items(self, first_epoch: int, worker: int, n_workers: int) -> Iterator[Item]:
        """The items of one worker in the plan's order."""
        length = self._windows.options.window_samples
        rate = self._windows.sampling_rate
        for record in self._windows.records(first_epoch, worker, n_workers):
            for start in record.windows.start.tolist():
                cut = np.ascontiguousarray(record.signal[:, start : start + length])
                normal = normalised(cut, self._windows.options.normalise)
                window = transformed(torch.from_numpy(normal), self.transform)
                if self.return_metadata:
                    metadata = metadata_of(record.values, start, rate)
                    yield window, record.target, metadata
                else:
                    yield window, record.target


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
