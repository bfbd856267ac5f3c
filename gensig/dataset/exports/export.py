"""Export of a data set to one HDF5 file, Parquet, npz, wav or a folder for Hugging Face.

Few records are in memory at once.
"""

import re
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from gensig.dataset.exports.export_tables import (
    attributes_json,
    column_names,
    record_bytes,
    signal_row,
    unit_of,
    write_npz,
)
from gensig.dataset.exports.split_columns import (
    EVERY_CLEAN,
    Stretches,
    clean_protocols,
    hardest_protocol,
    is_clean,
    read_protocols,
    split_columns,
)
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.schema import known_column
from gensig.dataset.splitting.protocols import MACHINE_COLUMNS
from gensig.dataset.storage.atomic import (
    cannot_write,
    publish,
    sync_file,
    sync_folder,
    temporary_name,
)
from gensig.dataset.storage.attributes import HDF5_ERRORS, set_attribute
from gensig.dataset.storage.image import LIBRARY_VERSIONS
from gensig.errors import DatasetError
from gensig.text.csv_tables import write_rows
from gensig.text.installation import install

TEXT_BYTES = 1024  # of a text column that the schema does not know
HUGGING_FACE = "hf"
FORMATS = ("hdf5", "parquet", "npz", "wav", HUGGING_FACE)
NEED_PYARROW = ("parquet", HUGGING_FACE)

TextColumns = Mapping[str, NDArray[np.str_]]  # (record,) text by name


def export(
    folder: str | Path,
    to: str,
    out: str | Path,
    *,
    samples: bool = False,
    one_channel: bool = False,
    protocols: Sequence[str] | None = None,
) -> dict[str, int]:
    """Write a data set in another format, whole or not at all, under a new name.

    Parameters
    ----------
    folder : str | Path     a complete data set; it is left alone
    to : str                'hdf5': one shard of all records; 'parquet' or 'npz': one file; 'wav':
                            a folder with one file a record and a table labels.csv; 'hf': a folder
                            for Hugging Face with a configuration for each protocol
    out : str | Path        file or, for wav and hf, folder to make
    samples : bool          parquet: time signals too, not only the labels
    one_channel : bool      wav: one file a record and channel, instead of one a record
    protocols : sequence    splits to export, 'all' stands for every one that keeps units apart;
                            None: for hf the first of them, `new_machine` or otherwise `by_unit`,
                            for other formats all of them

    Returns
    -------
    dict    'records', 'files' and 'bytes' written

    Raises
    ------
    DatasetError    for a format, option or protocol that does not exist, a data set that is
                    incomplete or damaged, a split with a group on two sides that its protocol
                    keeps apart, a name that is taken or lies in the data set's folder, a missing
                    package, and a disk that is full

    Accelerations are float32 in m/s^2 however they are stored: nothing is lost, and int16 scales
    are left out. Every format but hf has a text column ``split/<protocol>`` for each protocol. hf
    has no record that failed or is in no subset.
    """
    folder, out = Path(folder), Path(out)
    _check_request(folder, to, out, samples=samples, one_channel=one_channel)
    with open_dataset(folder) as data:
        _check_ids(data)
        splits = _read_splits(data, to, protocols)
        n_bytes = _signal_bytes(data, to, splits, samples=samples)
        _check_space(out, n_bytes)
        temporary = temporary_name(out)
        try:
            _write(
                data, to, temporary, splits, samples=samples, one_channel=one_channel
            )
            _publish(temporary, out)
        except HDF5_ERRORS as error:
            instead = "choose another --out PATH"
            raise cannot_write(out, error, instead=instead) from error
        finally:
            if temporary.is_dir():
                shutil.rmtree(temporary, ignore_errors=True)
            with suppress(
                OSError
            ):  # a read-only disk refuses it even where there is none
                temporary.unlink(missing_ok=True)
        files = list(_files_of(out))
        return {
            "records": _n_records(data, to, splits),
            "files": len(files),
            "bytes": sum(path.stat().st_size for path in files),
        }


