"""Windows of time as the input of a network."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Self, final

import numpy as np
from numpy.typing import NDArray

from diagnose.data.inputs import NetworkInput, RecordedSignal
from diagnose.data.targets import record_targets
from diagnose.data.windows import (
    Read,
    Segments,
    Task,
    WindowSet,
    load_windows,
    plan_windows,
    read_signal,
)
from gensig.errors import ConfigError
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


@final
@dataclass(frozen=True, slots=True)
class Windows(NetworkInput):
    """Windows of a fixed number of samples, adjacent or overlapping."""

    has_window_length: ClassVar[bool] = True
    why_not_exported: ClassVar[str | None] = None

    @classmethod
    def completed(
        cls,
        model_config: Section,
        dataset: Dataset,
    ) -> Section:
        """The configuration as it is."""
        return model_config

    @classmethod
    def of(cls, model_config: Section) -> Self:
        """The same value for every configuration."""
        return cls()

    def check(self, task: Task, segments: Segments, network: str) -> None:
        """Refuse stretches that are all shorter than a window."""
        plan_windows(segments, task.window_samples, task.stride_samples)

    def example(self, n_channels: int, window_samples: int) -> NDArray[np.float32]:
        """A silent window."""
        return np.zeros((1, n_channels, window_samples), dtype=np.float32)

    def load(
        self,
        task: Task,
        segments: Segments,
        *,
        training: bool = False,
        read: Read = read_signal,
    ) -> WindowSet:
        """Windows of stretches, the same for training and test."""
        windows = load_windows(task, segments, read=read)
        return replace(windows, targets=record_targets(task.dataset, windows.record))

    def of_recording(self, recording: RecordedSignal) -> WindowSet:
        """Windows of a whole recording.

        Raises
        ------
        ConfigError    for a recording shorter than a window
        """
        n_samples, rate = recording.signal.shape[-1], recording.sampling_rate
        if n_samples < recording.window_samples:
            raise ConfigError(
                f"{recording.file} is too short: {n_samples / rate:.3g} s, "
                f"a window of the model is {recording.window_samples / rate:.3g} s"
            )
        zero = np.array([0])
        whole = Segments(record=zero, start=zero, stop=np.array([n_samples]))
        zeros, start = plan_windows(
            whole, recording.window_samples, recording.stride_samples
        )
        return WindowSet(
            signals=(recording.signal,),
            segment=zeros,
            start=start,
            label=zeros,
            record=zeros,
            window_samples=recording.window_samples,
            normalise=recording.normalise,
        )

    def seconds(self, *, window: float, recording: float) -> float:
        """Seconds of a window."""
        return window
