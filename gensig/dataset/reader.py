"""Reading a data set: columns of all records, and the signals of one record at a time."""

import os
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from gensig.dataset.attributes import HDF5_ERRORS, read_attributes
from gensig.dataset.guard import datasets, first_line, open_shard, read_rows
from gensig.dataset.layout import PLAN, SPLITS, Manifest, read_manifest, shard_path
from gensig.dataset.plan import Plan, read_plan
from gensig.dataset.schema import SIGNALS
from gensig.dataset.splits import SUBSETS, read_split
from gensig.errors import DatasetError

MAX_OPEN_SHARDS = 64

SplitRows = dict[str, list[tuple[int, float, float]]]


def open_dataset(path: str | Path, *, allow_incomplete: bool = False) -> "Dataset":
    """Open a data-set folder for reading; nothing is loaded yet, nothing in the folder is changed.

    Parameters
    ----------
    path : str | Path           the folder
    allow_incomplete : bool     open an interrupted run too; records of missing shards are not `usable`

    Raises
    ------
    DatasetError    when the folder is no data set, or is incomplete and that was not allowed
    """
    folder = Path(path)
    manifest = read_manifest(folder)
    if not manifest.is_complete and not allow_incomplete:
        raise DatasetError(
            f"{folder} is incomplete: {manifest.n_done} of {len(manifest.shards)} shards are done; run "
            f"`gensig resume {folder}`, or open it with allow_incomplete=True"
        )
    return Dataset(folder, manifest)


