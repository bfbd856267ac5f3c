"""Turns of both gears as the input of a network: records in the angle domain instead of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self, final

import numpy as np
from numpy.typing import NDArray

from diagnose.data.inputs import NetworkInput, RecordedSignal
from diagnose.data.targets import fault_positions, record_targets
from diagnose.data.windows import (
    FloatArray,
    Read,
    Segments,
    Task,
    WindowSet,
    read_signal,
)
from gensig.errors import ConfigError, DatasetError
from gensig.options.configuration import Section
from gensig.signals.separation import separate_gears

N_TEETH, PER_TOOTH = "n_teeth", "samples_per_tooth"  # of a network's configuration


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Turns(NetworkInput):
    """Turns of the driving and the driven gear and the mean passage of a tooth, end to end.

    Attributes
    ----------
    n_teeth : of the driving and the driven gear
    samples_per_tooth : of the turns
    """

    n_teeth: tuple[int, int]
    samples_per_tooth: int

    has_window_length: ClassVar[bool] = False
    why_not_exported: ClassVar[str | None] = (
        "this model looks at turns, which are made before the network: "
        "export one that reads windows"
    )

    @classmethod
    def completed(
        cls,
        model_config: Section,
        attributes: Mapping[str, Any],
    ) -> Section:
        """The configuration with the tooth counts of the data set."""
        try:
            teeth = [int(attributes[f"n_teeth_{gear}"]) for gear in ("pinion", "wheel")]
        except KeyError as error:
            raise ConfigError(
                f"the data set does not say {error.args[0]}, "
                "which this model needs: model=cnn"
            ) from None
        return model_config | {N_TEETH: teeth}

    @classmethod
    def of(cls, model_config: Section) -> Self:
        """Turns of the tooth counts and the samples a tooth that the configuration gives."""
        driving, driven = model_config[N_TEETH]
        return cls(n_teeth=(driving, driven), samples_per_tooth=model_config[PER_TOOTH])

    def check(self, task: Task, segments: Segments, network: str) -> None:
        """Refuse stretches that hold no turn of the driving gear, with the shortest one."""
        speed = _speed_rpm(task)[segments.record]
        seconds = (segments.stop - segments.start) / task.dataset.sampling_rate
        turns = seconds * speed / 60
        if turns.min() < 1:
            raise ConfigError(
                f"a stretch holds {turns.min():.2g} turns of the pinion, "
                f"and model {network} needs a whole one: leave the protocol out, "
                "make longer records or choose another model"
            )

    def n_points(self, window_samples: int) -> int:
        """Points of the packed turns, whatever the length of a window."""
        return int(self.samples_per_tooth * (sum(self.n_teeth) + 1))

    def load(
        self,
        task: Task,
        segments: Segments,
        *,
        training: bool = False,
        read: Read = read_signal,
    ) -> WindowSet:
        """Turns of each stretch; in training also of either half: the same teeth, other noise.

        Raises
        ------
        DatasetError    for a stretch without a whole turn
        """
        rate = task.dataset.sampling_rate
        speed_rpm = _speed_rpm(task).tolist()
        turns: list[NDArray[np.float32]] = []
        records: list[int] = []
        passages: list[float] = []
        for row in segments.rows():
            record, start, _ = row
            signal = read(task, *row)
            speed = speed_rpm[record]
            passages_per_sample = speed / 60 * self.n_teeth[0] / rate
            for first, part in _parts(signal, halves=training):
                try:
                    turns.append(self.packed(part, rate, speed))
                except ValueError as error:
                    if part is signal:
                        raise DatasetError(
                            f"record {record}: {error}; this model needs longer records"
                        ) from None
                    continue  # half a stretch may be too short
                records.append(record)
                passages.append((start + first) * passages_per_sample)
        record_of, passage = np.array(records), np.array(passages)
        targets = record_targets(task.dataset, record_of)
        targets["position"] = fault_positions(
            task.dataset, record_of, passage, self.n_teeth
        )
        label = task.labels()[record_of]
        windows = _turn_set(tuple(turns), label, record_of, task.normalise)
        return replace(windows, targets=targets)

    def of_recording(self, recording: RecordedSignal) -> WindowSet:
        """Turns of a whole recording.

        Raises
        ------
        ConfigError    for an unknown speed, or less than a turn
        """
        file, speed_rpm = recording.file, recording.speed_rpm
        if speed_rpm is None:
            raise ConfigError(
                "this model looks at turns and must know the speed: "
                f"say --speed-rpm of {file}"
            )
        try:
            turns = self.packed(recording.signal, recording.sampling_rate, speed_rpm)
        except ValueError as error:
            raise ConfigError(f"{file}: {error}") from None
        nothing = np.zeros(1, dtype=np.int64)
        return _turn_set((turns,), nothing, nothing, recording.normalise)

    def seconds(self, *, window: float, recording: float) -> float:
        """Seconds of the whole recording."""
        return recording

    def packed(
        self,
        signal: FloatArray,
        sampling_rate: float,
        speed_rpm: float,
    ) -> NDArray[np.float32]:
        """Turns of both gears and the mean passage of one recording, one after the other.

        Parameters
        ----------
        signal : (channel, sample) m/s^2
        sampling_rate : Hz
        speed_rpm : of the driving gear, constant

        Returns
        -------
        (channel, point) float32 in the signal's unit, `n_points` of them

        Raises
        ------
        ValueError    for less than a turn of the driving gear
        """
        gears = separate_gears(
            signal,
            sampling_rate,
            speed_rpm / 60 * self.n_teeth[0],
            self.n_teeth,
            samples_per_tooth=self.samples_per_tooth,
        )
        packed = np.concatenate([gears.driving, gears.driven, gears.mesh], axis=-1)
        return packed.astype(np.float32)


def _speed_rpm(task: Task) -> FloatArray:
    """(record,) speed of the driving gear."""
    return np.asarray(task.dataset.column("speed_rpm"), dtype=float)


def _parts(
    signal: NDArray[np.float32], *, halves: bool
) -> list[tuple[int, NDArray[np.float32]]]:
    """First sample and signal of the whole and, if wanted, of its two halves."""
    parts = [(0, signal)]
    if halves:
        middle = signal.shape[-1] // 2
        parts += [(0, signal[:, :middle]), (middle, signal[:, middle : 2 * middle])]
    return parts


def _turn_set(
    turns: tuple[NDArray[np.float32], ...],
    label: NDArray[Any],
    record: NDArray[Any],
    normalise: str,
) -> WindowSet:
    """Packed turns as windows that fill their signal."""
    return WindowSet(
        signals=turns,
        segment=np.arange(len(turns)),
        start=np.zeros(len(turns), dtype=np.int64),
        label=label,
        record=record,
        window_samples=turns[0].shape[-1],
        normalise=normalise,
    )
