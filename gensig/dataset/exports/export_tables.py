"""Columns and time signals of all exports; data sets as npz."""

import json
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.reader import Dataset
from gensig.dataset.schema import SCALES, known_column, unit_in_file

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


def signal_row(
    data: Dataset, index: int, name: str, start: int = 0, stop: int | None = None
) -> np.ndarray:
    """One record's time signal from sample ``start`` to before ``stop``, None is the end.

    Accelerations (channel, sample) float32 in m/s^2, others (sample,) as stored.
    """
    if name in SCALES:
        return data.signals(index, start, stop, name=name)
    return data.trace(index, name, start, stop)


def rows_of_group(n_bytes: int) -> int:
    """Rows of ``n_bytes`` each that are written to Parquet at once, at least 1."""
    return max(1, ROW_GROUP_BYTES // max(1, n_bytes))


def write_npz(
    data: Dataset, path: Path, further: Mapping[str, NDArray[np.generic]]
) -> None:
    """Write one array a column and signal, and the attributes as JSON text.

    ``further`` are further columns by name, (record,) each. No array needs pickle to be read.
    """
    with zipfile.ZipFile(path, "w", allowZip64=True) as archive:
        arrays = {name: data.column(name) for name in column_names(data)}
        arrays |= further
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
