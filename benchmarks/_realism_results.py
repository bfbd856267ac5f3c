"""Stored results of ``python -m benchmarks.realism``: written, read, and shown as a table.

``realism_results.csv`` lies beside the published ranges. Its first line says what was compared,
and which commit froze the simulation before. The column ``reason`` is written by hand and kept by
later runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError
from gensig.report.realism import (
    RANGES,
    Comparison,
    RangeKey,
    number_text,
    shown_range,
    with_numbers,
)
from gensig.text.csv_tables import read_records, write_rows
from gensig.text.markdown import table_lines

RESULTS = RANGES.with_name("realism_results.csv")
RECORDING = "recording"  # ids that begin so belong to the second table
COLUMNS = (
    "quantity",
    "at",
    "beside",
    "median",
    "5 to 95 %",
    "values",
    "verdict",
    "source",
    "reason",
)


def write_results(path: Path, heading: str, rows: Sequence[Comparison]) -> None:
    """Store comparisons below a heading of one line; reasons of a former file stay."""
    reasons: dict[RangeKey, str] = {}
    if path.exists():
        reasons = {row.key: row.reason for row in read_results(path)[1]}
    names = [field.name for field in fields(Comparison)]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {' '.join(heading.split())}\n")
        write_rows(file, [names])
        for row in rows:
            reason = row.reason or reasons.get(row.key, "")
            values = asdict(replace(row, reason=reason))
            write_rows(file, [list(map(_written, values.values()))])


def read_results(path: Path = RESULTS) -> tuple[str, list[Comparison]]:
    """The heading and the comparisons of a stored file.

    Raises
    ------
    ConfigError    for a file without its heading, or a row with an unknown verdict
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    if not lines or not lines[0].startswith("# "):
        raise ConfigError(
            f"{path.name} must begin with a line '# ' that says what was compared; make it again"
        )
    numbers = ("low", "high", "median", "p5", "p95")
    rows = []
    for line in read_records(lines[1:]):
        values = with_numbers(line, numbers)
        rows.append(Comparison(**{**values, "n": int(line["n"])}))
    return lines[0][2:], rows


def table(rows: Sequence[Comparison]) -> list[str]:
    """Comparisons as lines of a Markdown table."""
    cells = [
        (
            f"{row.id}, {row.unit}".rstrip(", "),
            row.at,
            shown_range(row),
            number_text(row.median),
            f"{number_text(row.p5)} to {number_text(row.p95)}",
            row.n,
            row.verdict,
            row.source,
            row.reason,
        )
        for row in rows
    ]
    return table_lines(COLUMNS, cells)


def _written(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.6g}"
    return "" if value is None else value