class Dataset:
    """A data set on disk. Made by `open_dataset`; can be pickled, forked and used by several processes.

    Attributes
    ----------
    folder : Path
    manifest : Manifest
    n_records : int
    sampling_rate : float            Hz
    channel_names, class_names : list of text, in the order of the channel axis and of `label`
    attributes : dict                root attributes of the shards
    column_names, protocols : list of text
    usable : (record,) bool          False for failed records and those of missing shards
    """

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self.folder = folder
        self.manifest = manifest
        self.n_records = manifest.n_records
        self._starts = np.cumsum([0, *(entry.rows for entry in manifest.shards)])
        first_done = next((i for i, entry in enumerate(manifest.shards) if entry.state == "done"), None)
        if first_done is None:
            raise DatasetError(f"{folder} has no finished shard yet; run `gensig resume {folder}`")
        self._columns: dict[str, np.ndarray] = {}
        self._plan: Plan | None = None
        self._files: OrderedDict[int, h5py.File] = OrderedDict()
        self._pid = os.getpid()
        first = self._file(first_done)
        self.attributes: dict[str, Any] = read_attributes(first)
        self.sampling_rate = float(self.attributes["sampling_rate_hz"])
        self.channel_names: list[str] = list(self.attributes["channel_names"])
        self.class_names: list[str] = list(self.attributes["class_names"])
        self._shape: tuple[int, int] = first["acceleration"].shape[1:]
        self._types = {
            name: (data.dtype, data.shape[1:])
            for name, data in datasets(first, folder).items()
            if not (name in SIGNALS and SIGNALS[name].is_bulk)
        }

    @property
    def column_names(self) -> list[str]:
        """Names that `column` takes."""
        return sorted(self._types)

    @property
    def n_samples(self) -> int:
        """Samples of one channel of one record."""
        return int(self._shape[1])

    @property
    def usable(self) -> np.ndarray:
        """(record,) bool: True where status is 'ok'."""
        return self.column("status") == "ok"

    @property
    def plan(self) -> Plan:
        """The plan, read once."""
        if self._plan is None:
            self._plan = read_plan(self.folder / PLAN)
            if self._plan.n_records != self.n_records:
                raise DatasetError(
                    f"{self.folder}: the plan has {self._plan.n_records} records, the manifest "
                    f"{self.n_records}; run `gensig verify {self.folder}`"
                )
        return self._plan

    @property
    def protocols(self) -> list[str]:
        """Names that `split` takes."""
        return sorted(Path(name).stem for name in self.manifest.files if name.startswith(f"{SPLITS}/"))

    def column(self, name: str) -> np.ndarray:
        """One value (or short vector) a record, (record, ...), read-only; text as numpy strings.

        Records of shards that are missing hold NaN, -1 or ''.
        """
        if name not in self._types:
            raise DatasetError(
                f"column {name!r} does not exist in {self.folder}; it has {', '.join(self.column_names)}"
            )
        if name not in self._columns:
            dtype, shape = self._types[name]
            kind = dtype.kind
            missing = np.array("" if kind == "S" else np.nan if kind == "f" else -1)
            parts = []
            for i, entry in enumerate(self.manifest.shards):
                if entry.state == "done":
                    parts.append(self._read_rows(i, name, shape))
                else:
                    part = np.full((entry.rows, *shape), missing)
                    parts.append(part if kind == "S" else part.astype(dtype))
            values = np.concatenate(parts)
            values.flags.writeable = False
            self._columns[name] = values
        return self._columns[name]

    def signals(
        self,
        record_index: int,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
        *,
        name: str = "acceleration",
    ) -> np.ndarray:
        """Acceleration of one record, (channel, sample) float32 in m/s^2.

        Parameters
        ----------
        record_index : int     0 to n_records - 1, in plan order
        start, stop : int      samples, stop exclusive; None is the end
        channels : sequence    names or numbers; None is all, in their order
        name : str             'acceleration' or 'acceleration_clean'
        """
        stop = self.n_samples if stop is None else stop
        if not 0 <= record_index < self.n_records:
            raise DatasetError(f"record {record_index} does not exist; {self.folder} has 0 to {self.n_records - 1}")
        if not 0 <= start < stop <= self.n_samples:
            raise DatasetError(f"samples {start} to {stop}; a record has 0 to {self.n_samples}")
        shard = int(np.searchsorted(self._starts, record_index, side="right")) - 1
        if self.manifest.shards[shard].state != "done":
            raise DatasetError(f"record {record_index} is in {self.manifest.shards[shard].name}, which is not made yet")
        file = self._file(shard)
        if name not in ("acceleration", "acceleration_clean") or name not in file:
            raise DatasetError(f"{self.folder} has no signal {name!r}; it has acceleration")
        try:
            block = file[name][record_index - int(self._starts[shard]), :, start:stop]
        except HDF5_ERRORS as error:
            raise self._unreadable(shard, error) from error
        block = block.astype(np.float32, copy=False)
        return block if channels is None else block[[self._channel(channel) for channel in channels]]

    def split(self, protocol: str) -> SplitRows:
        """subset -> list of (record_index, start_fraction, stop_fraction); failed records are in it, see `usable`."""
        if protocol not in self.protocols:
            raise DatasetError(
                f"split {protocol!r} does not exist in {self.folder}; it has {', '.join(self.protocols)}"
            )
        path = self.folder / SPLITS / f"{protocol}.csv"
        table = read_split(path)
        index = {record_id: i for i, record_id in enumerate(self.plan.columns["record_id"].tolist())}
        rows: SplitRows = {subset: [] for subset in SUBSETS}
        columns = (table.record_id, table.start_fraction, table.stop_fraction, table.subset)
        for record_id, start, stop, subset in zip(*(column.tolist() for column in columns), strict=True):
            if record_id not in index:
                raise DatasetError(
                    f"{path} names record {record_id[:40]!r}, which the plan has not; restore it from a copy"
                )
            rows[subset].append((index[record_id], start, stop))
        return rows

    def close(self) -> None:
        """Close the files; they open again when needed."""
        files, self._files = self._files, OrderedDict()
        if self._pid == os.getpid():
            for file in files.values():
                file.close()

    def __enter__(self) -> "Dataset":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __len__(self) -> int:
        return self.n_records

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_files": OrderedDict()}

    def __repr__(self) -> str:
        return f"Dataset({str(self.folder)!r}, {self.n_records} records, classes {self.class_names})"

    def _file(self, shard: int) -> h5py.File:
        """The open shard; at most `MAX_OPEN_SHARDS` stay open, and none is shared with a forked process."""
        if self._pid != os.getpid():
            self._files, self._pid = OrderedDict(), os.getpid()
        if shard in self._files:
            self._files.move_to_end(shard)
            return self._files[shard]
        file = open_shard(shard_path(self.folder, shard), folder=self.folder)
        if file["record_id"].shape[0] != self.manifest.shards[shard].rows:
            file.close()
            raise self._unreadable(shard, ValueError("another number of rows than the manifest says"))
        self._files[shard] = file
        if len(self._files) > MAX_OPEN_SHARDS:
            self._files.popitem(last=False)[1].close()
        return file

    def _read_rows(self, shard: int, name: str, shape: tuple[int, ...]) -> np.ndarray:
        try:
            values = read_rows(self._file(shard)[name])
        except HDF5_ERRORS as error:
            raise self._unreadable(shard, error) from error
        if values.shape[1:] != shape:
            raise self._unreadable(shard, ValueError(f"{name} has another shape than in the other shards"))
        return values

    def _channel(self, channel: int | str) -> int:
        if isinstance(channel, str) and channel in self.channel_names:
            return self.channel_names.index(channel)
        if not isinstance(channel, str) and 0 <= channel < len(self.channel_names):
            return int(channel)
        raise DatasetError(f"channel {channel!r} does not exist; there are {', '.join(self.channel_names)}")

    def _unreadable(self, shard: int, error: Exception) -> DatasetError:
        reason = first_line(error)
        return DatasetError(
            f"{shard_path(self.folder, shard)} cannot be read ({reason}); run `gensig verify {self.folder}`"
        )
