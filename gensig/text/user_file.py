"""Tables that users give: measured responses and backgrounds. Their content is data.

Every mistake is one line.
"""

from __future__ import annotations

import csv
import io
import math
import os
from pathlib import Path
from typing import TextIO

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.text.csv_tables import read_rows
from gensig.text.ordinary_file import is_refused, open_ordinary

MOST_BYTES = 500_000_000
RATE_TOLERANCE = 1e-3  # relative


def read_table(key: str, file: str, *, least_rows: int) -> tuple[list[str], Array]:
    """Names of the columns and the values, (column, row), of a CSV file with a header.

    Raises
    ------
    ConfigError    naming ``key`` and the file: missing, no numbers, NaN, uneven or too few rows
    """
    path = Path(file).expanduser()
    where = f"{key} = {file}"
    try:
        with open_table(where, path) as stream:
            names = _header(where, stream)
            values = np.loadtxt(stream, delimiter=",", ndmin=2, dtype=np.float64)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", "it is no text in UTF-8")
        raise ConfigError(f"{where} cannot be read: {reason}") from None
    except ValueError as error:
        first = str(error).splitlines()[0].rstrip(".")
        raise ConfigError(f"{where}: {first}; give numbers under one header") from None
    if len(names) != len(set(names)) or (values.size and values.shape[1] != len(names)):
        raise ConfigError(
            f"{where}: {len(names)} names in the header for {values.shape[1]} columns; "
            "name each, once"
        )
    if len(values) < least_rows:
        raise ConfigError(
            f"{where} is too short: {len(values)} rows, at least {least_rows} are needed"
        )
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = bad[0]
        raise ConfigError(
            f"{where}: row {row + 2}, column {names[column]} is no finite number"
        )
    return names, np.ascontiguousarray(values.T)


def open_table(
    where: str, path: Path, *, errors: str = "strict", most_bytes: int | None = None
) -> TextIO:
    """A text file in UTF-8 of moderate size, open for reading.

    Parameters
    ----------
    where : the key and the file, in messages
    path : the file
    errors : as of ``open``
    most_bytes : of the file; None is `MOST_BYTES`

    Raises
    ------
    ConfigError    for what is no ordinary file, such as a pipe or a device, and a file that is
                   too large
    OSError    for a file that cannot be opened
    """
    most_bytes = most_bytes or MOST_BYTES
    stream = open_given(where, path)
    if os.fstat(stream.fileno()).st_size > most_bytes:
        stream.close()
        raise ConfigError(
            f"{where} is larger than {most_bytes // 1_000_000} MB; cut it"
        )
    return io.TextIOWrapper(stream, encoding="utf-8-sig", errors=errors)


def open_given(where: str, path: Path) -> io.BufferedReader:
    """A file that a user named, open for reading.

    Raises
    ------
    ConfigError    for a pipe, a socket or a device
    OSError    for a file that cannot be opened
    """
    try:
        return open_ordinary(path)
    except OSError as error:
        if not is_refused(error):
            raise
        raise ConfigError(
            f"{where} cannot be read: it is no file; save it as one"
        ) from None


def _header(where: str, stream: TextIO) -> list[str]:
    """Names of the columns; refuses what is no header of commas."""
    line = stream.readline()
    for separator, called in ((";", "';'"), ("\t", "tabs")):
        if separator in line:
            raise ConfigError(
                f"{where}: its columns are separated by {called}: "
                "save it with commas, decimals with points"
            )
    names = [name.strip() for name in next(read_rows([line]), [])]
    if any(map(_is_number, names)):
        raise ConfigError(
            f"{where}: its first line holds numbers, not names; "
            "put a line before it that names each column, for instance time_s,housing"
        )
    return names


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def check_columns(key: str, file: str, names: list[str], wanted: list[str]) -> None:
    """Raise ConfigError unless the file has exactly these columns, in any order."""
    missing = [name for name in wanted if name not in names]
    unknown = [name for name in names if name not in wanted]
    problems = [f"no column {name}" for name in missing]
    problems += [f"unknown column {name}" for name in unknown]
    if problems:
        columns = ", ".join(wanted)
        raise ConfigError(f"{key} = {file}: {problems[0]}; it must have {columns}")


def check_rate(key: str, file: str, time: Array, sampling_rate: float) -> None:
    """Raise ConfigError unless the times are even and have the sampling rate."""
    step = np.diff(time)
    mean = float(np.mean(step))
    if not mean > 0.0 or np.max(np.abs(step - mean)) > 0.1 * mean:
        raise ConfigError(f"{key} = {file}: time_s must rise in even steps")
    if not math.isclose(1.0 / mean, sampling_rate, rel_tol=RATE_TOLERANCE):
        raise ConfigError(
            f"{key} = {file} has {1.0 / mean:g} samples a second, "
            f"sensing.sampling_rate_hz = {sampling_rate:g}; resample it first"
        )
