"""The table of a plan: one row a record with everything that was drawn, and its CSV file."""

import csv
import io
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from gensig.arrays import Flags
from gensig.dataset.columns import COLUMNS, IS_REFERENCE
from gensig.dataset.folder.layout import PLAN_BYTES_LIMIT
from gensig.dataset.schema import kind_of
from gensig.dataset.storage.atomic import read_text, require_digest
from gensig.errors import DatasetError
from gensig.text.csv_tables import read_rows, write_rows

COLUMNS_LIMIT = 5000
# bytes of a column as an array of text over its characters, and what it may take in any case
WIDENING_LIMIT, TEXT_BYTES_FREE = 400, 256 * 1024**2
BYTES_A_CHARACTER = 4  # of numpy

_INT = re.compile(r"[+-]?[0-9]{1,19}")
_FLOAT = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?([eE][+-]?[0-9]+)?|nan|inf)")
_CONTROL = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")
_RECORD_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.\-]*")
_DTYPES = {"str": str, "int": np.int64, "float": np.float64}
_KINDS = {"U": "str", "T": "str", "i": "int", "u": "int", "b": "int", "f": "float"}
REQUIRED = ("record_id", "shard", "row")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """Immutable table of all records of a data set, in the order of shard and row.

    Parameters
    ----------
    columns : name -> (record,) array of text, int64 or float64; `record_id`, `shard` and `row` are
        required

    Raises
    ------
    DatasetError    for missing columns, unequal lengths, repeated ids, or shards and rows that do
                    not count up from 0
    """

    columns: Mapping[str, np.ndarray]

    def __post_init__(self) -> None:
        given = self.columns
        columns = {name: _normalized(name, given[name]) for name in given}
        missing = [name for name in REQUIRED if name not in columns]
        if missing:
            raise DatasetError(
                f"the plan has no column {', '.join(missing)}; every plan needs record_id, shard "
                "and row"
            )
        n = len(columns["record_id"])
        lengths = {name: len(values) for name, values in columns.items()}
        wrong = [f"{name} ({lengths[name]})" for name in columns if lengths[name] != n]
        if n == 0 or wrong:
            raise DatasetError(
                f"the plan has {n} records, and columns of other lengths: {wrong}; all must be "
                "equal, not 0"
            )
        _check_ids(columns["record_id"])
        _check_rows(columns["shard"], columns["row"])
        object.__setattr__(self, "columns", MappingProxyType(columns))

    def __reduce__(self) -> tuple:
        return _rebuild, (dict(self.columns),)

    @property
    def n_records(self) -> int:
        """Number of records."""
        return len(self.columns["record_id"])

    @property
    def n_shards(self) -> int:
        """Number of shards."""
        return int(self.columns["shard"][-1]) + 1

    @property
    def is_reference(self) -> Flags:
        """(record,) True for reference records, which are no examples."""
        if IS_REFERENCE not in self.columns:
            return np.zeros(self.n_records, dtype=bool)
        return self.columns[IS_REFERENCE] == 1

    def examples(self) -> "Plan":
        """The plan without its reference records, as one shard; itself where it has none."""
        kept = np.flatnonzero(~self.is_reference)
        if len(kept) in (0, self.n_records):
            return self
        columns = {name: values[kept] for name, values in self.columns.items()}
        shard, row = shard_rows(len(kept), len(kept))
        return Plan(columns={**columns, "shard": shard, "row": row})

    def shard_sizes(self) -> list[int]:
        """Number of records of each shard."""
        return np.bincount(self.columns["shard"]).tolist()

    def rows(self, shard: int) -> np.ndarray:
        """Indices of the records of one shard, in the order of their rows."""
        if not 0 <= shard < self.n_shards:
            raise DatasetError(
                f"shard {shard} does not exist; the plan has shards 0 to {self.n_shards - 1}"
            )
        return np.flatnonzero(self.columns["shard"] == shard)

    def record(self, index: int) -> dict[str, str | int | float]:
        """All values of one record as Python objects."""
        return {name: values[index].item() for name, values in self.columns.items()}


def _rebuild(columns: dict[str, np.ndarray]) -> Plan:
    return Plan(columns=columns)


