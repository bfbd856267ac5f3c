"""Descriptions in text of CSV tables: recordings, plans, splits and labels."""

from __future__ import annotations

import csv
import itertools
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from gensig.errors import ConfigError
from gensig.signals.indicators import rms
from gensig.signals.recording import RecordingFile, read_file
from gensig.text.csv_tables import read_records, read_rows
from gensig.text.user_file import open_table

TIME = "time_s"
COUNTED = ("label_name", "subset", "fault_gear", "status", "class")
MOST_VALUES, MOST_COLUMNS = 12, 100  # that are shown
LONGEST_NAME = 40  # characters


def table_text(file: str) -> str:
    """Lines on a CSV: rate, length and channels of a recording, else rows, columns and labels.

    Raises
    ------
    ConfigError    for a file that cannot be read as such a table
    """
    try:
        with open_table(file, Path(file).expanduser()) as stream:
            first = stream.readline()
            if TIME not in next(read_rows([first]), []):
                return _columns_text(file, itertools.chain([first], stream))
    except OSError as error:
        raise ConfigError(f"{file} cannot be read: {error.strerror}") from None
    except (csv.Error, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise ConfigError(f"{file} is no table with a header: {reason}") from None
    return _recording_text(read_file(file))


def _recording_text(recording: RecordingFile) -> str:
    n_samples, rate = recording.values.shape[1], recording.sampling_rate
    levels = rms(recording.values).tolist()
    channels = zip(recording.channels, levels, strict=True)
    shown = [f"{_short(name)} (RMS {level:.4g})" for name, level in channels]
    return _lines(
        f"{recording.file}: recording as CSV",
        rate=f"{rate:g} Hz",
        length=f"{n_samples} samples, {n_samples / rate:g} s",
        channels=_listed(shown, MOST_COLUMNS),
        labels="none in a CSV; `gensig simulate --output FILE.h5` stores them",
    )


def _columns_text(file: str, lines: Iterable[str]) -> str:
    names: list[str] = []
    n_rows = 0
    counts: dict[str, Counter[str]] = {}
    for record in read_records(lines):
        if not n_rows:
            names = list(record)
            counts = {name: Counter() for name in COUNTED if name in record}
        n_rows += 1
        for name, counter in counts.items():
            counter[record[name]] += 1
    if not n_rows:
        raise ValueError("it has no rows")
    labels = {
        name: f"{len(counter)}: {_listed(_counted(counter), MOST_VALUES)}"
        for name, counter in counts.items()
    }
    columns = _listed([_short(name) for name in names], MOST_COLUMNS)
    return _lines(f"{file}: table as CSV", rows=str(n_rows), columns=columns, **labels)


def _counted(counter: Counter[str]) -> list[str]:
    return [f"{_short(name) or 'empty'} {n}" for name, n in sorted(counter.items())]


def _listed(items: list[str], most: int) -> str:
    return ", ".join(items[:most] + ["..."] * (len(items) > most))


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 3]}..."


def _lines(title: str, **facts: str) -> str:
    lines = [title]
    lines += [f"  {name:<12} {fact}" for name, fact in facts.items()]
    return "\n".join([*lines, ""])
