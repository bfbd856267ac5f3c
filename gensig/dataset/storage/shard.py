"""Writing one shard.

An HDF5 file that appears whole or not at all, with the same bytes for the same input.
"""

import difflib
import math
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.columns import (
    COLUMNS,
    GEAR_COLUMNS,
    GEAR_NAMES,
    IS_REFERENCE,
    LIFE_COLUMNS,
    LINE_FAULT_GEAR,
    Column,
)
from gensig.dataset.folder.layout import ShardEntry
from gensig.dataset.schema import (
    DEFAULTS,
    PARAMS,
    REQUIRED_ATTRIBUTES,
    SAMPLE_TYPES,
    SCALES,
    SHARD_INDEX,
    SIGNALS,
    find_signal,
    signal_column,
    stored_reason,
    unit_in_file,
    version_of,
)
from gensig.dataset.storage.attributes import Attribute, set_attribute
from gensig.dataset.storage.compression import (
    BLOSC2_CHUNK_LIMIT,
    COMPRESSED_LIMIT,
    COMPRESSIONS,
    creation_options,
    fixed_settings,
)
from gensig.dataset.storage.image import MemoryFile
from gensig.dataset.storage.quantization import quantized
from gensig.errors import DatasetError

_PARAM_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")


def _columns(
    *, lives: bool, references: bool, gears: bool, names: bool
) -> dict[str, Column]:
    """Columns of a shard, by their names; ``names``: its gears may have any name."""
    columns = dict(COLUMNS)
    if not lives:
        for name in LIFE_COLUMNS:
            del columns[name]
    if not references:
        del columns[IS_REFERENCE]
    if not gears:
        for name in GEAR_COLUMNS:
            del columns[name]
    if names:
        column = columns["fault_gear"]
        columns["fault_gear"] = replace(column, dtype=LINE_FAULT_GEAR)
    return columns


