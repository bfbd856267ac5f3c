"""Tables of numbers without names of columns, as measuring programs write them.

Columns are separated by tabs, blanks, commas or semicolons; lines before the numbers are left out.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np

from gensig.errors import ConfigError
from gensig.signals.reading.promised_sizes import check_decoded
from gensig.signals.reading.recording_files import LEAST_SAMPLES, Content
from gensig.text.user_file import open_table

MOST_HEADER_LINES = 1000
LONGEST_LINE = 100_000  # characters
SEPARATORS = ("\t", ";", ",")


def read_numbers(file: str, header_lines: str | None) -> Content:
    """Columns of a table of numbers.

    Parameters
    ----------
    file : the table
    header_lines : number of lines before the numbers, as a text; None looks for the first line
        that is all numbers

    Raises
    ------
    ConfigError    for lines that are no numbers or have another number of columns
    """
    path = Path(file).expanduser()
    skipped, line = _first_numbers(file, path, header_lines)
    separator = next((sign for sign in SEPARATORS if sign in line), None)
    n_columns = len(_cells(line, separator))
    try:
        with open_table(file, path, errors="replace") as stream:
            values = np.loadtxt(
                islice(stream, skipped, None),
                delimiter=separator,
                usecols=range(n_columns),
                ndmin=2,
                dtype=np.float64,
            )
    except (ValueError, IndexError) as error:
        reason = str(error).splitlines()[0].rstrip(".")
        raise ConfigError(
            f"{file}: {reason}; it must hold {n_columns} columns of numbers from line "
            f"{skipped + 1} on"
        ) from None
    check_decoded(file, values.size)
    if len(values) < LEAST_SAMPLES:
        raise ConfigError(
            f"{file} is too short: {len(values)} rows, at least {LEAST_SAMPLES} are needed"
        )
    return Content(values=np.ascontiguousarray(values.T), sampling_rate=None)


def _first_numbers(file: str, path: Path, header_lines: str | None) -> tuple[int, str]:
    """Number of lines before the numbers, and the first line of numbers."""
    with open_table(file, path, errors="replace") as stream:
        for index in range(MOST_HEADER_LINES + 1):
            line = stream.readline(LONGEST_LINE)
            if not line:
                break
            wanted = header_lines is None or index == int(header_lines)
            if wanted and _is_numbers(line):
                return index, line
            if header_lines is not None and index == int(header_lines):
                raise ConfigError(
                    f"{file}: line {index + 1} must be the first of numbers after {header_lines} "
                    f"lines of a header; it is '{' '.join(line.split())[:60]}'"
                )
    raise ConfigError(f"{file} has no line of numbers; it must be a table of numbers")


def _is_numbers(line: str) -> bool:
    separator = next((sign for sign in SEPARATORS if sign in line), None)
    cells = _cells(line, separator)
    try:
        return bool(cells) and bool(
            np.all(np.isfinite([float(cell) for cell in cells]))
        )
    except ValueError:
        return False


def _cells(line: str, separator: str | None) -> list[str]:
    """Cells of a line; a separator at its end begins no further cell."""
    cells = line.strip(" \r\n").split(separator)
    if separator is not None and cells and not cells[-1].strip():
        cells = cells[:-1]
    return cells
