"""Windows of stored records, read on demand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import torch
import torch.utils.data

from diagnose.data.loading.items import (
    Item,
    known_segments,
    metadata_of,
    record_values,
    target_of,
)
from diagnose.data.loading.transforms import AnyTransform, transformed
from diagnose.data.windows import normalised, plan_windows, read_signal, task_of

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


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
