"""Opening a shard that may come from a stranger: checked before anything is read, and never trusted afterwards."""

from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.attributes import HDF5_ERRORS, decoded, read_attributes
from gensig.dataset.schema import COLUMNS, REQUIRED, REQUIRED_ATTRIBUTES, SCHEMA_VERSION, SIGNALS
from gensig.errors import DatasetError

# gzip reaches at most 1032:1; what declares more than this over what it stores is a bomb or was never written.
EXPANSION_LIMIT = 1100
ATTRIBUTES_LIMIT = 1000

_FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32, h5py.h5z.FILTER_LZF}


def open_file(path: Path) -> h5py.File:
    """An HDF5 file, read-only and without locks; DatasetError when it is none."""
    if not path.is_file():
        raise DatasetError(f"{path} is missing or no ordinary file; restore it from a copy")
    try:
        return h5py.File(path, "r", locking=False)
    except (OSError, RuntimeError) as error:
        raise DatasetError(
            f"{path} cannot be read as HDF5 ({first_line(error)}); it is damaged or no HDF5 file"
        ) from error


def open_shard(path: Path, *, folder: Path | None = None) -> h5py.File:
    """A shard, open for reading after `check_shard`; with `folder`, refused when the name leads out of that folder."""
    if folder is not None and not path.resolve().is_relative_to(folder.resolve()):
        raise DatasetError(f"{path} is a link that leads out of {folder}; put the file itself there")
    file = open_file(path)
    try:
        check_shard(file, path)
    except BaseException:
        file.close()
        raise
    return file


def check_shard(file: h5py.File, path: Path) -> None:
    """Refuse, with one line, whatever a shard of format version 1 cannot contain.

    Raises
    ------
    DatasetError    for soft or external links, types that are no plain numbers or text, data outside the file, filters
                    other than gzip and lzf, shapes larger than what is stored, missing columns, unequal row counts
    """
    try:
        found = datasets(file, path)
        missing = [name for name in REQUIRED if name not in found]
        if missing:
            raise DatasetError(f"{path} has no data set {', '.join(missing)}; it is no gensig shard")
        n_records = row_count(found["record_id"])
        for name, data in found.items():
            _check_dataset(name, data, n_records, path)
        _check_attributes(file, path)
    except HDF5_ERRORS as error:
        raise DatasetError(f"{path} is damaged ({first_line(error)}); restore it from a copy") from error


def datasets(file: h5py.File, path: Path) -> dict[str, h5py.Dataset]:
    """All data sets of the root and of its groups one level down, by name; DatasetError for links and other objects."""
    found: dict[str, h5py.Dataset] = {}

    def collect(group: h5py.Group, prefix: str, *, deeper: bool) -> None:
        for key in group:
            if not isinstance(key, str):
                raise DatasetError(f"{path}: the name {key!r} is no UTF-8 text; the file is damaged")
            link = group.get(key, getlink=True)
            if not isinstance(link, h5py.HardLink):
                raise DatasetError(f"{path}: '{_plain(prefix + key)}' is a link; a shard holds its own data only")
            item = group[key]
            if isinstance(item, h5py.Dataset):
                found[prefix + key] = item
            elif isinstance(item, h5py.Group) and deeper:
                collect(item, f"{prefix}{key}/", deeper=False)
            else:
                raise DatasetError(f"{path}: '{_plain(prefix + key)}' is neither a data set nor a group of data sets")

    collect(file, "", deeper=True)
    return found


def row_count(data: h5py.Dataset) -> int:
    """Length of axis 0; 0 for a scalar."""
    return int(data.shape[0]) if data.shape else 0


def _check_dataset(name: str, data: h5py.Dataset, n_records: int, path: Path) -> None:
    label = f"{path}: data set '{_plain(name)}'"
    if data.dtype.kind not in "Siuf" or data.dtype.subdtype is not None:
        raise DatasetError(f"{label} has type {data.dtype}; allowed are numbers and text of fixed length")
    if data.is_virtual or data.external:
        raise DatasetError(f"{label} keeps its data in another file; a shard holds its own data only")
    if n_records == 0 or row_count(data) != n_records:
        raise DatasetError(f"{label} has shape {data.shape}, record_id has {n_records} rows; all must be equal, not 0")
    properties = data.id.get_create_plist()
    filters = {properties.get_filter(i)[0] for i in range(properties.get_nfilters())}
    if not filters <= _FILTERS:
        raise DatasetError(f"{label} uses HDF5 filter {sorted(filters - _FILTERS)}; allowed are gzip and lzf")
    declared, stored = data.size * data.dtype.itemsize, data.id.get_storage_size()
    chunk = int(np.prod(data.chunks, dtype=object)) * data.dtype.itemsize if data.chunks else 0
    if max(declared, chunk) > stored * (EXPANSION_LIMIT if filters else 1):
        raise DatasetError(f"{label} declares {declared} bytes and stores {stored}; it was never written or is a bomb")
    column = SIGNALS.get(name) or COLUMNS.get(name)
    if column is not None:
        same_kind = data.dtype.kind == column.storage_dtype.kind
        if not same_kind or data.ndim != 1 + len(column.axes):
            raise DatasetError(
                f"{label} has type {data.dtype} and {data.ndim} axes; format version 1 wants "
                f"{column.dtype} and {1 + len(column.axes)}"
            )


def _check_attributes(file: h5py.File, path: Path) -> None:
    if len(file.attrs) > ATTRIBUTES_LIMIT:
        raise DatasetError(f"{path} has {len(file.attrs)} attributes; it is no gensig shard")
    found = read_attributes(file)
    missing = [name for name in REQUIRED_ATTRIBUTES if name not in found]
    if missing:
        raise DatasetError(f"{path} has no root attribute {', '.join(missing)}; it is no gensig shard")
    version, rate = found["schema_version"], found["sampling_rate_hz"]
    if version != SCHEMA_VERSION:
        raise DatasetError(
            f"{path} has format version {version}; this gensig reads {SCHEMA_VERSION}, get a matching one"
        )
    if not isinstance(rate, int | float) or not 0 < rate < float("inf"):
        raise DatasetError(f"{path}: sampling_rate_hz is {rate}; it must be a positive number")
    for name in ("channel_names", "class_names"):
        value = found[name]
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise DatasetError(f"{path}: attribute {name} must be a list of text")
    if len(found["channel_names"]) != file["acceleration"].shape[1]:
        raise DatasetError(
            f"{path}: {len(found['channel_names'])} channel names for {file['acceleration'].shape[1]} channels"
        )


def read_rows(data: h5py.Dataset) -> np.ndarray:
    """The whole of a small data set, text decoded."""
    values = data[...]
    return decoded(values) if values.dtype.kind == "S" else values


def first_line(error: Exception) -> str:
    """The first line of an error's text."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)[:80]
