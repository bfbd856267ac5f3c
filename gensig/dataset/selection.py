"""Selections: records of a data set that meet conditions on its columns."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gensig.dataset.plan import Plan
from gensig.dataset.schema import PARAMS
from gensig.errors import DatasetError
from gensig.text.installation import install

if TYPE_CHECKING:
    from pandas import DataFrame

# One record by number or id, or several by a slice, a list of them, or True for each chosen one.
Records = int | str | slice | Sequence[int | str] | np.ndarray

# Short names for columns.
ALIASES = {"fault": "label_name"}
_STATES = ("ok", "failed")


class RecordSource(Protocol):
    """Interface of a data set that a selection reads; a `Dataset` has it."""

    folder: Path
    n_records: int
    channel_names: list[str]
    class_names: list[str]

    @property
    def plan(self) -> Plan:
        """Plan of all records."""

    @property
    def n_samples(self) -> int:
        """Samples of one channel of one record."""

    @property
    def column_names(self) -> list[str]:
        """Names that `column` takes."""

    def column(self, name: str) -> np.ndarray:
        """One value (or short vector) a record, (record, ...)."""

    def signals(
        self,
        records: Records,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
    ) -> np.ndarray:
        """Acceleration of one record or of several, see `Dataset.signals`."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRecord:
    """One record: its values now, its signals when asked for.

    Parameters
    ----------
    dataset : RecordSource
    index : int       number in the plan's order
    values : dict     column -> Python value; a (n,) array where a column holds a short vector
    """

    dataset: RecordSource
    index: int
    values: Mapping[str, Any]

    def signals(
        self, start: int = 0, stop: int | None = None, **options: Any
    ) -> np.ndarray:
        """Acceleration, (channel, sample) float32 in m/s^2; arguments as for `Dataset.signals`."""
        return self.dataset.signals(self.index, start, stop, **options)


