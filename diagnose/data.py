"""Data sets for torch: one window at a time from the files, for training loops of your own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import torch
import torch.utils.data

from diagnose.windows import normalised, plan_windows, read_signal, subset_segments, task_of

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


class VibrationDataset(torch.utils.data.Dataset[tuple[torch.Tensor, int]]):
    """Windows of one subset of a split, read when asked for; safe in forked and spawned workers.

    Windows are cut after the split: each lies inside the stretch that the split gives to its subset.

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
    An item is ``(window, label)``: (channel, sample) float32 and an index into ``class_names``. ``record`` gives the
    record of every window, so that predictions can be averaged over a record.
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

    def __getitem__(self, index: int) -> tuple[torch.Tensor, int]:
        start = int(self.start[index])
        signal = read_signal(self._task, int(self.record[index]), start, start + self._task.window_samples)
        return torch.from_numpy(normalised(signal, self._task.normalise)), int(self.label[index])
