"""Recordings of users: accelerations of some sensors at one rate.

Every mistake is answered by one line.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.signals.reading.reader_process import limits_for, read_apart
from gensig.signals.reading.recording_files import LEAST_SAMPLES, Content
from gensig.text.user_file import check_rate, open_given

STANDARD_GRAVITY = 9.80665  # m/s2
UNITS = {"m/s2": 1.0, "g": STANDARD_GRAVITY}
SUFFIXES = {"_m_per_s2": 1.0, "_g": STANDARD_GRAVITY}
WRONG_SUFFIXES = (
    "_rad_per_s2",
    "_rad_per_s",
    "_rad",
    "_mm_per_s",
    "_um",
    "_mm",
    "_v",
    "_mv",
    "_rpm",
    "_nm",
    "_deg",
)
READER_MODULE = "gensig.signals.reading.recording_files"
# type of a file -> function of that module, which another process calls
READERS = {
    ".csv": "read_csv",
    ".npy": "read_npy",
    ".npz": "read_npz",
    ".wav": "read_wav",
    ".h5": "read_hdf5",
    ".hdf5": "read_hdf5",
    ".mat": "read_mat",
}
TYPES = tuple(READERS)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingFile:
    """A file as it was read, before channels and units are chosen.

    Attributes
    ----------
    file : as the user named it
    channels : names of the columns, or ``channel_0``, ``channel_1``, ... where the file has none
    named : True where the names are those of the file
    values : (channel, sample) in the file's units
    sampling_rate : Hz
    has_level : False for a WAV file of whole numbers
    """

    file: str
    channels: tuple[str, ...]
    named: bool
    values: Array
    sampling_rate: float
    has_level: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """Accelerations of some sensors.

    Names, (sensor, sample) m/s2 without the mean, and samples per second.
    """

    sensors: tuple[str, ...]
    acceleration: Array
    sampling_rate: float

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.acceleration.shape[1] / self.sampling_rate

    def part(self, first: float, last: float) -> Recording:
        """From one share of its length to another."""
        n_samples = self.acceleration.shape[1]
        stretch = self.acceleration[
            :, round(first * n_samples) : round(last * n_samples)
        ]
        return replace(self, acceleration=stretch - stretch.mean(axis=1, keepdims=True))


def read_file(
    file: str,
    *,
    rate: float | None = None,
    array: str | None = None,
    rate_option: str = "--rate",
) -> RecordingFile:
    """Channels and rate of a file.

    Parameters
    ----------
    file : CSV of one column a sensor, with or without ``time_s``; WAV; .npy of (sample,) or
        (sensor, sample); .npz, HDF5 or MATLAB (version 5 or 7.3) with such an array and, if it
        likes, its rate as ``sampling_rate_hz``
    rate : Hz    samples per second; needed where the file does not tell
    array : name of the array in a .npz, HDF5 or MATLAB file; None is ``acceleration``
    rate_option : how the user's command calls `rate`

    Raises
    ------
    ConfigError    with one line, for files, arrays and rates that cannot be used
    """
    if rate is not None:
        _check_range(rate, f"{rate_option} {rate:g}")
    suffix = Path(file).suffix.lower()
    if suffix not in TYPES:
        raise ConfigError(
            f"{file}: the name must end in {', '.join(TYPES)}; "
            "write the recording as one of these"
        )
    content = _content(file, suffix, array)
    if content.names is not None:
        return _table(file, content.names, content.values, rate, rate_option)
    stored = content.sampling_rate
    _check_range(
        stored, f"{file}: {content.rate_from} has {stored} samples a second, which"
    )
    if stored is None and rate is None:
        raise ConfigError(
            f"{file}: an array tells no rate; give the samples a second with {rate_option}"
        )
    _check_agreement(file, content.rate_from, stored, rate_option, rate)
    return RecordingFile(
        file=file,
        channels=tuple(f"channel_{index}" for index in range(len(content.values))),
        named=False,
        values=content.values,
        sampling_rate=float(rate or stored or 0.0),
        has_level=content.has_level,
    )


def recording_of(
    source: RecordingFile,
    *,
    unit: str = "m/s2",
    channels: Sequence[str] | None = None,
    needs_level: bool = True,
) -> Recording:
    """Some channels of a file as accelerations.

    Parameters
    ----------
    source : of `read_file`
    unit : of columns whose name does not end in ``_m_per_s2`` or ``_g``
    channels : the columns, or numbers of the rows of an array, that are used; None takes all
    needs_level : refuse samples that have no level in m/s2

    Raises
    ------
    ConfigError    with one line, for channels, units and samples that cannot be used
    """
    file, names = source.file, source.channels
    if unit not in UNITS:
        raise ConfigError(f"--unit {unit}: allowed: {', '.join(UNITS)}")
    if needs_level and not source.has_level:
        raise ConfigError(
            f"{file} holds whole numbers, which have no level in m/s2; write it with float samples"
        )
    if missing := [name for name in channels or () if name not in names]:
        raise ConfigError(f"{file}: no channel {missing[0]}; it has {', '.join(names)}")
    if channels is not None and (not channels or len(set(channels)) < len(channels)):
        raise ConfigError("--channels: name at least one channel, each once")
    chosen = list(channels or names)
    rows = np.stack(
        [
            source.values[names.index(name)] * _factor(file, name, unit)
            for name in chosen
        ]
    )
    if rows.shape[1] < LEAST_SAMPLES:
        raise ConfigError(
            f"{file} is too short: {rows.shape[1]} samples, at least {LEAST_SAMPLES} are needed"
        )
    for name, row in zip(chosen, rows, strict=True):
        if not np.all(np.isfinite(row)):
            raise ConfigError(
                f"{file}: sample {int(np.argmin(np.isfinite(row)))} of {name} is no finite number"
            )
        if not np.ptp(row) > 0.0:
            raise ConfigError(
                f"{file}: {name} holds one value throughout; leave it out with --channels"
            )
    return Recording(
        sensors=tuple(without_unit(name) for name in chosen),
        acceleration=rows - rows.mean(axis=1, keepdims=True),
        sampling_rate=source.sampling_rate,
    )


def without_unit(name: str) -> str:
    """Name of a column less the unit at its end."""
    for end in SUFFIXES:
        if name.lower().endswith(end):
            return name[: -len(end)]
    return name


def _content(file: str, suffix: str, array: str | None) -> Content:
    """Content of a file, from the process that reads it."""
    path = Path(file).expanduser()
    try:
        with open_given(file, path) as stream:
            n_bytes = os.fstat(stream.fileno()).st_size
    except OSError as error:
        raise ConfigError(f"{file} cannot be read: {error.strerror}") from None
    reader = f"{READER_MODULE}:{READERS[suffix]}"
    return read_apart(reader, file, array, limits_for(n_bytes))


def _table(
    file: str,
    names: tuple[str, ...],
    values: Array,
    rate: float | None,
    rate_option: str,
) -> RecordingFile:
    """Columns of a table as channels, with the rate of its times or the given one."""
    if "time_s" in names:
        names, values, rate = _timed(file, names, values, rate, rate_option)
    if rate is None:
        raise ConfigError(
            f"{file}: it has no column time_s; give the samples a second with {rate_option}"
        )
    return RecordingFile(
        file=file,
        channels=names,
        named=True,
        values=values,
        sampling_rate=rate,
        has_level=True,
    )


def _timed(
    file: str,
    names: tuple[str, ...],
    values: Array,
    rate: float | None,
    rate_option: str,
) -> tuple[tuple[str, ...], Array, float]:
    """Names and values of the columns beside the time, and the rate."""
    time = values[names.index("time_s")]
    mean = math.nan
    if time[-1] > time[0]:
        mean = (len(time) - 1) / float(time[-1] - time[0])
    check_rate("recording", file, time, mean)
    _check_agreement(file, "time_s", mean, rate_option, rate)
    kept = [index for index, name in enumerate(names) if name != "time_s"]
    if not kept:
        raise ConfigError(
            f"{file}: there is no column beside time_s; give one a sensor"
        )
    if rate is None:
        # times are often printed with few digits: a rate within their rounding of a whole number
        # is that number
        rate = mean
        if math.isclose(mean, round(mean), rel_tol=2e-6):
            rate = float(round(mean))
    return tuple(names[index] for index in kept), values[kept], rate


def _check_agreement(
    file: str, source: str, stored: float | None, option: str, rate: float | None
) -> None:
    if stored is None or rate is None or math.isclose(stored, rate, rel_tol=1e-3):
        return
    raise ConfigError(
        f"{file}: {source} has {stored:g} samples a second, {option} says {rate:g}; "
        f"leave {option} out"
    )


def _check_range(rate: float | None, what: str) -> None:
    if rate is not None and not 1000.0 <= rate <= 1e6:
        raise ConfigError(f"{what} must lie in 1000..1000000 samples a second")


def _factor(file: str, name: str, unit: str) -> float:
    """From a column's unit to m/s2."""
    lower = name.lower()
    if wrong := [suffix for suffix in WRONG_SUFFIXES if lower.endswith(suffix)]:
        raise ConfigError(
            f"{file}: {name} ends in {wrong[0]}, which is no acceleration; choose others with "
            "--channels, or rename it"
        )
    for suffix, factor in SUFFIXES.items():
        if lower.endswith(suffix):
            return factor
    return UNITS[unit]
