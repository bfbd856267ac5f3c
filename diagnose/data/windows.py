"""Stretches of records in each subset of a split, and the windows cut from them.

Windows are always cut after the split.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

IntArray = NDArray[np.integer]
FloatArray = NDArray[np.floating]
SUBSETS = ("train", "validation", "test")
REFERENCES = "references"  # reference records of the machines of the validation part
NORMALISATIONS = ("rms", "none")
HEALTHY = "healthy"  # name of the class without a fault
CROSS_SENSOR = "cross_sensor"  # the units of by_unit, tested on other channels
IS_REFERENCE = "is_reference"  # 1: an extra healthy record, neither example nor scored
ROUNDING = 1e-6  # of a sample


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A data set as one classification task: its classes, channels and windows.

    Attributes
    ----------
    dataset : Dataset
    class_names : order of the labels; records of other classes are left out
    channel_names : in the order of the network's input
    window_samples, stride_samples : length of a window and step from one to the next, in samples
    normalise : ``"rms"`` divides each channel of each window by its RMS, ``"none"`` keeps m/s^2
    one_class : True if one class is enough, because classes are not what is learnt
    of_references : True for the reference records in place of the examples
    cross_channels : channels that `CROSS_SENSOR` trains and tests on,
        or the reason why there are none, in one line
    """

    dataset: Dataset
    class_names: tuple[str, ...]
    channel_names: tuple[str, ...]
    window_samples: int
    stride_samples: int
    normalise: str
    one_class: bool = False
    of_references: bool = False
    cross_channels: tuple[tuple[str, ...], tuple[str, ...]] | str = (
        "no channels to test on are named"
    )

    def __post_init__(self) -> None:
        check_names("class", self.class_names, self.dataset.class_names)
        check_names("channel", self.channel_names, self.dataset.channel_names)
        check_names("normalisation", (self.normalise,), NORMALISATIONS)
        if self.window_samples < 1 or self.stride_samples < 1:
            raise ConfigError("window_samples and stride_samples must be at least 1")
        if len(self.class_names) < 2 and not self.one_class:
            raise ConfigError(
                f"one class only ({', '.join(self.class_names)}): nothing to tell apart"
            )

    @property
    def channels(self) -> list[int]:
        """Index of each channel in the data set."""
        available = list(self.dataset.channel_names)
        return [available.index(name) for name in self.channel_names]

    def part(self, protocol: str, subset: str) -> Task:
        """The task of one subset of a protocol, or of `REFERENCES`.

        `CROSS_SENSOR` has other channels in its test part.

        Raises
        ------
        ConfigError    for `CROSS_SENSOR` of a task that has no channels to test on
        """
        part = self
        if subset == REFERENCES:
            part = replace(self, of_references=True)
        if protocol != CROSS_SENSOR:
            return part
        if isinstance(self.cross_channels, str):
            raise ConfigError(f"protocol {protocol}: {self.cross_channels}")
        trained, tested = self.cross_channels
        return replace(part, channel_names=tested if subset == "test" else trained)

    def labels(self) -> IntArray:
        """(record,) index into `class_names`; -1 for a record that is no example.

        That is one of another class, one that failed, and one that others are compared with. A task
        `of_references` has the labels of these alone.
        """
        order = {name: index for index, name in enumerate(self.class_names)}
        names = [
            self.dataset.class_names[int(label)]
            for label in self.dataset.column("label")
        ]
        labels = np.array([order.get(name, -1) for name in names], dtype=np.int64)
        is_example = np.asarray(self.dataset.usable, dtype=bool)
        is_reference = np.zeros_like(is_example)
        # a stream has examples alone, and no list of its columns
        if IS_REFERENCE in getattr(self.dataset, "column_names", ()):
            is_reference = np.asarray(self.dataset.column(IS_REFERENCE)) == 1
        wanted = is_reference == self.of_references
        return np.where(is_example & wanted, labels, -1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Stretches of records: (segment,) record index, first sample, sample after the last."""

    record: IntArray
    start: IntArray
    stop: IntArray

    def rows(self) -> list[tuple[int, int, int]]:
        """Record, first sample and sample after the last of each stretch."""
        columns = (self.record.tolist(), self.start.tolist(), self.stop.tolist())
        return list(zip(*columns, strict=True))

    def of(self, chosen: IntArray | NDArray[np.bool_]) -> Segments:
        """The chosen stretches."""
        return Segments(
            record=self.record[chosen],
            start=self.start[chosen],
            stop=self.stop[chosen],
        )


def task_of(
    dataset: Dataset,
    *,
    window_samples: int,
    stride_samples: int,
    normalise: str,
    classes: Sequence[str] | None = None,
    channels: Sequence[str] | None = None,
    one_class: bool = False,
) -> Task:
    """Task over the named classes and channels, all of the data set's where None."""
    if classes is None:
        classes = dataset.class_names
    if channels is None:
        channels = dataset.channel_names
    return Task(
        dataset=dataset,
        class_names=tuple(classes),
        channel_names=tuple(channels),
        window_samples=window_samples,
        stride_samples=stride_samples,
        normalise=normalise,
        one_class=one_class,
    )


def subsets_of(task: Task, protocol: str) -> tuple[str, ...]:
    """`SUBSETS`, and `REFERENCES` where machines of the validation part have any."""
    if reference_segments(task, protocol).record.size:
        return (*SUBSETS, REFERENCES)
    return SUBSETS


def reference_segments(task: Task, protocol: str) -> Segments:
    """Whole reference records of machines that are in the validation part and in no other.

    There may be none.
    """
    record = np.flatnonzero(task.part(protocol, REFERENCES).labels() >= 0)
    if record.size:
        unit = np.asarray(task.dataset.column("unit_id"))
        train, validation, test = (
            unit[subset_segments(task, protocol, subset).record] for subset in SUBSETS
        )
        held_back = np.setdiff1d(validation, np.concatenate([train, test]))
        record = record[np.isin(unit[record], held_back)]
    return _whole(task, record)


def subset_segments(task: Task, protocol: str, subset: str) -> Segments:
    """Stretches of one subset of a split, records of other classes and failed ones left out.

    Parameters
    ----------
    subset : of `subsets_of`

    Raises
    ------
    ConfigError    for a protocol or subset that does not exist, or a subset without records
    """
    if subset == REFERENCES:
        return reference_segments(task, protocol)
    stored = "by_unit" if protocol == CROSS_SENSOR else protocol
    check_names("protocol", (stored,), task.dataset.protocols)
    check_names("subset", (subset,), SUBSETS)
    labels, length = task.labels(), n_samples(task.dataset)
    rows = [
        row for row in task.dataset.split(stored).get(subset, []) if labels[row[0]] >= 0
    ]
    if not rows:
        raise ConfigError(
            f"protocol {protocol}: its {subset} part is empty; "
            "make more records or leave the protocol out"
        )
    record, start, stop = np.array(rows, dtype=float).T
    return Segments(
        record=record.astype(np.int64),
        start=np.ceil(start * length - ROUNDING).astype(np.int64),
        stop=np.floor(stop * length + ROUNDING).astype(np.int64),
    )


def all_segments(task: Task) -> Segments:
    """Every whole record of the task's classes that did not fail."""
    record = np.flatnonzero(task.labels() >= 0)
    if record.size == 0:
        raise DatasetError(
            f"{task.dataset.folder}: no usable record of {', '.join(task.class_names)}"
        )
    return _whole(task, record)


def _whole(task: Task, record: IntArray) -> Segments:
    """Whole records."""
    length = n_samples(task.dataset)
    return Segments(
        record=record, start=np.zeros_like(record), stop=np.full_like(record, length)
    )


def plan_windows(
    segments: Segments, window_samples: int, stride_samples: int
) -> tuple[IntArray, IntArray]:
    """Windows that lie whole inside their segment.

    Returns
    -------
    segment : (window,) index of the segment
    start : (window,) first sample, counted in the record

    Raises
    ------
    ConfigError    if no segment is as long as a window
    """
    lengths = segments.stop - segments.start
    counts = np.maximum((lengths - window_samples) // stride_samples + 1, 0)
    if counts.sum() == 0:
        raise ConfigError(
            f"window_samples={window_samples} is too long: "
            f"the longest stretch holds {lengths.max()} samples"
        )
    segment = np.repeat(np.arange(counts.size), counts)
    step = np.concatenate([np.arange(count) for count in counts])
    return segment, segments.start[segment] + step * stride_samples


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowSet:
    """One subset in memory: its stretches of signal and the windows planned on them.

    Attributes
    ----------
    signals : one (channel, sample) float32 array in m/s^2 per segment
    segment, start : (window,) segment of each window, and its first sample in that segment
    label, record : (window,)
    window_samples, normalise : as in `Task`; a signal that is shorter than a window is one, with
        zeros behind it
    targets : further (window,) values to learn; see `diagnose.data.targets`
    n_header : points at the beginning of each signal that are no vibration and stay as they are
    levels : (window, feature) of the domain, see `diagnose.networks.domain`; None for the levels
        of the windows in bands
    """

    signals: tuple[NDArray[np.float32], ...]
    segment: IntArray
    start: IntArray
    label: IntArray
    record: IntArray
    window_samples: int
    normalise: str
    targets: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    n_header: int = 0
    levels: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.segment.size)

    def blocks(self, size: int) -> list[IntArray]:
        """Numbers of all windows, in blocks of about equal length, at most `size` each."""
        return np.array_split(np.arange(len(self)), -(-len(self) // size))

    def subset(self, chosen: IntArray) -> WindowSet:
        """The chosen windows, on the same signals."""
        targets = {name: values[chosen] for name, values in self.targets.items()}
        levels = self.levels
        if levels is not None:
            levels = levels[chosen]
        return replace(
            self,
            levels=levels,
            segment=self.segment[chosen],
            start=self.start[chosen],
            label=self.label[chosen],
            record=self.record[chosen],
            targets=targets,
        )

    def cut(
        self, windows: IntArray, rng: np.random.Generator | None = None
    ) -> NDArray[np.float32]:
        """Cut windows, at their planned start or, with `rng`, anywhere in their segment.

        Returns
        -------
        (window, channel, sample) float32, normalised
        """
        lengths = [self._length(window) for window in windows]
        shape = (len(windows), self.signals[0].shape[0], max(lengths, default=0))
        chosen = np.zeros(shape, dtype=np.float32)
        for row, (window, length) in enumerate(zip(windows, lengths, strict=True)):
            signal = self.signals[self.segment[window]]
            start = int(self.start[window])
            if rng is not None:
                start = int(rng.integers(signal.shape[-1] - length + 1))
            chosen[row, :, :length] = signal[:, start : start + length]
        self._normalise(chosen, lengths)
        return chosen

    def _length(self, window: int) -> int:
        """Points of a window: those of its signal, if that is shorter."""
        signal = self.signals[self.segment[window]]
        return min(self.window_samples, signal.shape[-1])

    def _normalise(self, windows: NDArray[np.float32], lengths: Sequence[int]) -> None:
        """Normalise windows (window, channel, point) in place, without what fills them up."""
        if len(set(lengths)) == 1:
            vibration = windows[..., self.n_header :]
            vibration[...] = normalised(vibration, self.normalise)
            return
        for window, length in zip(windows, lengths, strict=True):
            vibration = window[:, self.n_header : length]
            vibration[...] = normalised(vibration, self.normalise)


Read = Callable[["Task", int, int, int], NDArray[np.float32]]


def read_signal(
    task: Task, record: int, start: int, stop: int, *, name: str = "acceleration"
) -> NDArray[np.float32]:
    """(channel, sample) m/s^2 of the task's channels; refuses values that are not finite."""
    signal = np.asarray(
        task.dataset.signals(record, start, stop, task.channels, name=name),
        dtype=np.float32,
    )
    if not np.isfinite(signal).all():
        record_id = task.dataset.column("record_id")[record]
        raise DatasetError(
            f"record {record_id} of {task.dataset.folder}: "
            "its signal holds values that are not finite"
        )
    return signal


def load_windows(
    task: Task, segments: Segments, *, read: Read = read_signal
) -> WindowSet:
    """Windows of stretches, whose signals are read into memory (4 bytes a sample) by `read`.

    Raises
    ------
    DatasetError    for a signal that is not finite
    """
    segment, start = plan_windows(segments, task.window_samples, task.stride_samples)
    used, segment = np.unique(segment, return_inverse=True)
    stretches = segments.of(used)
    record = stretches.record[segment]
    return WindowSet(
        signals=tuple(read(task, *row) for row in stretches.rows()),
        segment=segment,
        start=start - stretches.start[segment],
        label=task.labels()[record],
        record=record,
        window_samples=task.window_samples,
        normalise=task.normalise,
    )


def normalised(windows: NDArray[np.float32], how: str) -> NDArray[np.float32]:
    """Windows (..., channel, sample) without their mean; for ``"rms"`` divided by their RMS.

    Both are taken channel by channel.
    """
    centered = windows - windows.mean(axis=-1, keepdims=True)
    if how == "none":
        return centered
    level = np.sqrt(
        np.einsum("...s,...s->...", centered, centered) / centered.shape[-1]
    )[..., None]
    centered *= np.divide(1, level, out=np.zeros_like(level), where=level > 0)
    return centered


def input_scale(windows: WindowSet) -> list[float]:
    """RMS of each channel over the signals; 1 for a silent one, and under ``"rms"``."""
    if windows.normalise == "rms":
        return [1.0] * windows.signals[0].shape[0]
    signals = [signal[:, windows.n_header :] for signal in windows.signals]
    power = np.mean([np.var(signal, axis=-1) for signal in signals], axis=0)
    return [float(value) for value in np.where(power > 0, np.sqrt(power), 1.0)]


def n_samples(dataset: Dataset) -> int:
    """Samples a record, the same for all."""
    return int(dataset.n_samples)


def check_names(kind: str, wanted: Sequence[Any], available: Sequence[str]) -> None:
    """Refuse a name that does not exist, with the nearest ones."""
    for name in wanted:
        if name not in available:
            hint = f"there is {', '.join(available)}"
            if close := difflib.get_close_matches(str(name), list(available), n=2):
                hint = f"did you mean {' or '.join(close)}?"
            raise ConfigError(f"no {kind} '{name}'; {hint}")
