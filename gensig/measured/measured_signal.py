"""Samples of a measured recording, read in a process of their own as those of any user's file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from gensig.errors import ConfigError
from gensig.measured.measured_set import MeasuredRecording
from gensig.signals.reading.reader_process import limits_for, read_apart
from gensig.signals.recording import (
    STANDARD_GRAVITY,
    Recording,
    RecordingFile,
    read_file,
    recording_of,
)

NUMBERS_READER = "gensig.signals.reading.table_of_numbers:read_numbers"


def read_signal(recording: MeasuredRecording) -> Recording:
    """Samples of a recording.

    Returns
    -------
    Recording    (sensor, sample) m/s2, without the mean; in the unit of the set where that is no
        acceleration, `MeasuredRecording.is_acceleration` tells

    Raises
    ------
    ConfigError    for a recording without a rate, and for a file of another layout
    """
    return _signal(recording, _source(recording))


def read_signals(
    recordings: Iterable[MeasuredRecording],
) -> Iterator[tuple[MeasuredRecording, Recording]]:
    """Each recording with its samples, in order.

    A file whose rows are recordings is read once for those that follow one another.

    Raises
    ------
    ConfigError    as `read_signal`
    """
    for _, group in groupby(recordings, key=lambda one: (one.file, one.place.array)):
        same_file = list(group)
        source = _source(same_file[0])
        for one in same_file:
            yield one, _signal(one, source)


def _signal(recording: MeasuredRecording, source: RecordingFile) -> Recording:
    """Channels of a recording in its file, as accelerations where the unit is one."""
    place = recording.place
    if place.row is not None:
        source = _one_row(source, place.row)
    channels = place.channels
    if not channels:
        channels = tuple(name for name in source.channels if name != place.tacho)
    found = recording_of(source, unit="m/s2", channels=channels)
    if recording.unit == "g":
        return replace(found, acceleration=STANDARD_GRAVITY * found.acceleration)
    return found


def _source(recording: MeasuredRecording) -> RecordingFile:
    """The file with the names of its channels and the rate."""
    if recording.sampling_rate is None:
        raise ConfigError(
            f"{recording.name}: sampling_rate_hz is not known; give it in measured.yaml"
        )
    place, file = recording.place, str(recording.file)
    is_plain = not place.columns and not place.last_columns
    if is_plain and recording.file.suffix.lower() != ".txt":
        return read_file(file, rate=recording.sampling_rate, array=place.array)
    header = None
    if place.header_lines is not None:
        header = str(place.header_lines)
    limits = limits_for(Path(file).stat().st_size)
    values = read_apart(NUMBERS_READER, file, header, limits).values
    names = _names(recording, len(values))
    return RecordingFile(
        file=file,
        channels=names,
        named=bool(place.columns or place.last_columns),
        values=values[len(values) - len(names) :],
        sampling_rate=recording.sampling_rate,
        has_level=True,
    )


def _names(recording: MeasuredRecording, n_columns: int) -> tuple[str, ...]:
    """Names of the columns of a table of numbers, from the first or from the last."""
    place = recording.place
    if place.columns and len(place.columns) != n_columns:
        raise ConfigError(
            f"{recording.file}: {n_columns} columns, the set has {len(place.columns)}: "
            f"{', '.join(place.columns)}"
        )
    if len(place.last_columns) > n_columns:
        raise ConfigError(
            f"{recording.file}: {n_columns} columns, at least {len(place.last_columns)} are needed"
        )
    if place.columns or place.last_columns:
        return place.columns or place.last_columns
    return tuple(f"channel_{index}" for index in range(n_columns))


def _one_row(source: RecordingFile, row: int) -> RecordingFile:
    """One row of an array whose rows are recordings."""
    if row >= len(source.values):
        raise ConfigError(
            f"{source.file}: {len(source.values)} recordings, the set has one at row {row}"
        )
    return replace(source, channels=("channel_0",), values=source.values[row : row + 1])
