"""Rows of a data set as record batches of Arrow, with few records in memory, and as one file.

Needs the package pyarrow; imported by the exports to Parquet only.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow
from numpy.typing import NDArray
from pyarrow import parquet

from gensig.dataset.exports import export_tables
from gensig.dataset.exports.export_tables import column_names, signal_row, unit_of
from gensig.dataset.exports.split_columns import Stretches, whole_records
from gensig.dataset.reader import Dataset

LABEL = "label"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowSource:
    """Columns and time signals of stretches of records, as record batches.

    Parameters
    ----------
    data : Dataset
    n_samples : int or None     samples of every stretch; None where they differ
    signals : names             time signals to read; may be none
    further : name -> (record,) further columns of the data set
    bounds : bool               whether rows have ``start_sample`` and ``stop_sample``
    wide_label : bool           whether ``label`` is int64, as class labels of Hugging Face are
    """

    data: Dataset
    n_samples: int | None
    signals: Sequence[str] = ()
    further: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    bounds: bool = False
    wide_label: bool = False

    def schema(self, rows: Stretches, notes: Mapping[str, str]) -> pyarrow.Schema:
        """Schema of the batches of some rows, at least one; ``notes`` are its metadata."""
        first = next(self.batches(rows.take(slice(1)), 1))
        return first.schema.with_metadata(dict(notes))

    def batches(self, rows: Stretches, step: int) -> Iterator[pyarrow.RecordBatch]:
        """Rows in their order, at most ``step`` a batch, none with rows of two shards."""
        for shard, entry in enumerate(self.data.manifest.shards):
            first = self.data.first_record(shard)
            begin, end = np.searchsorted(rows.record, [first, first + entry.rows])
            if begin == end:
                continue
            columns = self._columns_of_shard(shard, first)
            for start in range(begin, end, step):
                part = rows.take(slice(start, min(start + step, end)))
                yield self._batch(part, columns, first)

    def _columns_of_shard(
        self, shard: int, first: int
    ) -> dict[str, NDArray[np.generic]]:
        """Columns of the records of one shard by name."""
        columns: dict[str, NDArray[np.generic]] = {}
        for name in column_names(self.data):
            columns[name] = self.data.shard_column(shard, name)
        if self.wide_label:
            columns[LABEL] = columns[LABEL].astype(np.int64)
        stop = first + self.data.manifest.shards[shard].rows
        for name, values in self.further.items():
            columns[name] = values[first:stop]
        return columns

    def _batch(
        self,
        rows: Stretches,
        columns: Mapping[str, NDArray[np.generic]],
        first: int,
    ) -> pyarrow.RecordBatch:
        arrays = {}
        for name, values in columns.items():
            arrays[name] = column_array(values[rows.record - first])
        if self.bounds:
            arrays["start_sample"] = pyarrow.array(rows.start)
            arrays["stop_sample"] = pyarrow.array(rows.stop)
        for name in self.signals:
            arrays[name] = self._signal_array(rows, name)
        fields = []
        for name, array in arrays.items():
            unit = unit_of(self.data, name)
            metadata = {"unit": unit} if unit else None
            fields.append(pyarrow.field(name, array.type, metadata=metadata))
        schema = pyarrow.schema(fields)
        return pyarrow.RecordBatch.from_arrays(list(arrays.values()), schema=schema)

    def _signal_array(self, rows: Stretches, name: str) -> pyarrow.Array:
        """One time signal of some rows, each as long as its stretch."""
        blocks = []
        ends = zip(rows.start.tolist(), rows.stop.tolist(), strict=True)
        for record, (start, stop) in zip(rows.record.tolist(), ends, strict=True):
            blocks.append(signal_row(self.data, record, name, start, stop))
        if self.n_samples is None:
            return ragged_array(blocks)
        return column_array(np.stack(blocks))


def column_array(values: NDArray[np.generic]) -> pyarrow.Array:
    """Values (row, ...) as strings, numbers, or lists of fixed length."""
    if values.dtype.kind == "U":
        return pyarrow.array(values.tolist(), pyarrow.string())
    array = pyarrow.array(values.reshape(-1))
    return _fixed_lists(array, values.shape[1:])


def ragged_array(blocks: Sequence[NDArray[np.generic]]) -> pyarrow.Array:
    """Blocks (..., sample) of different length as lists of any length in lists of fixed length."""
    lengths: list[int] = []
    for block in blocks:
        outer = block.shape[:-1]
        lengths += [block.shape[-1]] * int(np.prod(outer))
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    values = np.concatenate([block.reshape(-1) for block in blocks])
    array = pyarrow.ListArray.from_arrays(offsets, pyarrow.array(values))
    return _fixed_lists(array, outer)


def _fixed_lists(array: pyarrow.Array, sizes: Sequence[int]) -> pyarrow.Array:
    """Values in nested lists of fixed length, the last size innermost."""
    for size in reversed(sizes):
        array = pyarrow.FixedSizeListArray.from_arrays(array, size)
    return array


def text_columns(schema: pyarrow.Schema) -> list[str]:
    """Names of the columns of strings.

    They alone are worth a dictionary: samples hardly repeat, and looking for repetitions takes
    memory and time.
    """
    return [field.name for field in schema if pyarrow.types.is_string(field.type)]


def write_parquet(
    data: Dataset,
    path: Path,
    *,
    samples: bool,
    further: Mapping[str, NDArray[np.generic]],
) -> None:
    """Write one row a record; units are notes of the columns.

    Parameters
    ----------
    data : Dataset
    path : Path                    file to write
    samples : bool                 time signals too, as lists of fixed length
    further : name -> (record,)    further columns
    """
    rows = whole_records(data)
    signals: list[str] = []
    step = export_tables.ROWS_LIMIT
    if samples:
        signals = data.signal_names
        step = export_tables.rows_of_group(export_tables.record_bytes(data))
    source = RowSource(
        data=data, n_samples=data.n_samples, signals=signals, further=further
    )
    notes = {"gensig": export_tables.attributes_json(data.attributes)}
    schema = source.schema(rows, notes)
    texts = text_columns(schema)
    with parquet.ParquetWriter(path, schema, use_dictionary=texts) as writer:
        for batch in source.batches(rows, step):
            writer.write_batch(batch.replace_schema_metadata(schema.metadata))