def _normalized(name: str, values: np.ndarray) -> np.ndarray:
    """A read-only copy as text, int64 or float64; DatasetError for anything else."""
    array = np.asarray(values)
    if array.dtype.kind == "O" and all(isinstance(value, str) for value in array.flat):
        array = array.astype(str)
    kind = _KINDS.get(array.dtype.kind)
    wanted = kind_of(name) or kind
    fits = kind == wanted or (kind, wanted) == ("int", "float")
    if array.ndim != 1 or kind is None or wanted is None or not fits:
        raise DatasetError(
            f"plan column {name} has type {array.dtype} and shape {array.shape}; "
            f"allowed is one axis of {wanted or 'text, int or float'}"
        )
    array = array.astype(_DTYPES[wanted])  # a copy: the caller's array stays writable
    if wanted == "str":
        for value in array.tolist():
            if _CONTROL.search(value):
                raise DatasetError(
                    f"plan column {name} holds the text {value!r}; control characters are not "
                    "allowed"
                )
    if wanted == "float":
        array[np.isnan(array)] = np.nan  # another NaN would not come back from text
    array.flags.writeable = False
    return array


def _check_ids(ids: np.ndarray) -> None:
    values = ids.tolist()
    limit = COLUMNS["record_id"].n_bytes
    for value in values:
        if not _RECORD_ID.fullmatch(value) or len(value) > limit:
            raise DatasetError(
                f"record_id {value!r} is not allowed; use letters, digits, '_', '.', '-', at most "
                f"{limit}"
            )
    if len(set(values)) != len(values):
        unique, counts = np.unique(ids, return_counts=True)
        raise DatasetError(
            f"record_id {str(unique[counts > 1][0])!r} occurs more than once in the plan; ids "
            "must be unique"
        )


def _check_rows(shard: np.ndarray, row: np.ndarray) -> None:
    new_shard = np.concatenate([[True], np.diff(shard) != 0])
    starts = np.flatnonzero(new_shard)
    expected_shard = np.cumsum(new_shard) - 1
    expected_row = np.arange(len(shard)) - starts[expected_shard]
    wrong = np.flatnonzero((shard != expected_shard) | (row != expected_row))
    if wrong.size:
        i = int(wrong[0])
        raise DatasetError(
            f"plan record {i} is at shard {shard[i]} row {row[i]}, expected shard "
            f"{expected_shard[i]} row {expected_row[i]}; shards and rows must count up from 0"
        )


def record_ids(n_records: int) -> np.ndarray:
    """The ids 'r000000', 'r000001', ... (record,)."""
    return np.array([f"r{i:06d}" for i in range(n_records)])


def shard_rows(n_records: int, records_per_shard: int) -> tuple[np.ndarray, np.ndarray]:
    """Shard and row of each record, (record,) each, filling one shard after the other."""
    if records_per_shard < 1 or n_records < 1:
        raise DatasetError(
            f"{n_records} records in shards of {records_per_shard}: both must be at least 1"
        )
    index = np.arange(n_records)
    return index // records_per_shard, index % records_per_shard


def plan_text(plan: Plan) -> str:
    """The plan as CSV: floats in shortest round-trip form, integers as integers, text as it is."""
    cells = []
    for name, values in plan.columns.items():
        if _CONTROL.search(name) or not name:
            raise DatasetError(
                f"plan column name {name!r} is not allowed; use printable text"
            )
        texts = list(map(str, values.tolist()))
        is_unknown_text = values.dtype.kind == "U" and kind_of(name) is None
        if is_unknown_text and _infer(texts) != "str":
            raise DatasetError(
                f"plan column {name} is text, but all its values look like numbers, such as "
                f"{texts[0]!r}; they would not come back as text: put a letter in front"
            )
        cells.append(texts)
    buffer = io.StringIO()
    write_rows(buffer, [list(plan.columns)])
    write_rows(buffer, zip(*cells, strict=True))
    return buffer.getvalue()


