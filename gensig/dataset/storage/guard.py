"""Opening of shards from unknown sources, with a check before anything is read."""

import math
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.schema import (
    READABLE_VERSIONS,
    REQUIRED,
    REQUIRED_ATTRIBUTES,
    SAMPLE_TYPES,
    SCALES,
    SHARD_INDEX,
    known_column,
)
from gensig.dataset.storage.atomic import link_text
from gensig.dataset.storage.attribute_check import KINDS, attribute_problem
from gensig.dataset.storage.attributes import (
    ATTRIBUTE_BYTES_LIMIT,
    HDF5_ERRORS,
    decoded,
    oversized_attributes,
    read_attributes,
)
from gensig.dataset.storage.compression import (
    BLOSC2_CHUNK_LIMIT,
    BLOSC2_FILTER,
    COMPRESSED_LIMIT,
    filters,
    load_blosc2,
)
from gensig.errors import DatasetError

# gzip reaches at most 1032:1; what declares more than this over what it stores is a bomb or was
# never written.
EXPANSION_LIMIT = 1100
ATTRIBUTES_LIMIT = 1000
DATASETS_LIMIT = 10_000
UNIT_BYTES_LIMIT = 100

_FILTERS = {
    h5py.h5z.FILTER_DEFLATE,
    h5py.h5z.FILTER_SHUFFLE,
    h5py.h5z.FILTER_FLETCHER32,
    h5py.h5z.FILTER_LZF,
    BLOSC2_FILTER,
}


def open_file(path: Path) -> h5py.File:
    """An HDF5 file, read-only and without locks; DatasetError when it is none."""
    if not path.is_file():
        raise DatasetError(
            f"{path} is missing or no ordinary file; restore it from a copy"
        )
    try:
        return h5py.File(path, "r", locking=False)
    except (OSError, RuntimeError) as error:
        raise DatasetError(
            f"{path} cannot be read as HDF5 ({first_line(error)}); it is damaged or no HDF5 file"
        ) from error


def open_shard(path: Path, *, folder: Path | None = None) -> h5py.File:
    """A shard, open for reading after `check_shard`.

    With `folder`, refused when the file or a folder above it, up to that one, is a link.
    """
    if folder is not None:
        above = [part for part in path.parents if part.is_relative_to(folder)]
        for part in (path, *above[:-1]):
            if part.is_symlink():
                raise DatasetError(link_text(part))
    file = open_file(path)
    try:
        check_shard(file, path)
    except BaseException:
        file.close()
        raise
    return file


def same_file(path: Path) -> tuple[int, ...]:
    """Numbers that change when a file or a link to it is replaced or written to.

    () where there is none.
    """
    try:
        target, link = path.stat(), path.lstat()
    except OSError:
        return ()
    times = (target.st_mtime_ns, target.st_ctime_ns)
    return (target.st_dev, target.st_ino, target.st_size, *times, link.st_ino)


def check_shard(file: h5py.File, path: Path) -> None:
    """Check that a file is a shard of format version 1.

    Raises
    ------
    DatasetError    for soft or external links, types that are no plain numbers or text, data
                    outside the file, filters other than gzip, lzf and blosc2, shapes larger than
                    what is stored, missing columns, unequal row counts, attributes of another
                    kind or length, blosc2 without the package that reads it
    """
    try:
        contents = datasets(file, path)
        missing = [name for name in REQUIRED if name not in contents]
        if missing:
            raise DatasetError(
                f"{path} has no data set {', '.join(missing)}; it is no gensig shard"
            )
        n_records = row_count(contents["record_id"])
        for name, data in contents.items():
            _check_dataset(name, data, n_records, path)
        if 0 in contents["acceleration"].shape:
            raise DatasetError(
                f"{path}: acceleration has shape {contents['acceleration'].shape}; a record has "
                "at least one channel and one sample"
            )
        for name, scale in SCALES.items():
            _check_scale(contents, name, scale, path)
        _check_attributes(file, contents, path)
    except HDF5_ERRORS as error:
        raise DatasetError(
            f"{path} is damaged ({first_line(error)}); restore it from a copy"
        ) from error


