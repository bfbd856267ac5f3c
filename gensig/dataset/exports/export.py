"""Export of a data set to one HDF5 file, Parquet, npz or wav, with few records in memory."""

import csv
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.exports.export_tables import (
    attributes_json,
    column_names,
    record_bytes,
    signal_row,
    unit_of,
    write_npz,
    write_parquet,
)
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.schema import known_column
from gensig.dataset.storage.atomic import (
    publish,
    sync_file,
    sync_folder,
    temporary_name,
)
from gensig.dataset.storage.attributes import HDF5_ERRORS, set_attribute
from gensig.dataset.storage.guard import first_line
from gensig.dataset.storage.image import LIBRARY_VERSIONS
from gensig.errors import DatasetError

TEXT_BYTES = 1024  # of a text column that the schema does not know
FORMATS = ("hdf5", "parquet", "npz", "wav")


def export(
    folder: str | Path,
    to: str,
    out: str | Path,
    *,
    samples: bool = False,
    one_channel: bool = False,
) -> dict[str, int]:
    """Write a data set in another format, whole or not at all, under a new name.

    Parameters
    ----------
    folder : str | Path     a complete data set; it is left alone
    to : str                'hdf5': one shard of all records; 'parquet' or 'npz': one file; 'wav':
                            a folder with one file a record and a table labels.csv
    out : str | Path        file or, for wav, folder to make
    samples : bool          parquet: time signals too, not only the labels
    one_channel : bool      wav: one file a record and channel, instead of one a record

    Returns
    -------
    dict    'records', 'files' and 'bytes' written

    Raises
    ------
    DatasetError    for a format or option that does not exist, a data set that is incomplete or
                    damaged, a name that is taken or lies in the data set's folder, and a disk that
                    is full

    Accelerations are float32 in m/s^2 however they are stored: nothing is lost, and int16 scales
    are left out.
    """
    folder, out = Path(folder), Path(out)
    _check_request(folder, to, out, samples=samples, one_channel=one_channel)
    writers: dict[str, Callable[[Dataset, Path], None]] = {
        "hdf5": _write_hdf5,
        "npz": write_npz,
        "parquet": lambda data, path: write_parquet(data, path, samples=samples),
        "wav": lambda data, path: _write_wav(data, path, one_channel=one_channel),
    }
    with open_dataset(folder) as data:
        _check_ids(data)
        if to != "parquet" or samples:
            _check_space(data, out)
        temporary = temporary_name(out)
        try:
            writers[to](data, temporary)
            _publish(temporary, out)
        except HDF5_ERRORS as error:
            reason = getattr(error, "strerror", None) or first_line(error)
            raise DatasetError(f"cannot write {out}: {reason}") from error
        finally:
            if temporary.is_dir():
                shutil.rmtree(temporary, ignore_errors=True)
            temporary.unlink(missing_ok=True)
        files = list(out.iterdir()) if out.is_dir() else [out]
        n_bytes = sum(path.stat().st_size for path in files)
        return {"records": data.n_records, "files": len(files), "bytes": n_bytes}


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


def _check_ids(data: Dataset) -> None:
    """Raise DatasetError for rows that are not those of the plan.

    Ids become file names, and only the ids of the plan were checked.
    """
    if not np.array_equal(data.column("record_id"), data.plan.columns["record_id"]):
        raise DatasetError(
            f"{data.folder}: shards and plan have different record ids; run `gensig verify "
            f"{data.folder}`"
        )


def _check_space(data: Dataset, out: Path) -> None:
    """Raise DatasetError where the export cannot fit: HDF5 crashes on a full disk."""
    n_bytes = data.n_records * record_bytes(data)
    free = shutil.disk_usage(out.parent).free
    if n_bytes > free:
        raise DatasetError(
            f"{out} needs about {n_bytes} bytes and {free} are free; choose another disk"
        )


def _publish(temporary: Path, out: Path) -> None:
    if temporary.is_dir():
        for path in temporary.iterdir():
            sync_file(path)
        sync_folder(temporary)
        temporary.rename(out)
        sync_folder(out.parent)
    else:
        publish(temporary, out)


def _write_hdf5(data: Dataset, path: Path) -> None:
    """A shard of all records: what reads a shard reads this too."""
    with h5py.File(path, "w", libver=LIBRARY_VERSIONS) as file:
        for name, value in data.attributes.items():
            set_attribute(file, name, value)
        for name in column_names(data):
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
        for name in data.signal_names:
            first = signal_row(data, 0, name)
            shape, chunks = (data.n_records, *first.shape), (1, *first.shape)
            item = file.create_dataset(name, shape, first.dtype, chunks=chunks)
            set_attribute(item, "unit", unit_of(data, name))
            for index in range(data.n_records):
                item[index] = signal_row(data, index, name)


def _write_wav(data: Dataset, folder: Path, *, one_channel: bool) -> None:
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
    names = [name for name in names if data.shard_column(0, name).ndim == 1]
    with (folder / "labels.csv").open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["file", *["channel"] * one_channel, *names])
        for shard in range(len(data.manifest.shards)):
            columns = [data.shard_column(shard, name).tolist() for name in names]
            for row, values in enumerate(zip(*columns, strict=True)):
                signal = data.signals(data.first_record(shard) + row)
                files: list[tuple[str, list[str], np.ndarray]] = [("", [], signal)]
                if one_channel:
                    files = _channels(data.channel_names, signal)
                for suffix, channel, block in files:
                    file = f"{values[names.index('record_id')]}{suffix}.wav"
                    wavfile.write(folder / file, rate, np.ascontiguousarray(block.T))
                    table.writerow([file, *channel, *values])
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
