"""The two CSV tables of a drive line.

Headers carry their units; errors name row and column. A row number is that of the line in the
file, the header's included. Lines that begin with # are notes.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from gensig.errors import ConfigError
from gensig.text.csv_tables import read_rows
from gensig.text.user_file import open_table
from gensig.units import UNITS, split_unit, to_si

EDGE_KINDS = ("shaft", "coupling", "rigid", "gear_mesh")
TEXT = ("name", "note")  # beginnings of columns that only people read
MOST_ROWS = 10_000
LEAST, MOST = 1e-12, 1e15  # SI, of anything but 0

# bare name of a column: the unit that it is shown with, "" for a plain number, None for text
SHAFTING_COLUMNS: dict[str, str | None] = {
    "node": "", "inertia": "kg_m2", "speed_ratio": "", "stiffness": "nm_per_rad",
    "mesh_stiffness": "n_per_m", "edge_from": "", "edge_to": "", "edge_kind": None,
    "teeth_from": "", "teeth_to": "", "loss_factor": "", "damping": "nms_per_rad",
    "backlash": "um", "center_line": "deg",
}  # fmt: skip
SHAFTING_NEEDED = ("node", "inertia", "edge_from", "edge_to", "edge_kind", "stiffness")
GEAR_COLUMNS: dict[str, str | None] = {
    "node": "", "n_teeth": "", "normal_module": "mm", "pressure_angle": "deg",
    "helix_angle": "deg", "face_width": "mm", "mass": "kg", "profile_shift": "",
    "bore_radius": "mm", "addendum_coefficient": "", "clearance_coefficient": "",
    "cutter_tip_radius_coefficient": "", "tip_relief": "um", "tip_relief_height": "mm",
}  # fmt: skip
GEARS_NEEDED = (
    "node",
    "n_teeth",
    "normal_module",
    "pressure_angle",
    "helix_angle",
    "face_width",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """One line of a table: cells by the bare name of their column, SI where they are numbers."""

    table: str  # key and file, for messages
    line: int
    headers: Mapping[str, str]  # bare name: as the header writes it
    cells: Mapping[str, str]

    def location(self, column: str = "") -> str:
        """Location of a cell, or of the row, for a message."""
        location = f"{self.table}, row {self.line}"
        if node := self.text("node"):
            location += f" (node {node})"
        if column:
            location += f", column {self.headers.get(column, column)}"
        return location

    def text(self, column: str) -> str:
        """A cell as it is, empty where there is none."""
        return self.cells.get(column, "")

    def number(self, column: str) -> float | None:
        """A cell as a number in SI units, None where it is empty."""
        cell = self.text(column)
        if not cell:
            return None
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ConfigError(f"{self.location(column)}: '{cell}' is no number")
        value = to_si(self.headers[column], value)
        if value != 0.0 and not LEAST <= abs(value) <= MOST:
            raise ConfigError(
                f"{self.location(column)}: {cell} is beyond any machine; check its unit"
            )
        return value

    def positive(self, column: str) -> float | None:
        """A number above 0, None where the cell is empty."""
        value = self.number(column)
        if value is not None and value <= 0.0:
            raise ConfigError(
                f"{self.location(column)}: {self.text(column)} must be positive"
            )
        return value

    def not_negative(self, column: str, default: float) -> float:
        """A number of at least 0, the default where the cell is empty."""
        value = self.number(column)
        if value is None:
            return default
        if value < 0.0:
            raise ConfigError(
                f"{self.location(column)}: {self.text(column)} must not be negative"
            )
        return value

    def whole(self, column: str) -> int | None:
        """A whole number of at least 1, None where the cell is empty."""
        value = self.number(column)
        if value is None:
            return None
        if value != round(value) or value < 1:
            raise ConfigError(
                f"{self.location(column)}: {self.text(column)} must be a whole number of at least 1"
            )
        return round(value)

    def error(self, error: Exception, placed: str) -> ConfigError:
        """An error as it is if it names this table, else the text that does."""
        text = str(error)
        if text.startswith(self.table):
            return ConfigError(text)
        return ConfigError(placed)

    def given(self, column: str, value: float | None) -> float:
        """The value of a cell that must not be empty."""
        if value is None:
            raise ConfigError(f"{self.location(column)}: it is empty; give a value")
        return value


def read_shafting(key: str, file: str) -> list[TableRow]:
    """Rows of a table of nodes and what joins them."""
    return _read(key, file, SHAFTING_COLUMNS, SHAFTING_NEEDED)


def read_gears(key: str, file: str) -> list[TableRow]:
    """Rows of a table of gears."""
    return _read(key, file, GEAR_COLUMNS, GEARS_NEEDED)


def shipped_tables() -> list[str]:
    """Names of the tables that come with gensig."""
    return sorted(
        path.name for path in _tables().iterdir() if path.name.endswith(".csv")
    )


def _tables() -> resources.abc.Traversable:  # type: ignore[name-defined]
    return resources.files("gensig.configs").joinpath("tables")


def text_of(key: str, file: str) -> str:
    """Text of a file: a bare name is one of the shipped tables, anything else a path."""
    bare = file.removesuffix(".csv") + ".csv"
    if bare in shipped_tables():
        return str(_tables().joinpath(bare).read_text(encoding="utf-8"))
    try:
        path = Path(file).expanduser()
        with open_table(f"{key} = {file}", path) as stream:
            return stream.read()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", "it is no text in UTF-8")
        raise ConfigError(
            f"{key} = {file} cannot be read: {reason}; give a path, or one of "
            f"{', '.join(shipped_tables())}"
        ) from None


def _read(
    key: str, file: str, columns: Mapping[str, str | None], needed: tuple[str, ...]
) -> list[TableRow]:
    table = f"{key} = {file}"
    lines = [
        (number, line)
        for number, line in enumerate(text_of(key, file).splitlines(), start=1)
        if line.strip(" ,\t") and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise ConfigError(
            f"{table} is empty; its first line names the columns: {', '.join(_shown(columns))}"
        )
    if len(lines) > MOST_ROWS:
        raise ConfigError(
            f"{table} has {len(lines)} rows; at most {MOST_ROWS} are read"
        )
    cells = [_cells(f"{table}, row {number}", line) for number, line in lines]
    names = _header(f"{table}, row {lines[0][0]}", cells[0], columns, needed)
    rows = []
    for (number, _), row in zip(lines[1:], cells[1:], strict=True):
        if len(row) != len(names):
            raise ConfigError(
                f"{table}, row {number}: {len(row)} cells under {len(names)} column names"
            )
        rows.append(
            TableRow(
                table=table,
                line=number,
                headers=dict(zip(names, cells[0], strict=True)),
                cells=dict(zip(names, row, strict=True)),
            )
        )
    if not rows:
        raise ConfigError(f"{table} has a header and no rows")
    return rows


def _cells(location: str, line: str) -> list[str]:
    try:
        (row,) = read_rows([line])
    except csv.Error:
        raise ConfigError(
            f"{location}: a double quote is open or out of place; give cells between "
            "commas, text with commas in quotes"
        ) from None
    return [cell.strip() for cell in row]


def _header(
    location: str,
    header: list[str],
    columns: Mapping[str, str | None],
    needed: tuple[str, ...],
) -> list[str]:
    """Bare names of the columns; text columns keep theirs."""
    names = []
    for written in header:
        names.append(
            _column(
                f"{location}, column {written or '(without a name)'}", written, columns
            )
        )
        if names[-1] in names[:-1]:
            raise ConfigError(f"{location}, column {written}: there are two of it")
    for name in needed:
        if name not in names:
            raise ConfigError(
                f"{location}: there is no column {_suffixed(name, columns[name])}"
            )
    return names


def _column(location: str, written: str, columns: Mapping[str, str | None]) -> str:
    if written in columns:
        if columns[written]:
            raise ConfigError(
                f"{location}: its unit is missing; write {_choices(written, columns)}"
            )
        return written
    if written.startswith(TEXT):
        return written
    bare, suffix = split_unit(written)
    shown = columns.get(bare)
    if shown and suffix is not None:
        if UNITS[suffix][1] != UNITS[shown][1]:
            raise ConfigError(
                f"{location}: {UNITS[suffix][1]}, not {UNITS[shown][1]}; write "
                f"{_choices(bare, columns)}"
            )
        return bare
    for name, unit in columns.items():  # a unit that there is not
        if unit and written.startswith(f"{name}_"):
            raise ConfigError(
                f"{location}: no unit known here; write {_choices(name, columns)}"
            )
    close = difflib.get_close_matches(written, [*_shown(columns), *columns], n=1)
    hint = f"known: {', '.join(_shown(columns))}, and name or note for text"
    if close:
        hint = f"did you mean {close[0]}?"
    raise ConfigError(f"{location}: unknown; {hint}")


def _suffixed(name: str, unit: str | None) -> str:
    return f"{name}_{unit or ''}".removesuffix("_")


def _shown(columns: Mapping[str, str | None]) -> list[str]:
    return [_suffixed(name, unit) for name, unit in columns.items()]


def _choices(name: str, columns: Mapping[str, str | None]) -> str:
    """Every header that the column may have."""
    quantity = UNITS[columns[name] or ""][1]
    return " or ".join(
        f"{name}_{suffix}"
        for suffix, (_, measured) in UNITS.items()
        if measured == quantity
    )