def _read_splits(
    data: Dataset, to: str, protocols: Sequence[str] | None
) -> dict[str, Stretches]:
    """Checked stretches of the protocols to export, by name."""
    if to != HUGGING_FACE:
        if protocols is None:
            protocols = clean_protocols(data)
        return read_protocols(data, protocols)
    if not protocols:
        protocols = [hardest_protocol(data)]
    # The first is the default of the folder, which no leaky one should be.
    in_order = sorted(
        protocols, key=lambda name: name != EVERY_CLEAN and not is_clean(name)
    )
    splits = read_protocols(data, in_order)
    if not splits:
        hardest_protocol(data)  # raises with the reason
    return {name: rows.take(data.usable[rows.record]) for name, rows in splits.items()}


def _write(
    data: Dataset,
    to: str,
    path: Path,
    splits: dict[str, Stretches],
    *,
    samples: bool,
    one_channel: bool,
) -> None:
    """Write a data set to a path that does not exist."""
    if to == HUGGING_FACE:
        from gensig.dataset.exports.hugging_face import write_hugging_face

        write_hugging_face(data, path, splits)
        return
    further = split_columns(data, splits)
    if to == "parquet":
        from gensig.dataset.exports.arrow_rows import write_parquet

        write_parquet(data, path, samples=samples, further=further)
        return
    writers: dict[str, Callable[[Dataset, Path, TextColumns], None]] = {
        "hdf5": _write_hdf5,
        "npz": write_npz,
        "wav": lambda data, path, further: _write_wav(
            data, path, further, one_channel=one_channel
        ),
    }
    writers[to](data, path, further)


def _signal_bytes(
    data: Dataset, to: str, splits: Mapping[str, Stretches], *, samples: bool
) -> int:
    """Bytes of the time signals that an export holds."""
    if to == "parquet" and not samples:
        return 0
    if to != HUGGING_FACE:
        return data.n_records * record_bytes(data)
    n_samples = sum(int((rows.stop - rows.start).sum()) for rows in splits.values())
    return n_samples * record_bytes(data) // data.n_samples


def _n_records(data: Dataset, to: str, splits: Mapping[str, Stretches]) -> int:
    """Number of records of the data set that an export holds."""
    if to != HUGGING_FACE:
        return data.n_records
    return len(np.unique(np.concatenate([rows.record for rows in splits.values()])))


def _files_of(path: Path) -> Iterable[Path]:
    """The file, or the files of a folder and of the folders below."""
    if path.is_dir():
        return (file for file in path.rglob("*") if file.is_file())
    return [path]


def _check_request(
    folder: Path, to: str, out: Path, *, samples: bool, one_channel: bool
) -> None:
    if to not in FORMATS:
        raise DatasetError(
            f"format {to!r} is unknown; allowed are {', '.join(FORMATS)}"
        )
    if (samples and to != "parquet") or (one_channel and to != "wav"):
        raise DatasetError(
            f"'samples' belongs to parquet and 'one_channel' to wav; the format asked for is {to}"
        )
    if to in NEED_PYARROW:
        _check_pyarrow(to)
    if out.exists() or out.is_symlink():
        raise DatasetError(
            f"{out} exists and is left alone; choose another name or remove it first"
        )
    if not out.parent.is_dir():
        raise DatasetError(f"{out}: there is no folder {out.parent}; make it first")
    if out.resolve().is_relative_to(folder.resolve()):
        raise DatasetError(
            f"{out} lies in the data set {folder}, which holds its own files only; choose "
            "another place"
        )


def _check_pyarrow(to: str) -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise DatasetError(
            f"format {to} needs the package pyarrow: {install('parquet')}"
        ) from error


def _check_ids(data: Dataset) -> None:
    """Raise DatasetError for rows that are not those of the plan.

    Ids of records become file names, and splits keep apart the units of the plan.
    """
    planned = data.plan.columns
    for name in ("record_id", *MACHINE_COLUMNS):
        if name in planned and not np.array_equal(data.column(name), planned[name]):
            kind = name.removesuffix("_id")
            raise DatasetError(
                f"{data.folder}: shards and plan have different {kind} ids; run `gensig verify "
                f"{data.folder}`"
            )


def _check_space(out: Path, n_bytes: int) -> None:
    """Raise DatasetError where the export cannot fit: HDF5 crashes on a full disk."""
    free = shutil.disk_usage(out.parent).free
    if n_bytes > free:
        raise DatasetError(
            f"{out} needs about {n_bytes} bytes and {free} are free; choose another disk"
        )


