"""Records of a data set that meet conditions: chosen by columns, read when asked for."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gensig.dataset.plan import Plan
from gensig.dataset.schema import PARAMS
from gensig.errors import DatasetError

# Short names for columns, as users say them.
ALIASES = {"fault": "label_name"}
_STATES = ("ok", "failed")


class RecordSource(Protocol):
    """What a selection reads: columns of all records, and signals of one; a `Dataset` is one."""

    @property
    def folder(self) -> Path:
        """Folder of the data set."""

    @property
    def plan(self) -> Plan:
        """Plan of all records."""

    @property
    def n_records(self) -> int:
        """Number of records."""

    @property
    def n_samples(self) -> int:
        """Samples of one channel of one record."""

    @property
    def channel_names(self) -> list[str]:
        """Names along the channel axis."""

    @property
    def class_names(self) -> list[str]:
        """Names of the classes by label."""

    @property
    def column_names(self) -> list[str]:
        """Names that `column` takes."""

    def column(self, name: str) -> np.ndarray:
        """One value (or short vector) a record, (record, ...)."""

    def signals(
        self,
        index: int,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
    ) -> np.ndarray:
        """Acceleration of one record, (channel, sample) float32 in m/s^2."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRecord:
    """One record: its values now, its signals when asked for.

    Parameters
    ----------
    dataset : RecordSource
    index : int       place in the plan's order
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
        self, place: int, start: int = 0, stop: int | None = None, **options: Any
    ) -> np.ndarray:
        """Acceleration of the record at a place of this selection, (channel, sample) float32 in
        m/s^2.
        """
        return self.dataset.signals(self._record(place), start, stop, **options)

    def array(
        self,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
    ) -> np.ndarray:
        """Acceleration of all chosen records at once, (record, channel, sample) float32 in m/s^2.

        This is the one call that loads them all; to go through more than fits into memory, iterate.
        """
        stop = self.dataset.n_samples if stop is None else stop
        n_channels = len(self.dataset.channel_names if channels is None else channels)
        block = np.empty(
            (len(self.index), n_channels, max(0, stop - start)), dtype=np.float32
        )
        for place, index in enumerate(self.index.tolist()):
            block[place] = self.dataset.signals(index, start, stop, channels)
        return block

    def table(self, names: Sequence[str] | None = None) -> np.ndarray:
        """Columns as one structured array, (record,).

        All those with one value a record where `names` is None.
        """
        if names is None:
            names = [
                name
                for name in self.dataset.column_names
                if self.dataset.column(name).ndim == 1
            ]
        return structured({name: self.column(name) for name in names})

    def __len__(self) -> int:
        return len(self.index)

    def __getitem__(self, place: int) -> StoredRecord:
        index = self._record(place)
        values = {
            name: self.dataset.column(name)[index] for name in self.dataset.column_names
        }
        plain = {
            name: value.item() if np.ndim(value) == 0 else value
            for name, value in values.items()
        }
        return StoredRecord(dataset=self.dataset, index=index, values=plain)

    def __iter__(self) -> Iterator[StoredRecord]:
        return (self[place] for place in range(len(self)))

    def __repr__(self) -> str:
        return (
            f"Selection({len(self)} of {self.dataset.n_records} records of "
            f"{str(self.dataset.folder)!r})"
        )

    def _record(self, place: int) -> int:
        if not -len(self.index) <= place < len(self.index):
            raise IndexError(f"record {place} of a selection of {len(self.index)}")
        return int(self.index[place])


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
    kind: str, name: str, known: Sequence[str], place: object
) -> DatasetError:
    """The one line for a name that does not exist, with the nearest names first."""
    close = difflib.get_close_matches(name, known, n=3)
    hint = (
        f"did you mean {' or '.join(map(repr, close))}?"
        if close
        else f"it has {', '.join(known)}"
    )
    return DatasetError(f"{kind} {name!r} does not exist in {place}; {hint}")


def _meets(dataset: RecordSource, name: str, wanted: Any) -> np.ndarray:
    """(record,) bool: which records meet one condition."""
    values = _values(dataset, name)
    if values.ndim != 1:
        raise DatasetError(
            f"column {name!r} holds {values.shape[1:]} values a record; a condition needs one a "
            "record"
        )
    if isinstance(wanted, tuple):
        return _in_range(name, values, wanted)
    choices = (
        [*wanted]
        if isinstance(wanted, list | set | frozenset | range | np.ndarray)
        else [wanted]
    )
    is_text = values.dtype.kind == "U"
    for choice in choices:
        if isinstance(choice, str | np.str_) is not is_text or not isinstance(
            choice, str | int | float | np.generic
        ):
            raise DatasetError(
                f"where {name}={choice!r}: the column holds {'text' if is_text else 'numbers'}; "
                "give a value of that kind, a list of them"
                + ("" if is_text else ", or a range as a tuple (low, high)")
            )
    if is_text:
        _check_choices(dataset, name, values, choices)
        return np.isin(values, np.array(choices, dtype=str))
    meets = np.isin(values, np.array(choices, dtype=np.float64))
    if any(np.isnan(choice) for choice in choices):
        meets |= np.isnan(values)
    return meets


def _values(dataset: RecordSource, name: str) -> np.ndarray:
    name = ALIASES.get(name, name) if name not in dataset.column_names else name
    if name not in dataset.column_names and f"{PARAMS}/{name}" in dataset.column_names:
        name = f"{PARAMS}/{name}"
    if name in dataset.column_names:
        return dataset.column(name)
    if name in dataset.plan.columns:
        return dataset.plan.columns[name]
    known = sorted({*ALIASES, *dataset.column_names, *dataset.plan.columns})
    short = [known_name.removeprefix(f"{PARAMS}/") for known_name in known]
    raise unknown_name(
        "column", name, known if "/" in name else sorted({*short}), dataset.folder
    )


def _in_range(name: str, values: np.ndarray, wanted: tuple) -> np.ndarray:
    """Closed range; None leaves a side open. Missing values (NaN) are in no range."""
    numbers = [limit for limit in wanted if limit is not None]
    right = len(wanted) == 2 and all(
        isinstance(limit, int | float | np.number) for limit in numbers
    )
    if (
        values.dtype.kind == "U"
        or not right
        or any(np.isnan(limit) for limit in numbers)
    ):
        raise DatasetError(
            f"where {name}={wanted!r}: a tuple is a closed range (low, high) of numbers, None "
            "where a side is open; give a list for several values"
        )
    low, high = (
        (-np.inf if wanted[0] is None else wanted[0]),
        (np.inf if wanted[1] is None else wanted[1]),
    )
    if low > high:
        raise DatasetError(
            f"where {name}={wanted!r}: the range is empty; give the lower limit first"
        )
    return (values >= low) & (values <= high)


def _check_choices(
    dataset: RecordSource, name: str, values: np.ndarray, choices: Sequence[Any]
) -> None:
    """Refuse text that no record has.

    It is a slip of the pen. Classes and states may be absent, and so may ''.
    """
    column = ALIASES.get(name, name)
    possible = {*values.tolist(), ""}
    possible |= {"label_name": {*dataset.class_names}, "status": {*_STATES}}.get(
        column, set()
    )
    for choice in choices:
        if str(choice) not in possible:
            raise unknown_name(
                f"{name} =", str(choice), sorted(possible - {""})[:200], dataset.folder
            )