class Selection:
    """Some records of a data set, in the plan's order; nothing but the columns asked for is read.

    Attributes
    ----------
    dataset : RecordSource
    index : (record,) int64    numbers of the chosen records in the data set
    """

    def __init__(self, dataset: RecordSource, index: np.ndarray) -> None:
        self.dataset = dataset
        self.index = np.asarray(index, dtype=np.int64)
        self.index.flags.writeable = False

    def where(self, **conditions: Any) -> Selection:
        """Those of these records that meet all conditions; see `Dataset.where`."""
        keep = np.ones(len(self.index), dtype=bool)
        for name, wanted in conditions.items():
            keep &= _meets(self.dataset, name, wanted)[self.index]
        return Selection(self.dataset, self.index[keep])

    def column(self, name: str) -> np.ndarray:
        """One value (or short vector) a chosen record, (record, ...)."""
        return self.dataset.column(name)[self.index]

    def signals(
        self, records: Records, start: int = 0, stop: int | None = None, **options: Any
    ) -> np.ndarray:
        """Acceleration in m/s^2 as `Dataset.signals`; numbers and slices count these records."""
        if isinstance(records, str):
            return self.dataset.signals(records, start, stop, **options)
        if isinstance(records, int | np.integer):
            return self.dataset.signals(self._record(records), start, stop, **options)
        if not isinstance(records, slice):
            chosen = [
                record if isinstance(record, str) else self._record(record)
                for record in _chosen(records)
            ]
            return self.dataset.signals(chosen, start, stop, **options)
        return self.dataset.signals(self.index[records], start, stop, **options)

    def array(
        self,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
    ) -> np.ndarray:
        """Acceleration of all chosen records at once, (record, channel, sample) float32 in m/s^2.

        This is the one call that loads them all; to go through more than fits into memory, iterate.
        """
        if stop is None:
            stop = self.dataset.n_samples
        if channels is None:
            channels = self.dataset.channel_names
        shape = (len(self.index), len(channels), max(0, stop - start))
        block = np.empty(shape, dtype=np.float32)
        for number, index in enumerate(self.index.tolist()):
            block[number] = self.dataset.signals(index, start, stop, channels)
        return block

    def table(self, names: Sequence[str] | None = None) -> np.ndarray:
        """Columns as one structured array, (record,).

        All those with one value a record where `names` is None.
        """
        columns = {
            name: self.column(name) for name in names or self.dataset.column_names
        }
        if names is None:
            columns = {name: part for name, part in columns.items() if part.ndim == 1}
        return structured(columns)

    def to_pandas(self, names: Sequence[str] | None = None) -> DataFrame:
        """Columns as a data frame of pandas, a row a record; its index is the record's number.

        Parameters
        ----------
        names : columns; None takes all those with one value a record

        Raises
        ------
        DatasetError    where pandas is not installed, and for a column that does not exist or
                        holds several values a record
        """
        try:
            import pandas
        except ImportError as error:
            raise DatasetError(
                f"to_pandas needs the package pandas: {install('pandas')}"
            ) from error
        columns = {
            name: self.column(name) for name in names or self.dataset.column_names
        }
        vectors = [name for name, values in columns.items() if values.ndim > 1]
        if names is not None and vectors:
            raise DatasetError(
                f"column {vectors[0]!r} holds several values a record; read it with column()"
            )
        plain = {name: columns[name] for name in columns if name not in vectors}
        texts = {
            name: values.astype(object) if values.dtype.kind == "U" else values
            for name, values in plain.items()
        }
        return pandas.DataFrame(texts, index=pandas.Index(self.index, name="record"))

    def __len__(self) -> int:
        return len(self.index)

    def __getitem__(self, number: int) -> StoredRecord:
        index = self._record(number)
        values = {}
        for name in self.dataset.column_names:
            value = self.dataset.column(name)[index]
            if np.ndim(value) == 0:
                value = value.item()
            values[name] = value
        return StoredRecord(dataset=self.dataset, index=index, values=values)

    def __iter__(self) -> Iterator[StoredRecord]:
        return (self[number] for number in range(len(self)))

    def __repr__(self) -> str:
        return (
            f"Selection({len(self)} of {self.dataset.n_records} records of "
            f"{str(self.dataset.folder)!r})"
        )

    def _record(self, number: int) -> int:
        if not -len(self.index) <= number < len(self.index):
            raise IndexError(f"record {number} of a selection of {len(self.index)}")
        return int(self.index[number])


def _chosen(records: Sequence[int | str] | np.ndarray) -> list[Any]:
    """Numbers and ids of several records; True at a place chooses that number."""
    values = np.asarray(records)
    if values.dtype == bool:
        return np.flatnonzero(values).tolist()
    return list(records)


def record_numbers(
    records: slice | Sequence[int | str] | np.ndarray, ids: np.ndarray, folder: Path
) -> list[int]:
    """Numbers of several records of a data set; ``ids`` (record,) are those of all.

    Raises
    ------
    DatasetError    for an id that does not exist, and for anything that is neither number nor id
    """
    if isinstance(records, slice):
        return list(range(*records.indices(len(ids))))
    if np.asarray(records).dtype == bool and len(records) != len(ids):
        raise DatasetError(
            f"{len(records)} values of True and False for {len(ids)} records: give one a record"
        )
    return [_record_number(record, ids, folder) for record in _chosen(records)]


def _record_number(record: Any, ids: np.ndarray, folder: Path) -> int:
    """Number of one record by its number or id."""
    if isinstance(record, str):
        places = np.flatnonzero(ids == record)
        if not places.size:
            raise unknown_name("record", record, ids[:200].tolist(), folder)
        return int(places[0])
    if isinstance(record, bool) or not isinstance(record, int | np.integer):
        raise DatasetError(
            f"record {record!r}: give a number, an id, a slice, or a list of numbers or ids"
        )
    return int(record)