def datasets(file: h5py.File, path: Path) -> dict[str, h5py.Dataset]:
    """All data sets of the root and of its groups one level down, by name.

    DatasetError for links and other objects.
    """
    contents: dict[str, h5py.Dataset] = {}

    def collect(group: h5py.Group, prefix: str, *, deeper: bool) -> None:
        for key in group:
            if not isinstance(key, str):
                raise DatasetError(
                    f"{path}: the name {key!r} is no UTF-8 text; the file is damaged"
                )
            if group.id.links.get_info(key.encode()).type != h5py.h5l.TYPE_HARD:
                raise DatasetError(
                    f"{path}: '{shown(prefix + key)}' is a link; a shard holds its own data only"
                )
            if len(contents) >= DATASETS_LIMIT:
                raise DatasetError(
                    f"{path} has more than {DATASETS_LIMIT} data sets; it is no gensig shard"
                )
            item = group[key]
            if isinstance(item, h5py.Dataset):
                contents[prefix + key] = item
            elif isinstance(item, h5py.Group) and deeper:
                collect(item, f"{prefix}{key}/", deeper=False)
            else:
                raise DatasetError(
                    f"{path}: '{shown(prefix + key)}' is neither a data set nor a group of data "
                    "sets"
                )

    collect(file, "", deeper=True)
    return contents


def row_count(data: h5py.Dataset) -> int:
    """Length of axis 0; 0 for a scalar."""
    return int((*data.shape, 0)[0])


def _check_dataset(name: str, data: h5py.Dataset, n_records: int, path: Path) -> None:
    label = f"{path}: data set '{shown(name)}'"
    dtype = data.dtype
    if dtype.kind not in "Siuf" or dtype.subdtype is not None:
        raise DatasetError(
            f"{label} has type {dtype}; allowed are numbers and text of fixed length"
        )
    if data.is_virtual or data.external:
        raise DatasetError(
            f"{label} keeps its data in another file; a shard holds its own data only"
        )
    if n_records == 0 or row_count(data) != n_records:
        raise DatasetError(
            f"{label} has shape {data.shape}, record_id has {n_records} rows; all must be equal, "
            "not 0"
        )
    used = filters(data)
    if not used <= _FILTERS:
        raise DatasetError(
            f"{label} uses HDF5 filter {sorted(used - _FILTERS)}; allowed are gzip, lzf and blosc2"
        )
    if BLOSC2_FILTER in used:
        load_blosc2(f"{path} is compressed with blosc2; reading it")
    if not _is_stored(data, used):
        raise DatasetError(
            f"{label} declares {data.size * dtype.itemsize} bytes and stores "
            f"{data.id.get_storage_size()}; it was never written or is a bomb"
        )
    unit = data.attrs.get_id("unit").dtype if "unit" in data.attrs else None
    if unit is not None and (unit.kind != "S" or unit.itemsize > UNIT_BYTES_LIMIT):
        raise DatasetError(
            f"{label} has a unit of type {unit}; it must be a short text"
        )
    column = known_column(name)
    if column is None:
        return
    wanted, n_axes = column.dtype, 1 + len(column.axes)
    is_wanted = dtype.kind == column.storage_dtype.kind
    if name in SCALES:
        wanted = " or ".join(SAMPLE_TYPES)
        is_wanted |= dtype.kind == "i" and dtype.itemsize == 2
    if not is_wanted or data.ndim != n_axes:
        raise DatasetError(
            f"{label} has type {dtype} and {data.ndim} axes; format version 1 wants {wanted} and "
            f"{n_axes}"
        )


def holds_its_data(data: h5py.Dataset) -> bool:
    """True for a data set whose values are all stored in its file, as declared."""
    used = filters(data)
    return (
        not data.is_virtual
        and not data.external
        and used <= _FILTERS - {BLOSC2_FILTER}
        and _is_stored(data, used)
    )