class ShardWriter:
    """Context manager that writes one shard.

    Parameters
    ----------
    path : Path          the shard's final name; nothing appears under it before the block ends
                         cleanly
    n_records : int      number of rows
    signals : name -> shape of one record's array, such as {"acceleration": (4, 51200),
        "noise_power": (4,)}
    params : list        names of the `params/<name>` columns
    attributes : dict    root attributes; `sampling_rate_hz`, `channel_names` and `class_names` are
                         required
    compression : str    one of `COMPRESSIONS`, for the time signals
    sample_type : str    'float32', or 'int16': accelerations become counts, and the writer adds
                         their scales
    lives : bool         whether records are snapshots of lives, with `LIFE_COLUMNS`
    references : bool    whether some records are references, with `IS_REFERENCE`
    gears : bool         whether records differ in their gears, with `GEAR_COLUMNS`
    shard_index : int    number of the shard in its data set; None stores none

    Attributes
    ----------
    sha256, n_bytes, n_failed    of the finished file, set when the block has ended cleanly

    Raises
    ------
    DatasetError    for unknown names, wrong shapes or types, a row written twice or never, a disk
                    that is full

    The bytes depend neither on time, folder nor process; with `compression='none'` not on the
    order of `write` either. The shard is built in memory and then written in one go.
    """

    def __init__(
        self,
        path: Path,
        *,
        n_records: int,
        signals: Mapping[str, tuple[int, ...]],
        params: Sequence[str],
        attributes: Mapping[str, Attribute],
        compression: str = "none",
        sample_type: str = "float32",
        lives: bool = False,
        references: bool = False,
        gears: bool = False,
        shard_index: int | None = None,
    ) -> None:
        self.shard_index = shard_index
        self.path = Path(path)
        self.n_records = n_records
        self.signals = {name: tuple(shape) for name, shape in signals.items()}
        self.compression = compression
        self.sample_type = sample_type
        self.scales: dict[str, str] = {}
        if sample_type == "int16":
            self.scales = {name: SCALES[name] for name in SCALES if name in signals}
        self.columns = _columns(
            lives=lives,
            references=references,
            gears=gears,
            names=GEAR_NAMES in attributes,
        )
        self.version = version_of(self.columns)
        self.attributes = {"schema_version": self.version, **attributes}
        for name in params:
            full_name = f"{PARAMS}/{name}"
            self.columns[full_name] = Column(
                name=full_name,
                dtype="float64",
                unit="",
                role="condition",
                description="drawn or swept value",
            )
        _check_declaration(self, params)
        self._options = creation_options(compression)
        self.sha256 = ""
        self.n_bytes = 0
        self.n_failed = 0
        self._rows = {
            name: np.zeros(n_records, column.storage_dtype)
            for name, column in self.columns.items()
        }
        for name, shape in self.signals.items():
            if not signal_column(name).is_bulk:
                dtype = signal_column(name).storage_dtype
                self._rows[name] = np.zeros((n_records, *shape), dtype)
        for name, scale in self.scales.items():
            self._rows[scale] = np.zeros((n_records, self.signals[name][0]), "<f8")
        self._written = np.zeros(n_records, dtype=bool)
        self._bulk: dict[str, h5py.Dataset] = {}
        self._file: MemoryFile | None = None

    def __enter__(self) -> "ShardWriter":
        self._file = MemoryFile()
        try:
            for name, value in self.attributes.items():
                set_attribute(self._file, name, value)
            for name, shape in self.signals.items():
                if signal_column(name).is_bulk:
                    self._create_bulk(name, shape)
            self._file.flush()  # takes the memory of all rows at once
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._finish()
        finally:
            self._close()

    @property
    def entry(self) -> ShardEntry:
        """Entry of the finished shard in the manifest of its data set."""
        return ShardEntry(
            name=self.path.name,
            rows=self.n_records,
            state="done",
            sha256=self.sha256,
            bytes=self.n_bytes,
            n_failed=self.n_failed,
        )

    def write(
        self,
        row: int,
        signals: Mapping[str, np.ndarray],
        values: Mapping[str, str | int | float],
    ) -> None:
        """Write one record.

        Parameters
        ----------
        row : int        0 to n_records - 1, each exactly once
        signals : dict   every declared signal; a record with status 'failed' may leave
                         floating-point ones out (NaN)
        values : dict    every column of `COLUMNS` but those in `DEFAULTS`; `params/<name>` left
                         out become NaN
        """
        if self._file is None:
            raise DatasetError(
                f"{self.path.name}: write is allowed inside the with-block only"
            )
        if not 0 <= row < self.n_records or self._written[row]:
            raise DatasetError(
                f"{self.path.name}: row {row} is out of range or written already; "
                f"each of 0 to {self.n_records - 1} is written once"
            )
        self._refuse_unknown(signals, self.signals)
        self._refuse_unknown(values, self.columns)
        encoded = {
            name: _encoded(column, _value(column, values))
            for name, column in self.columns.items()
        }
        _check_row(values)
        failed = encoded["status"] == b"failed"
        arrays = {
            name: self._signal(name, signals, failed=failed) for name in self.signals
        }
        for name, array in arrays.items():
            if name in self.scales:
                array, self._rows[self.scales[name]][row] = quantized(array)
            if signal_column(name).is_bulk:
                with fixed_settings():
                    self._bulk[name][row] = array
            else:
                self._rows[name][row] = array
        for name, value in encoded.items():
            self._rows[name][row] = value
        self._written[row] = True

    def _signal(
        self, name: str, signals: Mapping[str, np.ndarray], *, failed: bool
    ) -> np.ndarray:
        column, shape = signal_column(name), self.signals[name]
        if name not in signals:
            if failed and column.storage_dtype.kind == "f":
                return np.full(shape, np.nan, column.storage_dtype)
            raise DatasetError(
                f"{self.path.name}: signal {name} is missing; only a record with status 'failed' "
                "may omit it"
            )
        given = np.asarray(signals[name])
        if given.shape != shape or given.dtype.kind not in "fiub":
            raise DatasetError(
                f"{self.path.name}: signal {name} has shape {given.shape} and type {given.dtype}, "
                f"declared is {shape} of {column.dtype}"
            )
        with np.errstate(over="ignore"):  # beyond float32 becomes inf, refused below
            array = given.astype(column.storage_dtype, copy=False)
        if column.is_bulk and not failed and not np.isfinite(array).all():
            raise DatasetError(
                f"{self.path.name}: {name} is not finite; write the record with status 'failed'"
            )
        return array

    def _create_bulk(self, name: str, shape: tuple[int, ...]) -> None:
        assert self._file is not None
        column = signal_column(name)
        scale = self.scales.get(name)
        dtype, unit = column.storage_dtype, unit_in_file(column, self.attributes)
        if scale is not None:
            dtype, unit = np.dtype("<i2"), "1"
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        chunks: tuple[int, ...] | None = (1, *shape)
        if self.compression == "none":
            # One piece without chunks takes a third of the time. Space is laid out now, in row
            # order, and not filled first: every row is written anyway.
            chunks = None
            properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
            properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        data = self._file.create_dataset(
            name,
            shape=(self.n_records, *shape),
            dtype=dtype,
            chunks=chunks,
            track_times=False,
            dcpl=properties,
            **self._options,
        )
        self._bulk[name] = data
        set_attribute(data, "unit", unit)
        if scale is not None:
            set_attribute(data, "scale", scale)

    def _refuse_unknown(self, given: Mapping, known: Mapping) -> None:
        for name in given:
            if name not in known:
                near = difflib.get_close_matches(name, known, n=3) or sorted(known)[:5]
                raise DatasetError(
                    f"{self.path.name}: '{name}' is not declared; did you mean {', '.join(near)}?"
                )

    def _finish(self) -> None:
        assert self._file is not None
        missing = np.flatnonzero(~self._written)
        if missing.size:
            raise DatasetError(
                f"{self.path.name}: {missing.size} of {self.n_records} rows were never written, "
                f"the first is row {missing[0]}; write every row"
            )
        if len(np.unique(self._rows["record_id"])) != self.n_records:
            raise DatasetError(
                f"{self.path.name}: a record_id occurs twice; ids must be unique"
            )
        for name, rows in self._rows.items():
            column = find_signal(name) or self.columns[name]
            data = self._file.create_dataset(
                name, data=rows, dtype=column.storage_dtype, track_times=False
            )
            set_attribute(data, "unit", unit_in_file(column, self.attributes))
        if self.shard_index is not None:
            set_attribute(self._file["record_id"], SHARD_INDEX, self.shard_index)
        self.n_failed = int(np.count_nonzero(self._rows["status"] == b"failed"))
        with fixed_settings():  # HDF5 compresses what is in its cache now
            self.sha256, self.n_bytes = self._file.publish(self.path)

    def _close(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()


def _check_declaration(writer: ShardWriter, params: Sequence[str]) -> None:
    """Raise DatasetError for a declaration that could not be read back."""
    name = writer.path.name
    for key, given, known in (
        ("compression", writer.compression, COMPRESSIONS),
        ("sample_type", writer.sample_type, SAMPLE_TYPES),
    ):
        if given not in known:
            raise DatasetError(
                f"{name}: {key} '{given}' is unknown; allowed are {', '.join(known)}"
            )
    if writer.n_records < 1:
        raise DatasetError(
            f"{name}: {writer.n_records} records; a shard needs at least 1"
        )
    axes = {
        key: column.axes
        for key, column in SIGNALS.items()
        if key not in SCALES.values()
    }
    for signal, shape in writer.signals.items():
        column = find_signal(signal)
        has_axes = column is not None and len(shape) == len(column.axes)
        if not has_axes or signal in SCALES.values() or min(shape) < 1:
            allowed = ", ".join(f"{key} ({', '.join(axes[key])})" for key in axes)
            raise DatasetError(
                f"{name}: signal {signal} of shape {shape} is not allowed; allowed are {allowed}"
            )
        n_bytes = math.prod(shape) * signal_column(signal).n_bytes
        limits = {"none": n_bytes, "blosc2": BLOSC2_CHUNK_LIMIT}
        limit = limits.get(writer.compression, COMPRESSED_LIMIT)
        if n_bytes > limit:
            raise DatasetError(
                f"{name}: a record's {signal} has {n_bytes} bytes, {writer.compression} takes "
                f"{limit}; make shorter records or choose another compression"
            )
    missing = [key for key in REQUIRED_ATTRIBUTES if key not in writer.attributes]
    if missing or "acceleration" not in writer.signals:
        raise DatasetError(
            f"{name}: root attributes missing: {missing or 'none'}; they and the signal "
            "acceleration are required"
        )
    if writer.attributes["schema_version"] != writer.version:
        raise DatasetError(
            f"{name}: schema_version {writer.attributes['schema_version']}, this writer makes "
            f"{writer.version}"
        )
    channels = writer.attributes["channel_names"]
    n_channels = writer.signals["acceleration"][0]
    if not isinstance(channels, Sequence) or len(channels) != n_channels:
        raise DatasetError(
            f"{name}: channel_names {channels!r} for {n_channels} channels"
        )
    bad = [param for param in params if not _PARAM_NAME.fullmatch(param)]
    if bad or len(set(params)) != len(params):
        raise DatasetError(
            f"{name}: params {bad or list(params)} are refused; use distinct names of letters, "
            "digits, '_', '.', '-'"
        )


def _value(
    column: Column, values: Mapping[str, str | int | float]
) -> str | int | float:
    for known in (values, DEFAULTS):
        if column.name in known:
            return known[column.name]
    if column.name.startswith(f"{PARAMS}/"):
        return math.nan
    raise DatasetError(
        f"column {column.name} is missing ({column.description}); every record needs it"
    )


def _encoded(column: Column, value: str | int | float) -> bytes | int | float:
    """The value as it is stored; DatasetError when it does not fit the column."""
    try:
        if column.is_text:
            if not isinstance(value, str) or "\0" in value:
                raise TypeError
            if column.name == "status_reason":
                return stored_reason(value).encode("ascii")
            encoded = value.encode("ascii")
            if len(encoded) > column.n_bytes:
                raise OverflowError
            return encoded
        if column.storage_dtype.kind == "f":
            if isinstance(value, str):
                raise TypeError
            number = float(value)
            return math.nan if math.isnan(number) else number
        integer = operator.index(value)  # type: ignore[arg-type]
        if not np.iinfo(column.dtype).min <= integer <= np.iinfo(column.dtype).max:
            raise OverflowError
        return integer
    except (TypeError, ValueError, OverflowError) as error:
        kind = f"value of type {column.dtype}"
        if column.is_text:
            kind = f"ASCII text of at most {column.n_bytes} bytes"
        raise DatasetError(
            f"column {column.name}: {value!a} is no {kind}; give {column.description}"
        ) from error


def _check_row(values: Mapping[str, str | int | float]) -> None:
    status = values.get("status", "ok")
    if status not in ("ok", "failed"):
        raise DatasetError(
            f"column status: {status!r} is unknown; allowed are 'ok' and 'failed'"
        )
    if not 0.0 <= float(values["severity"]) <= 1.0:
        raise DatasetError(
            f"column severity: {values['severity']} is outside 0 (healthy) to 1"
        )
