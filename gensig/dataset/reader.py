"""Reading a data set: columns of all records, and the signals of one record at a time."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gensig.dataset.columns import GEAR_NAMES, GEAR_TEETH, IS_REFERENCE
from gensig.dataset.folder.layout import (
    PLAN,
    SPLITS,
    Manifest,
    read_manifest,
)
from gensig.dataset.folder.quick_check import check_opening
from gensig.dataset.folder.verify import damage
from gensig.dataset.plan import Plan, read_plan
from gensig.dataset.schema import SCALES, bulk_signals, signal_column
from gensig.dataset.selection import (
    Records,
    Selection,
    StoredRecord,
    record_numbers,
    structured,
    unknown_name,
)
from gensig.dataset.shard_files import ShardFiles
from gensig.dataset.splitting.protocols import NEW_MACHINE, PROTOCOLS, why_left_out
from gensig.dataset.splitting.splits import SUBSETS, SplitTable, read_split
from gensig.dataset.storage.attributes import read_attributes
from gensig.dataset.storage.compression import compression_of
from gensig.dataset.storage.guard import (
    datasets,
    read_rows,
    unknown_class,
)
from gensig.dataset.storage.index_check import quick_index_problem
from gensig.dataset.storage.quantization import read_signal
from gensig.errors import DatasetError

if TYPE_CHECKING:
    from pandas import DataFrame

CHECKS = ("quick", "full")
PAIR_GEARS = ("pinion", "wheel")  # gears of a set that names none

SplitRows = dict[str, list[tuple[int, float, float]]]


def open_dataset(
    path: str | Path, *, allow_incomplete: bool = False, check: str = "quick"
) -> "Dataset":
    """Open a data-set folder for reading; nothing is loaded yet, nothing in the folder is changed.

    Damage is noticed at three moments, with ``check="quick"``:

    - on opening: symbolic links; a manifest other than `SHA256SUMS` says; a plan other than the
      manifest says; finished shards that are missing or have another size;
    - when a shard is first read, and again after it changed: a damaged HDF5 structure, another
      format version, shard number, identity or number of rows, a first record other than the
      plan says; when a split is read: one other than the manifest says;
    - only by ``check="full"`` and `gensig verify`: changed bytes inside a shard of the right
      size, and changes of files that this reader does not read.

    Parameters
    ----------
    path : str | Path           the folder
    allow_incomplete : bool     open an interrupted run too; records of missing shards are not
                                `usable`
    check : str                 'quick', or 'full': every byte is read and compared first, as
                                `gensig verify` does

    Raises
    ------
    DatasetError    when the folder is no data set, is damaged as far as that is checked, or is
                    incomplete and that was not allowed; for another ``check``
    """
    if check not in CHECKS:
        raise DatasetError(f"check={check!r}; allowed are {', '.join(CHECKS)}")
    folder = Path(path)
    manifest = read_manifest(folder)
    if not manifest.is_complete and not allow_incomplete:
        raise DatasetError(
            f"{folder} is incomplete: {manifest.n_done} of {len(manifest.shards)} shards are "
            f"done; run `gensig resume {folder}`, or open it with allow_incomplete=True"
        )
    check_opening(folder, manifest)
    if check == "full" and (problems := damage(folder, manifest)):
        n_more = len(problems) - 1
        more = f" and {n_more} more" if n_more else ""
        raise DatasetError(f"{folder} is NOT whole: {problems[0]}{more}")
    data = Dataset(folder, manifest)
    data.check_index()
    return data


class Dataset:
    """A data set on disk. Made by `open_dataset`; can be pickled, forked and used by several
    processes.

    Attributes
    ----------
    folder : Path
    manifest : Manifest
    n_records : int
    sampling_rate : float            Hz
    channel_names, class_names : list of text, in the order of the channel axis and of `label`
    attributes : dict                root attributes of the shards
    sample_type, compression : str   how `signals` are stored: 'float32' or 'int16'; 'none',
        'gzip', 'lzf' or 'blosc2'
    column_names, signal_names, protocols : list of text
    usable : (record,) bool          False for failed records and those of missing shards
    is_reference : (record,) bool    True for reference records, which are no examples
    """

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self.folder = folder
        self.manifest = manifest
        self.n_records = manifest.n_records
        self._shards = ShardFiles(folder, manifest)
        done = [i for i, entry in enumerate(manifest.shards) if entry.state == "done"]
        if not done:
            raise DatasetError(
                f"{folder} has no finished shard yet; run `gensig resume {folder}`"
            )
        self._columns: dict[str, np.ndarray] = {}
        self._plan: Plan | None = None
        first = self._shards.open(done[0])
        self.attributes: dict[str, Any] = read_attributes(first)
        self.sampling_rate = float(self.attributes["sampling_rate_hz"])
        self.channel_names: list[str] = list(self.attributes["channel_names"])
        self.class_names: list[str] = list(self.attributes["class_names"])
        self.sample_type = str(first["acceleration"].dtype.name)
        self.compression = compression_of(first["acceleration"])
        self._shape: tuple[int, int] = first["acceleration"].shape[1:]
        contents = datasets(first, folder)
        self.signal_names = bulk_signals(contents)
        columns = contents.keys() - self.signal_names
        self._types = {
            name: (contents[name].dtype, contents[name].shape[1:]) for name in columns
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
    def is_reference(self) -> np.ndarray:
        """(record,) bool: True for reference records, which are no examples."""
        if IS_REFERENCE not in self._types:
            return np.zeros(self.n_records, dtype=bool)
        return self.column(IS_REFERENCE) == 1

    @property
    def gear_names(self) -> list[str]:
        """Names of the gears: pinion and wheel, in sets of drive lines all of the line."""
        return list(self.attributes.get(GEAR_NAMES, PAIR_GEARS))

    def n_teeth(self, gear: str) -> np.ndarray:
        """Teeth of a gear, (record,) int64: of each unit's gear, or of the one design.

        Gears are 'pinion' and 'wheel', in sets of drive lines all of the attribute gear_names.

        Raises
        ------
        DatasetError    where the data set does not say
        """
        name = f"n_teeth_{gear}"
        if name in self._types:
            return self.column(name).astype(np.int64)
        names = self.attributes.get(GEAR_NAMES, [])
        number = self.attributes.get(name)
        if gear in names:
            number = self.attributes[GEAR_TEETH][names.index(gear)]
        if not isinstance(number, int | np.integer):
            raise DatasetError(
                f"{self.folder} has neither a column nor an attribute {name}; gensig writes it "
                "for 'pinion' and 'wheel'"
            )
        return np.full(self.n_records, number, dtype=np.int64)

    @property
    def plan(self) -> Plan:
        """The plan, read once."""
        if self._plan is None:
            self._plan = read_plan(self.folder / PLAN, sha256=self.manifest.files[PLAN])
            if self._plan.n_records != self.n_records:
                raise DatasetError(
                    f"{self.folder}: the plan has {self._plan.n_records} records, the manifest "
                    f"{self.n_records}; run `gensig verify {self.folder}`"
                )
        return self._plan

    @property
    def plan_table(self) -> np.ndarray:
        """The plan as one structured array, (record,): a field a column, text, int64 or float64."""
        return structured(self.plan.columns)

    @property
    def protocols(self) -> list[str]:
        """Names that `split` takes, in order; `new_machine`, the hardest, comes first."""
        files = map(Path, self.manifest.files)
        names = (path.stem for path in files if path.parent.name == SPLITS)
        return sorted(names, key=lambda name: (name != NEW_MACHINE, name))

    def column(self, name: str) -> np.ndarray:
        """One value (or short vector) a record, (record, ...), read-only; text as numpy strings.

        Records of shards that are missing hold NaN, -1 or ''.
        """
        if name not in self._columns:
            shards = range(len(self.manifest.shards))
            values = np.concatenate(
                [self.shard_column(shard, name) for shard in shards]
            )
            values.flags.writeable = False
            self._columns[name] = values
        return self._columns[name]

    def shard_column(self, shard: int, name: str) -> np.ndarray:
        """The part of `column` that one shard holds, (row, ...); read anew each time."""
        if name not in self._types:
            raise unknown_name("column", name, self.column_names, self.folder)
        dtype, shape = self._types[name]
        entry = self.manifest.shards[shard]
        if entry.state != "done":
            missing = {"S": "", "f": np.nan}.get(dtype.kind, -1)
            kind = None if dtype.kind == "S" else dtype
            return np.full((entry.rows, *shape), missing, dtype=kind)
        with self._shards.reading(shard) as file:
            values = read_rows(file[name])
        if values.shape[1:] != shape:
            raise self._another_shape(shard, name)
        if name == "label" and (problem := unknown_class(values, self.class_names)):
            raise self._shards.unreadable(shard, problem)
        return values

    def check_index(self) -> None:
        """Raise DatasetError for an index that is not one over the shards; it is not read.

        That of a set with very many shards is left to `gensig verify`.
        """
        first = next(
            index
            for index, entry in enumerate(self.manifest.shards)
            if entry.state == "done"
        )
        shard = self._shards.open(first)
        if problem := quick_index_problem(self.folder, self.manifest, shard):
            raise DatasetError(f"{problem}; run `gensig verify {self.folder}`")

    def first_record(self, shard: int) -> int:
        """Number of the record in row 0 of a shard."""
        return int(self._shards.starts[shard])

    def signals(
        self,
        records: Records,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
        *,
        name: str = "acceleration",
    ) -> np.ndarray:
        """Acceleration in m/s^2, float32 however it is stored.

        Parameters
        ----------
        records : one record by its number in the plan's order or its id, or several by a slice, a
            list of numbers or ids, or (record,) bool
        start, stop : samples, stop exclusive; None is the end
        channels : names or numbers; None is all, in their order
        name : 'acceleration', 'acceleration_clean' or 'healthy_twin'

        Returns
        -------
        (channel, sample) of one record, (record, channel, sample) of several

        Raises
        ------
        DatasetError    for records, samples, channels and signals that do not exist, and for a
                        shard that cannot be read
        """
        if isinstance(records, int | np.integer):
            return self._signal(int(records), start, stop, channels, name)
        if isinstance(records, str):
            return self.signals([records], start, stop, channels, name=name)[0]
        numbers = record_numbers(records, self.plan.columns["record_id"], self.folder)
        n_channels = len(self.channel_names if channels is None else channels)
        last = self.n_samples if stop is None else stop
        block = np.empty((len(numbers), n_channels, max(0, last - start)), np.float32)
        for row, number in enumerate(numbers):
            block[row] = self._signal(number, start, stop, channels, name)
        return block

    def _signal(
        self,
        record_index: int,
        start: int,
        stop: int | None,
        channels: Sequence[int | str] | None,
        name: str,
    ) -> np.ndarray:
        """Acceleration of one record, (channel, sample)."""
        known = [known for known in self.signal_names if known in SCALES]
        if name not in known:
            raise unknown_name("signal", name, known, self.folder)
        shard, row, stop = self._position(record_index, start, stop)
        with self._shards.reading(shard) as file:
            block = read_signal(file, name, row, start, stop)
        if block.shape != (len(self.channel_names), stop - start):
            raise self._another_shape(shard, name)
        if channels is None:
            return block
        return block[[self._channel(channel) for channel in channels]]

    def trace(
        self, record_index: int, name: str, start: int = 0, stop: int | None = None
    ) -> np.ndarray:
        """Signal of a shaft sensor or of the mesh state of one record, as far as it is stored.

        'tacho', 'encoder_angle', 'shaft_angle', 'mesh_force', 'contact_lost' and 'fault_engaged'
        are (sample,), 'mesh_pinion_tooth', 'mesh_wheel_tooth' and 'mesh_load_share' (pair,
        sample). Those of a further mesh have the names of its gears before them.
        """
        traces = [known for known in self.signal_names if known not in SCALES]
        if name not in traces:
            raise unknown_name("trace", name, traces or ["none"], self.folder)
        shard, row, stop = self._position(record_index, start, stop)
        with self._shards.reading(shard) as file:
            values = file[name][row, ..., start:stop]
        n_axes = len(signal_column(name).axes)
        if values.shape[-1:] != (stop - start,) or values.ndim != n_axes:
            raise self._another_shape(shard, name)
        return values

    def _position(
        self, record_index: int, start: int, stop: int | None
    ) -> tuple[int, int, int]:
        """Shard and row of a record, and the stop sample.

        DatasetError for records and samples that do not exist.
        """
        if stop is None:
            stop = self.n_samples
        if not 0 <= record_index < self.n_records:
            raise DatasetError(
                f"record {record_index} does not exist; {self.folder} has 0 to {self.n_records - 1}"
            )
        if not 0 <= start < stop <= self.n_samples:
            raise DatasetError(
                f"samples {start} to {stop}; a record has 0 to {self.n_samples}"
            )
        shard = (
            int(np.searchsorted(self._shards.starts, record_index, side="right")) - 1
        )
        entry = self.manifest.shards[shard]
        if entry.state != "done":
            raise DatasetError(
                f"record {record_index} is in {entry.name}, which is not made yet"
            )
        return shard, record_index - self.first_record(shard), stop

    def where(self, **conditions: Any) -> Selection:
        """The records that meet all conditions; reads the columns named, no signal.

        Parameters
        ----------
        conditions : column=value, where a column is one of `column_names` or of the plan,
            ``params/`` may be left out, and ``fault`` means ``label_name``. A value is met by
            equality, a list by any of its values, a tuple ``(low, high)`` by numbers from low to
            high, both included, None where a side is open. Names that are no Python names go in as
            ``**{"params/x.y": (0, 1)}``.

        Raises
        ------
        DatasetError    for a column that does not exist and for text that no record has, with the
                        nearest names

        >>> data.where(fault="crack", speed_rpm=(1000, 2000), status="ok")    # doctest: +SKIP
        """
        return Selection(self, np.arange(self.n_records)).where(**conditions)

    def to_pandas(self, names: Sequence[str] | None = None) -> "DataFrame":
        """Columns as a data frame of pandas, a row a record; see `Selection.to_pandas`."""
        return self.where().to_pandas(names)

    @property
    def left_out(self) -> dict[str, str]:
        """Reasons in one line each, by name, of the known protocols that this data set lacks."""
        absent = [name for name in PROTOCOLS if name not in self.protocols]
        if not absent:
            return {}
        reasons = why_left_out(self.plan, self.manifest.seed)
        made_by = f"gensig {self.manifest.generator_version}, which made the set, did not know it"
        return {name: reasons.get(name, made_by) for name in absent}

    def split_table(self, protocol: str) -> SplitTable:
        """Table of a split as its file holds it, rows by `record_id`.

        Raises
        ------
        DatasetError    for a protocol that the set lacks, with the reason or the nearest name,
                        and for a file that is no split table
        """
        if protocol in self.protocols:
            name = f"{SPLITS}/{protocol}.csv"
            digest = self.manifest.files[name]
            return read_split(
                self.folder / name, n_records=self.n_records, sha256=digest
            )
        if protocol in PROTOCOLS:
            raise DatasetError(
                f"split {protocol!r} does not exist in {self.folder}; {self.left_out[protocol]}"
            )
        raise unknown_name("split", protocol, self.protocols, self.folder)

    def split(self, protocol: str) -> SplitRows:
        """subset -> list of (record_index, start_fraction, stop_fraction).

        Failed records are in it, see `usable`.
        """
        table = self.split_table(protocol)
        ids = self.plan.columns["record_id"].tolist()
        index = {record_id: i for i, record_id in enumerate(ids)}
        rows: SplitRows = {subset: [] for subset in SUBSETS}
        for record_id, start, stop, subset in table.rows():
            if record_id not in index:
                path = self.folder / SPLITS / f"{protocol}.csv"
                raise DatasetError(
                    f"{path} names record {record_id[:40]!r}, which the plan has not; restore it "
                    "from a copy"
                )
            rows[subset].append((index[record_id], start, stop))
        return rows

    def close(self) -> None:
        """Close the files; they open again when needed."""
        self._shards.close()

    def __enter__(self) -> "Dataset":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self.n_records

    def __getitem__(self, record_index: int) -> StoredRecord:
        return self.where()[record_index]

    def __iter__(self) -> Iterator[StoredRecord]:
        return iter(self.where())

    def __repr__(self) -> str:
        folder, n_records = str(self.folder), self.n_records
        return f"Dataset({folder!r}, {n_records} records, classes {self.class_names})"

    def _channel(self, channel: int | str) -> int:
        if channel in self.channel_names:
            return self.channel_names.index(str(channel))
        if not isinstance(channel, str) and 0 <= channel < len(self.channel_names):
            return int(channel)
        raise DatasetError(
            f"channel {channel!r} does not exist; there are {', '.join(self.channel_names)}"
        )

    def _another_shape(self, shard: int, name: str) -> DatasetError:
        reason = f"{name} has another shape than in the other shards"
        return self._shards.unreadable(shard, reason)
