"""A recording as the user describes it, and the channels of its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.signals.recording import RecordingFile, read_file, without_unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A recording as the user describes it; None where the file says it or nothing is known.

    Attributes
    ----------
    file : see `gensig.signals.recording.read_file`
    sampling_rate : Hz
    speed_rpm : r/min of the driving shaft, compared with the speeds of the training records
    teeth : of the driving and the driven gear, compared with those of the training records
    tacho : name of a channel with the pulses of the driving shaft
    pulses_per_turn : of it
    as_recorded : no order tracking, whatever is known
    to_speed_rpm : r/min that an order-tracked recording is played at; None is its own mean
    channels : names in the file, in the order of the network's
    unit : m/s2 or g
    array : name in a .npz, HDF5 or MATLAB file
    healthy : recordings of the same machine when it was healthy, described in the same way
    torque_nm : N m of the driving shaft, for remaining lives
    life_time_h : h since the machine was new, for remaining lives with the age
    held_out : True to score only what was held out of a recording that carried implants
    """

    file: str
    sampling_rate: float | None = None
    speed_rpm: float | None = None
    teeth: tuple[int, int] | None = None
    tacho: str | None = None
    pulses_per_turn: int = 1
    as_recorded: bool = False
    to_speed_rpm: float | None = None
    channels: tuple[str, ...] | None = None
    unit: str = "m/s2"
    array: str | None = None
    healthy: tuple[Source, ...] = ()
    torque_nm: float | None = None
    life_time_h: float | None = None
    held_out: bool = False

    def __post_init__(self) -> None:
        if self.speed_rpm is not None and not 0.0 < self.speed_rpm < 1e6:
            raise ConfigError(f"--speed-rpm {self.speed_rpm:g} must be positive")
        if self.teeth is not None:
            few, many = sorted(self.teeth)
            if few < 4 or many > 1000:
                raise ConfigError(
                    f"--teeth {self.teeth[0]} {self.teeth[1]}: a gear has 4 to 1000 teeth",
                )
        if self.pulses_per_turn < 1:
            raise ConfigError(
                f"--pulses-per-turn {self.pulses_per_turn} must be at least 1"
            )
        if self.to_speed_rpm is not None and not self.is_tracked:
            raise ConfigError(
                "--to-speed needs order tracking: give --tacho, or --teeth and --speed-rpm",
            )
        if Path(self.file).expanduser().is_dir():
            raise ConfigError(
                f"{self.file} is a folder, not a recording; for a data set use diagnose evaluate",
            )

    @property
    def is_tracked(self) -> bool:
        """True if enough is known to follow the speed."""
        by_mesh = self.teeth is not None and self.speed_rpm is not None
        return (self.tacho is not None or by_mesh) and not self.as_recorded


def tacho_apart(
    content: RecordingFile, tacho: str | None
) -> tuple[RecordingFile, NDArray[np.float64] | None]:
    """A file without the channel of its tachometer, and that channel; None where none is named.

    Raises
    ------
    ConfigError    for a channel that is not there, or is the only one
    """
    if tacho is None:
        return content, None
    if tacho not in content.channels:
        raise ConfigError(
            f"{content.file}: no channel {tacho}; it has {', '.join(content.channels)}",
        )
    index = content.channels.index(tacho)
    names = tuple(name for name in content.channels if name != tacho)
    if not names:
        raise ConfigError(f"{content.file}: there is no channel beside {tacho}")
    others = np.delete(content.values, index, axis=0)
    return replace(content, channels=names, values=others), content.values[index]


def read_source(
    source: Source,
) -> tuple[RecordingFile, NDArray[np.float64] | None]:
    """Content of the file of a recording without its tachometer, and that channel.

    Raises
    ------
    ConfigError    for a file that cannot be read, and as `tacho_apart`
    """
    content = read_file(
        source.file,
        rate=source.sampling_rate,
        array=source.array,
        rate_option="--sampling-rate",
    )
    return tacho_apart(content, source.tacho)


def chosen_channels(
    content: RecordingFile,
    wanted: Sequence[str],
    given: Sequence[str] | None,
) -> tuple[str, ...]:
    """Channels of the file for those of the network.

    As given, by name, or in order where no name says otherwise.

    Raises
    ------
    ConfigError    for another number of channels, or names that say nothing
    """
    needs = f"the model takes {len(wanted)}, {', '.join(wanted)}"
    if given is not None:
        if len(given) != len(wanted):
            raise ConfigError(
                f"--channels names {len(given)} channel(s); {needs}: name as many, in this order",
            )
        return tuple(given)
    by_name = {without_unit(name): name for name in content.channels}
    if all(name in by_name for name in wanted):
        return tuple(by_name[name] for name in wanted)
    names = ", ".join(content.channels)
    has = f"{content.file} has {len(content.channels)} channel(s), {names}"
    if len(content.channels) != len(wanted):
        raise ConfigError(f"{has}; {needs}: choose with --channels, in this order")
    if content.named and len(wanted) > 1:
        raise ConfigError(
            f"{has}; {needs}: say which is which with --channels, in this order"
        )
    return content.channels