def structured(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Columns of equal length as one structured array, (record,), fields in the order given."""
    fields = [
        (name, values.dtype, values.shape[1:]) for name, values in columns.items()
    ]
    table = np.empty(len(next(iter(columns.values()), ())), dtype=fields)
    for name, values in columns.items():
        table[name] = values
    return table


def unknown_name(
    kind: str, name: str, known: Sequence[str], folder: Path
) -> DatasetError:
    """Error of one line for a name that does not exist, with the nearest names first."""
    hint = f"it has {', '.join(known)}"
    if close := difflib.get_close_matches(name, known, n=3):
        hint = f"did you mean {' or '.join(map(repr, close))}?"
    return DatasetError(f"{kind} {name!r} does not exist in {folder}; {hint}")


def _meets(dataset: RecordSource, name: str, wanted: Any) -> np.ndarray:
    """(record,) bool: True for the records that meet one condition."""
    values = _values(dataset, name)
    if values.ndim != 1:
        raise DatasetError(
            f"column {name!r} holds {values.shape[1:]} values a record; a condition needs one a "
            "record"
        )
    if isinstance(wanted, tuple):
        return _in_range(name, values, wanted)
    choices = [wanted]
    if isinstance(wanted, list | set | frozenset | range | np.ndarray):
        choices = [*wanted]
    if values.dtype.kind == "U":
        _check_kind(
            name, choices, str, "text; give a value of that kind, a list of them"
        )
        _check_choices(dataset, name, values, choices)
        return np.isin(values, np.array(choices, dtype=str))
    _check_kind(
        name,
        choices,
        int | float | np.number | np.bool_,
        "numbers; give a value of that kind, a list of them, or a range as a tuple (low, high)",
    )
    numbers = np.array(choices, dtype=np.float64)
    meets = np.isin(values, numbers)
    if np.isnan(numbers).any():
        meets |= np.isnan(values)
    return meets


def _check_kind(name: str, choices: Sequence[Any], kind: Any, held: str) -> None:
    for choice in choices:
        if not isinstance(choice, kind):
            raise DatasetError(f"where {name}={choice!r}: the column holds {held}")


def _values(dataset: RecordSource, name: str) -> np.ndarray:
    for full_name in (name, ALIASES.get(name), f"{PARAMS}/{name}"):
        if full_name in dataset.column_names:
            return dataset.column(full_name)
    if name in dataset.plan.columns:
        return dataset.plan.columns[name]
    known = {*ALIASES, *dataset.column_names, *dataset.plan.columns}
    if "/" not in name:
        known = {full_name.removeprefix(f"{PARAMS}/") for full_name in known}
    raise unknown_name("column", name, sorted(known), dataset.folder)


def _in_range(name: str, values: np.ndarray, wanted: tuple) -> np.ndarray:
    """Closed range; None leaves a side open. Missing values (NaN) are in no range."""
    limits = [
        infinite if limit is None else limit
        for limit, infinite in zip(wanted, (-np.inf, np.inf), strict=False)
    ]
    are_numbers = all(
        isinstance(limit, int | float | np.number) and not np.isnan(limit)
        for limit in limits
    )
    if values.dtype.kind == "U" or len(wanted) != 2 or not are_numbers:
        raise DatasetError(
            f"where {name}={wanted!r}: a tuple is a closed range (low, high) of numbers, None "
            "where a side is open; give a list for several values"
        )
    low, high = limits
    if low > high:
        raise DatasetError(
            f"where {name}={wanted!r}: the range is empty; give the lower limit first"
        )
    return (values >= low) & (values <= high)


def _check_choices(
    dataset: RecordSource, name: str, values: np.ndarray, choices: Sequence[Any]
) -> None:
    """Raise DatasetError for text that no record has.

    Classes and states may be absent, and so may ''.
    """
    may_be_absent = {"label_name": dataset.class_names, "status": _STATES}
    possible = {*values.tolist(), *may_be_absent.get(ALIASES.get(name, name), ())}
    for choice in map(str, choices):
        if choice and choice not in possible:
            known = sorted(possible - {""})[:200]
            raise unknown_name(f"{name} =", choice, known, dataset.folder)
