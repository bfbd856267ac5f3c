"""CSV tables, written so that no cell is a formula, and read back exactly.

A spreadsheet runs a text that begins with ``=``, ``+``, ``-`` or ``@``, and names may come from
anybody's file. Such a text gets an apostrophe in front; numbers and percentages stay as they are.
Source: OWASP, CSV Injection.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TextIO

# as they are typed and in full width, tab and line breaks, which a spreadsheet skips
OPENINGS = "=+\\-@\t\r\n\uff1d\uff0b\uff0d\uff20"
FORMULA = re.compile(f"'*[{OPENINGS}]")
GUARDED = re.compile(f"'+[{OPENINGS}]")
NUMBER = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?( ?%)?|[-+]?(nan|inf|infinity)", re.IGNORECASE
)


def guarded_cell(value: Any) -> Any:
    """The value of a cell; a text that a spreadsheet would run has an apostrophe in front.

    A text that begins with apostrophes and then such a sign gets one more, so that `plain_cell`
    gives back every text.
    """
    is_text = isinstance(value, str)
    if is_text and FORMULA.match(value) and not NUMBER.fullmatch(value):
        return f"'{value}"
    return value


def plain_cell(text: str) -> str:
    """The text that `guarded_cell` was given."""
    if GUARDED.match(text):
        return text[1:]
    return text


def write_rows(file: TextIO, rows: Iterable[Sequence[Any]]) -> None:
    """Write rows, their cells guarded; the header is a row."""
    writer = csv.writer(file, lineterminator="\n")
    for row in rows:
        writer.writerow([guarded_cell(cell) for cell in row])


def write_records(
    file: TextIO, names: Sequence[str], records: Iterable[Mapping[str, Any]]
) -> None:
    """Write a header and records by name; a value that a record lacks is an empty cell.

    Raises
    ------
    ValueError    for a record with a name that the header lacks
    """
    write_rows(file, [names])
    for record in records:
        if unknown := record.keys() - set(names):
            raise ValueError(f"no column for {', '.join(sorted(unknown))}")
        write_rows(file, [[record.get(name, "") for name in names]])


def header_line(names: Sequence[str]) -> str:
    """Header of a table of numbers, without its line break."""
    file = io.StringIO()
    write_rows(file, [names])
    return file.getvalue().removesuffix("\n")


def read_rows(lines: Iterable[str]) -> Iterator[list[str]]:
    """Rows of a table as they were given to `write_rows`; csv.Error for what is no CSV."""
    for row in csv.reader(lines, strict=True):
        yield list(map(plain_cell, row))


def read_records(lines: Iterable[str]) -> Iterator[dict[str, str]]:
    """Rows of a table with a header, by name.

    Raises
    ------
    csv.Error     for what is no CSV
    ValueError    for a row that has not as many cells as the header
    """
    rows = (row for row in read_rows(lines) if row)
    names = next(rows, [])
    for row in rows:
        yield dict(zip(names, row, strict=True))
