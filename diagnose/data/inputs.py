"""Kinds of input that a network reads of a record: the interface of windows, turns and others."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import Read, Segments, Task, WindowSet, read_signal
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class SoundSignal:
    """A healthy recording of the machine of another recording, at the rate of a network.

    Attributes
    ----------
    signal : (channel, sample) m/s^2
    speed_rpm : of the driving shaft
    """

    signal: NDArray[np.float32]
    speed_rpm: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedSignal:
    """A recording at the rate of a network, and how the records of its training were cut.

    Attributes
    ----------
    signal : (channel, sample) m/s^2
    sampling_rate : Hz
    speed_rpm : of the driving shaft; None if it is not known
    n_teeth : of the driving and the driven gear; None if they are not known
    file : name of the recording, for messages
    window_samples, stride_samples, normalise : as in `diagnose.data.windows.Task`
    healthy : healthy recordings of the same machine, for a network that compares with them
    """

    signal: NDArray[np.float32]
    sampling_rate: float
    speed_rpm: float | None
    file: str
    window_samples: int
    stride_samples: int
    normalise: str
    n_teeth: tuple[int, int] | None = None
    healthy: tuple[SoundSignal, ...] = ()


class NetworkInput(ABC):
    """Kind of input of a network, with the values that its configuration gives.

    A network names its kind once, in `diagnose.networks.network.Network.inputs`. Studies,
    predictions and exports ask the value that `diagnose.networks.registry.input_of` reads.

    Attributes
    ----------
    has_window_length : True if ``window_samples`` and ``stride_samples`` decide how it is cut
    why_not_exported : reason in one line why no ONNX file can make it of m/s^2; None if one can
    """

    has_window_length: ClassVar[bool]
    why_not_exported: ClassVar[str | None]

    @property
    def compares(self) -> bool:
        """True if the input compares a record with healthy ones of its machine."""
        return False

    @property
    def of_stored_records(self) -> Self:
        """The same input without examples that a training draws beside its records."""
        return self

    @classmethod
    @abstractmethod
    def completed(
        cls,
        model_config: Section,
        dataset: Dataset,
    ) -> Section:
        """Configuration of a network with the values that its input takes of a data set.

        Raises
        ------
        ConfigError    if the data set lacks one of them
        """

    @classmethod
    @abstractmethod
    def of(cls, model_config: Section) -> Self:
        """Input of a completed configuration, of a study or of a stored network."""

    @abstractmethod
    def check(self, task: Task, segments: Segments, network: str) -> None:
        """Refuse stretches that hold no input, before anything is read.

        Raises
        ------
        ConfigError    with the name of the network where it matters
        """

    @abstractmethod
    def example(self, n_channels: int, window_samples: int) -> NDArray[np.float32]:
        """An input (1, channel, point) without vibration, for windows of a study's length."""

    @abstractmethod
    def load(
        self,
        task: Task,
        segments: Segments,
        *,
        training: bool = False,
        read: Read = read_signal,
    ) -> WindowSet:
        """Inputs of stretches of a data set, with labels and further targets.

        Parameters
        ----------
        training : True if inputs may be added that only a training profits from
        read : signal of a stretch
        """

    @abstractmethod
    def of_recording(self, recording: RecordedSignal) -> WindowSet:
        """Inputs of a recording, whose record and label are 0.

        Raises
        ------
        ConfigError    for a recording that holds none
        """

    @abstractmethod
    def seconds(self, *, window: float, recording: float) -> float:
        """Duration of one input, given those of a window and of a whole recording, in s."""