def read_plan(path: Path, *, sha256: str | None = None) -> Plan:
    """Read `plan.csv`; DatasetError names the file and what is wrong with it.

    With ``sha256``, a file of another digest is refused.
    """
    text = read_text(path, limit=PLAN_BYTES_LIMIT)
    if sha256 is not None:
        require_digest(path, text, sha256)
    try:
        header, *rows = read_rows(io.StringIO(text, newline=""))
    except (csv.Error, ValueError) as error:
        raise DatasetError(
            f"{path} is no CSV table ({error}); restore it from a copy"
        ) from error
    if len(header) > COLUMNS_LIMIT:
        raise DatasetError(
            f"{path} has {len(header)} columns, at most {COLUMNS_LIMIT} are possible; it is no "
            "plan of gensig"
        )
    if len(set(header)) != len(header):
        raise DatasetError(
            f"{path} has two columns of the same name; restore it from a copy"
        )
    for i, cells in enumerate(rows):
        if len(cells) != len(header):
            raise DatasetError(
                f"{path} record {i} has {len(cells)} values, the header {len(header)}; the file "
                "is cut or damaged, restore it from a copy"
            )
    columns = list(zip(*rows, strict=True)) or [()] * len(header)
    named = zip(header, columns, strict=True)
    try:
        return Plan(columns={name: _parsed(name, cells) for name, cells in named})
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error


class PlanRows:
    """Rows of a `plan.csv` by number, without the others in memory.

    Parameters
    ----------
    path : Path    no cell holds a line break: control characters are not allowed

    Raises
    ------
    DatasetError    for a file that cannot be read or has not the rows asked for
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with path.open("rb") as file:
                lengths = np.fromiter((len(line) for line in file), dtype=np.int64)
        except OSError as error:
            raise DatasetError(
                f"{path} cannot be read: {error}; check its permissions"
            ) from error
        if not len(lengths):
            raise DatasetError(f"{path} is empty; restore it from a copy")
        self._begins = np.concatenate([[0], np.cumsum(lengths)])
        self.names = next(self._cells(0, 1), [])

    def _cells(self, first_line: int, n_lines: int) -> Iterator[list[str]]:
        begin, end = self._begins[[first_line, first_line + n_lines]].tolist()
        try:
            with self.path.open("rb") as file:
                file.seek(begin)
                text = file.read(end - begin).decode("utf-8")
            lines = text.removesuffix("\n").split("\n")
            yield from read_rows(lines)
        except (OSError, ValueError, csv.Error) as error:
            raise DatasetError(
                f"{self.path} is damaged ({error}); restore it from a copy"
            ) from error

    def records(self, first: int, n_records: int) -> list[dict[str, str | int | float]]:
        """All values of some records, as `Plan.record` gives them."""
        if n_records < 1 or first + n_records > len(self._begins) - 2:
            raise DatasetError(
                f"{self.path} has no records {first} to {first + n_records - 1}; restore it from "
                "a copy"
            )
        rows = list(self._cells(1 + first, n_records))
        if list(map(len, rows)) != [len(self.names)] * n_records:
            raise DatasetError(
                f"{self.path} is cut or damaged near record {first}; restore it from a copy"
            )
        columns = zip(self.names, zip(*rows, strict=True), strict=True)
        values = [_parsed(name, cells).tolist() for name, cells in columns]
        return [
            dict(zip(self.names, row, strict=True)) for row in zip(*values, strict=True)
        ]


def _infer(cells: tuple[str, ...] | list[str]) -> str:
    if all(_INT.fullmatch(cell) for cell in cells):
        return "int"
    return "float" if all(_FLOAT.fullmatch(cell) for cell in cells) else "str"


def _texts(name: str, cells: tuple[str, ...]) -> np.ndarray:
    """Cells as an array of text, whose longest one decides the bytes of each."""
    lengths = list(map(len, cells))
    n_bytes = BYTES_A_CHARACTER * max(lengths, default=0) * len(cells)
    if n_bytes > max(TEXT_BYTES_FREE, WIDENING_LIMIT * sum(lengths)):
        raise DatasetError(
            f"column {name[:80]} holds a text of {max(lengths)} characters, which would take "
            f"{n_bytes} bytes in {len(cells)} records; shorten it"
        )
    return np.array(cells, dtype=str)


def _parsed(name: str, cells: tuple[str, ...]) -> np.ndarray:
    kind = kind_of(name) or _infer(cells)
    if kind == "str":
        return _texts(name, cells)
    pattern = {"int": _INT, "float": _FLOAT}[kind]
    for cell in cells:
        if not pattern.fullmatch(cell):
            raise DatasetError(f"column {name} holds {cell!r}, which is no {kind}")
    if kind == "float":
        return np.array(list(map(float, cells)))
    try:
        return np.array(list(map(int, cells)), dtype=np.int64)
    except OverflowError as error:
        raise DatasetError(f"column {name} holds an integer beyond 64 bits") from error