def _publish(temporary: Path, out: Path) -> None:
    if not temporary.is_dir():
        publish(temporary, out)
        return
    for path in temporary.rglob("*"):
        if path.is_dir():
            sync_folder(path)
        else:
            sync_file(path)
    sync_folder(temporary)
    temporary.rename(out)
    sync_folder(out.parent)


def _write_hdf5(data: Dataset, path: Path, further: TextColumns) -> None:
    """A shard of all records: what reads a shard reads this too."""
    with h5py.File(path, "w", libver=LIBRARY_VERSIONS) as file:
        for name, value in data.attributes.items():
            set_attribute(file, name, value)
        for name in column_names(data):
            if name not in further:
                _write_column(file, data, name)
        for name, texts in further.items():
            n_characters = texts.dtype.itemsize // np.dtype("U1").itemsize
            dtype = h5py.string_dtype("ascii", n_characters)
            item = file.create_dataset(name, data=texts.astype(dtype))
            set_attribute(item, "unit", "")
        for name in data.signal_names:
            first = signal_row(data, 0, name)
            shape, chunks = (data.n_records, *first.shape), (1, *first.shape)
            item = file.create_dataset(name, shape, first.dtype, chunks=chunks)
            set_attribute(item, "unit", unit_of(data, name))
            for index in range(data.n_records):
                item[index] = signal_row(data, index, name)


def _write_column(file: h5py.File, data: Dataset, name: str) -> None:
    """One column, shard by shard; text has fixed length, as in a shard."""
    column = known_column(name)
    sample = data.shard_column(0, name)
    shape, dtype = (data.n_records, *sample.shape[1:]), sample.dtype
    if dtype.kind == "U":
        is_ascii = "".join(np.unique(data.column(name))).isascii()
        encoding = "ascii" if is_ascii else "utf-8"
        n_bytes = column.n_bytes if column else TEXT_BYTES
        dtype = h5py.string_dtype(encoding, n_bytes)
    item = file.create_dataset(name, shape, dtype)
    set_attribute(item, "unit", unit_of(data, name))
    for shard, entry in enumerate(data.manifest.shards):
        values = data.shard_column(shard, name)
        start = data.first_record(shard)
        if values.dtype.kind == "U":
            values = np.char.encode(values, "utf-8").astype(item.dtype)
        item[start : start + entry.rows] = values


def _write_wav(
    data: Dataset, folder: Path, further: TextColumns, *, one_channel: bool
) -> None:
    """Float32 files in m/s^2. Values beyond 1 are right, but a player would clip them."""
    from scipy.io import wavfile

    rate = round(data.sampling_rate)
    if rate != data.sampling_rate:
        raise DatasetError(
            f"sampling rate {data.sampling_rate} Hz: a wav file holds whole hertz only; use "
            "another format"
        )
    folder.mkdir()
    names = column_names(data)
    names = [
        name
        for name in names
        if name not in further and data.shard_column(0, name).ndim == 1
    ]
    with (folder / "labels.csv").open("w", encoding="utf-8", newline="") as stream:
        write_rows(stream, [["file", *["channel"] * one_channel, *names, *further]])
        for shard, entry in enumerate(data.manifest.shards):
            first = data.first_record(shard)
            columns = [data.shard_column(shard, name).tolist() for name in names]
            for texts in further.values():
                columns.append(texts[first : first + entry.rows].tolist())
            for row, values in enumerate(zip(*columns, strict=True)):
                signal = data.signals(first + row)
                files: list[tuple[str, list[str], np.ndarray]] = [("", [], signal)]
                if one_channel:
                    files = _channels(data.channel_names, signal)
                for suffix, channel, block in files:
                    file = f"{values[names.index('record_id')]}{suffix}.wav"
                    wavfile.write(folder / file, rate, np.ascontiguousarray(block.T))
                    write_rows(stream, [[file, *channel, *values]])
    text = attributes_json(data.attributes)
    (folder / "attributes.json").write_text(text, encoding="utf-8")


def _channels(
    names: list[str], signal: np.ndarray
) -> list[tuple[str, list[str], np.ndarray]]:
    """End of the file's name, name and samples of each channel."""
    files = []
    for number, name in enumerate(names):
        plain = re.sub(r"[^A-Za-z0-9]", "_", name)[:40]
        files.append((f".{number}-{plain}", [name], signal[number]))
    return files
