"""Records in the angle domain: one turn of either gear instead of windows of time, for networks that ask for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.targets import fault_places, record_targets
from diagnose.data.windows import Read, Segments, Task, WindowSet, load_windows, read_signal
from gensig.errors import ConfigError, DatasetError
from gensig.signals.separation import separate_gears

N_TEETH, PER_TOOTH = "n_teeth", "samples_per_tooth"


def wants_turns(model_config: Mapping[str, Any]) -> bool:
    """Whether a network of this configuration reads turns rather than windows of time."""
    return PER_TOOTH in model_config


def completed(model_config: Mapping[str, Any], attributes: Mapping[str, Any], heads: Sequence[str]) -> dict[str, Any]:
    """The configuration with its further heads and, where the network needs them, the data set's tooth counts.

    Raises
    ------
    ConfigError    if the data set does not say them
    """
    config = {**model_config, "heads": list(heads)} if heads else dict(model_config)
    if not wants_turns(model_config):
        return config
    try:
        teeth = [int(attributes[f"n_teeth_{gear}"]) for gear in ("pinion", "wheel")]
    except KeyError as error:
        raise ConfigError(f"the data set does not say {error.args[0]}, which this model needs: model=cnn") from None
    return {**config, N_TEETH: teeth}


def check_turns(task: Task, segments: Segments, name: str) -> None:
    """Refuse stretches that hold no turn of the driving gear, before anything is read.

    Raises
    ------
    ConfigError    with the shortest one
    """
    speed = np.asarray(task.dataset.column("speed_rpm"), dtype=float)[segments.record]
    turns = (segments.stop - segments.start) / task.dataset.sampling_rate * speed / 60
    if turns.min() < 1:
        raise ConfigError(
            f"a stretch holds {turns.min():.2g} turns of the pinion, and model {name} needs "
            "a whole one: leave the protocol out, make longer records or choose another model"
        )


def load_inputs(
    task: Task,
    segments: Segments,
    model_config: Mapping[str, Any],
    *,
    training: bool = False,
    read: Read | None = None,
) -> WindowSet:
    """What a network reads of a subset: `load_windows`, or for a network that wants them the turns of each stretch.

    Parameters
    ----------
    task, segments : which signals
    model_config : with `completed`
    training : add the turns of either half of each stretch: the same teeth with other noise
    read : in place of `diagnose.data.windows.read_signal`
    """
    if not wants_turns(model_config):
        windows = load_windows(task, segments, read=read)
        return replace(windows, targets=record_targets(task.dataset, windows.record))
    speed = np.asarray(task.dataset.column("speed_rpm"), dtype=float)
    turns, index, passages = [], [], []
    n_teeth = model_config[N_TEETH]
    for position, row in enumerate(zip(segments.record, segments.start, segments.stop, strict=True)):
        record, start, stop = (int(value) for value in row)
        signal = (read or read_signal)(task, record, start, stop)
        middle, parts = (stop - start) // 2, [(signal, 0)]
        per_sample = float(speed[record]) / 60 * n_teeth[0] / task.dataset.sampling_rate
        for first in (0, middle) if training else ():
            parts.append((signal[:, first : first + middle], first))
        for part, first in parts:
            try:
                turns.append(packed_turns(part, task.dataset.sampling_rate, float(speed[record]), model_config))
            except ValueError as error:
                if part is signal:
                    raise DatasetError(f"record {record}: {error}; this model needs longer records") from None
                continue  # half a stretch may be too short
            index.append(position)
            passages.append((start + first) * per_sample)
    records = segments.record[np.array(index)]
    targets = record_targets(task.dataset, records)
    targets["place"] = fault_places(task.dataset, records, np.array(passages), n_teeth)
    windows = turn_set(tuple(turns), task.labels()[records], records, task.normalise)
    return replace(windows, targets=targets)


def packed_turns(
    signal: NDArray[np.floating], sampling_rate: float, speed_rpm: float, model_config: Mapping[str, Any]
) -> NDArray[np.float32]:
    """Turns of both gears and the mean passage of one recording, one after the other.

    Parameters
    ----------
    signal : (channel, sample) m/s^2
    sampling_rate : Hz
    speed_rpm : of the driving gear, constant
    model_config : ``n_teeth`` and ``samples_per_tooth`` of the network

    Returns
    -------
    (channel, point) float32 in the signal's unit, ``samples_per_tooth`` times all teeth and one

    Raises
    ------
    ValueError    for less than a turn of the driving gear
    """
    first, second = model_config[N_TEETH]
    found = separate_gears(
        signal, sampling_rate, speed_rpm / 60 * first, (first, second), samples_per_tooth=model_config[PER_TOOTH]
    )
    return np.concatenate([found.driving, found.driven, found.mesh], axis=-1).astype(np.float32)


def n_points(model_config: Mapping[str, Any]) -> int:
    """Points of `packed_turns`."""
    return int(model_config[PER_TOOTH] * (sum(model_config[N_TEETH]) + 1))


def turn_set(
    turns: tuple[NDArray[np.float32], ...], label: NDArray[Any], record: NDArray[Any], normalise: str
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
