"""Data sets as npz and Parquet; columns and time signals of all exports."""

import json
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gensig.dataset.reader import Dataset
from gensig.dataset.schema import SCALES, known_column, unit_in_file
from gensig.errors import DatasetError

ROW_GROUP_BYTES = 16 * 1024**2
ROWS_LIMIT = 100_000


def column_names(data: Dataset) -> list[str]:
    """Columns worth exporting: all but the scales, which the signals hold already."""
    return [name for name in data.column_names if name not in SCALES.values()]


def unit_of(data: Dataset, name: str) -> str:
    """Unit of a column or signal; '' where the schema does not know it."""
    column = known_column(name)
    return unit_in_file(column, data.attributes) if column else ""


def attributes_json(attributes: Mapping[str, Any]) -> str:
    """Root attributes as JSON text."""
    return json.dumps(dict(attributes), indent=1, ensure_ascii=False) + "\n"


def record_bytes(data: Dataset) -> int:
    """Bytes of the time signals of one record."""
    return sum(signal_row(data, 0, name).nbytes for name in data.signal_names)


def signal_row(data: Dataset, index: int, name: str) -> np.ndarray:
    """One record's time signal.

    Accelerations (channel, sample) float32 in m/s^2, others (sample,) as stored.
    """
    if name in SCALES:
        return data.signals(index, name=name)
    return data.trace(index, name)


def write_npz(data: Dataset, path: Path) -> None:
    """One array a column and signal, and the attributes as JSON text.

    No array needs pickle to be read.
    """
    with zipfile.ZipFile(path, "w", allowZip64=True) as archive:
        arrays = {name: data.column(name) for name in column_names(data)}
        arrays["attributes_json"] = np.array(attributes_json(data.attributes))
        for name, values in arrays.items():
            _write_npy(archive, name, values.shape, values.dtype, [values])
        for name in data.signal_names:
            first = signal_row(data, 0, name)
            shape = (data.n_records, *first.shape)
            rows = (signal_row(data, index, name) for index in range(data.n_records))
            _write_npy(archive, name, shape, first.dtype, rows)


def _write_npy(
    archive: zipfile.ZipFile,
    name: str,
    shape: tuple[int, ...],
    dtype: np.dtype,
    parts: Iterable[np.ndarray],
) -> None:
    """One array of an npz file, part by part, in row order."""
    header = {
        "descr": np.lib.format.dtype_to_descr(dtype),
        "fortran_order": False,
        "shape": shape,
    }
    with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as stream:
        np.lib.format.write_array_header_2_0(stream, header)
        for part in parts:
            stream.write(np.ascontiguousarray(part).tobytes())


def write_parquet(data: Dataset, path: Path, *, samples: bool) -> None:
    """One row a record.

    With `samples`, time signals as lists of fixed length. Units are notes of the columns.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise DatasetError(
            "format parquet needs the package pyarrow; pip install 'gensig[parquet]'"
        ) from error

    def nested(values: np.ndarray) -> pyarrow.Array:
        if values.dtype.kind == "U":
            return pyarrow.array(values.tolist(), pyarrow.string())
        array = pyarrow.array(values.reshape(-1))
        for size in reversed(values.shape[1:]):
            array = pyarrow.FixedSizeListArray.from_arrays(array, size)
        return array

    def batch(shard: int, start: int, stop: int) -> pyarrow.RecordBatch:
        first = data.first_record(shard)
        arrays = {
            name: nested(data.shard_column(shard, name)[start:stop])
            for name in column_names(data)
        }
        for name in data.signal_names * samples:
            rows = [signal_row(data, first + row, name) for row in range(start, stop)]
            arrays[name] = nested(np.stack(rows))
        fields = []
        for name, array in arrays.items():
            unit = unit_of(data, name)
            metadata = {"unit": unit} if unit else None
            fields.append(pyarrow.field(name, array.type, metadata=metadata))
        schema = pyarrow.schema(fields)
        return pyarrow.RecordBatch.from_arrays(list(arrays.values()), schema=schema)

    step = ROWS_LIMIT
    if samples:
        step = max(1, ROW_GROUP_BYTES // record_bytes(data))
    notes = {"gensig": attributes_json(data.attributes)}
    schema = batch(0, 0, 1).schema.with_metadata(notes)
    # Samples hardly repeat: looking for repetitions takes memory and time for nothing.
    texts = [field.name for field in schema if pyarrow.types.is_string(field.type)]
    with parquet.ParquetWriter(path, schema, use_dictionary=texts) as writer:
        for shard, entry in enumerate(data.manifest.shards):
            for start in range(0, entry.rows, step):
                rows = batch(shard, start, min(start + step, entry.rows))
                writer.write_batch(rows.replace_schema_metadata(schema.metadata))