def _is_stored(data: h5py.Dataset, used: set[int]) -> bool:
    """False for what declares more than its bytes in the file can hold, in all or in one chunk."""
    item, chunks = data.dtype.itemsize, data.chunks or (0,)
    chunk = math.prod(chunks) * item
    at_once = math.prod(data.shape[1:] if data.ndim > 1 else data.shape) * item
    if used and max(at_once, chunk) > COMPRESSED_LIMIT:
        return False
    if BLOSC2_FILTER in used:
        sizes = zip(data.shape, chunks, strict=True)
        n_chunks = math.prod(-(-length // step) for length, step in sizes)
        return chunk <= BLOSC2_CHUNK_LIMIT and data.id.get_num_chunks() == n_chunks
    limit = data.id.get_storage_size()
    if used:
        limit *= EXPANSION_LIMIT
    return max(data.size * item, chunk) <= limit


def _check_scale(
    contents: dict[str, h5py.Dataset], name: str, scale: str, path: Path
) -> None:
    """Refuse counts without their scale, one a record and channel."""
    if name not in contents or contents[name].dtype.kind == "f":
        return
    if scale not in contents:
        raise DatasetError(
            f"{path}: {name} is int16 and there is no data set {scale}; its values are unknown"
        )
    if contents[scale].shape != contents[name].shape[:2]:
        raise DatasetError(
            f"{path}: {scale} has shape {contents[scale].shape}, {name} has "
            f"{contents[name].shape[:2]} "
            "records and channels"
        )


def _check_attributes(
    file: h5py.File, contents: dict[str, h5py.Dataset], path: Path
) -> None:
    if len(file.attrs) > ATTRIBUTES_LIMIT:
        raise DatasetError(
            f"{path} has {len(file.attrs)} attributes; it is no gensig shard"
        )
    if too_large := oversized_attributes(file):
        raise DatasetError(
            f"{path}: attribute {shown(too_large[0])} has more than {ATTRIBUTE_BYTES_LIMIT} "
            "bytes; it is no gensig shard"
        )
    attributes = read_attributes(file)
    missing = [name for name in REQUIRED_ATTRIBUTES if name not in attributes]
    if missing:
        raise DatasetError(
            f"{path} has no root attribute {', '.join(missing)}; it is no gensig shard"
        )
    version, rate = attributes["schema_version"], attributes["sampling_rate_hz"]
    if version not in READABLE_VERSIONS:
        known = " and ".join(map(str, READABLE_VERSIONS))
        raise DatasetError(
            f"{path} has format version {version}; this gensig reads {known}, get a matching one"
        )
    if not isinstance(rate, int | float) or not 0 < rate < float("inf"):
        raise DatasetError(
            f"{path}: sampling_rate_hz is {rate}; it must be a positive number"
        )
    lengths = {"channel": contents["acceleration"].shape[1]}
    if "acceleration_source" in contents:
        lengths["source"] = contents["acceleration_source"].shape[1]
    for name in KINDS.keys() - attributes.keys():
        if name in file.attrs:
            raise DatasetError(
                f"{path}: attribute {name} has no plain type; it must be {KINDS[name]}"
            )
    if problem := attribute_problem(attributes, lengths):
        raise DatasetError(f"{path}: {problem}")


def shard_labels(file: h5py.File) -> dict:
    """Root attributes of a shard, and its number as `SHARD_INDEX` where it says that."""
    labels = read_attributes(file)
    labels.pop(SHARD_INDEX, None)
    number = read_attributes(file["record_id"]).get(SHARD_INDEX)
    if number is not None:
        labels[SHARD_INDEX] = number
    return labels


def read_rows(data: h5py.Dataset) -> np.ndarray:
    """The whole of a small data set, text decoded."""
    values = data[...]
    if values.dtype.kind == "S":
        return decoded(values)
    return values


def unknown_class(labels: np.ndarray, class_names: Sequence[str]) -> str:
    """One line on the first label that is no number of a class; '' for none."""
    wrong = labels[(labels < 0) | (labels >= len(class_names))]
    if not wrong.size:
        return ""
    return f"it has the label {wrong[0]}, and {len(class_names)} classes"


def first_line(error: Exception) -> str:
    """The first line of an error's text."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def shown(text: str) -> str:
    """A name out of a file on one printable line of moderate length."""
    return "".join(c if c.isprintable() else "?" for c in text)[:80]
