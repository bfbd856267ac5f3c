"""Files of recordings: tables, WAV, numpy, HDF5 and MATLAB.

Numbers only: nothing is unpickled, no link is followed, and no header is believed. Each reader
runs in a process of its own, see `gensig.signals.reading.reader_process`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.signals.reading.promised_sizes import (
    check_decoded,
    check_held,
    check_mat,
    check_mat_elements,
    check_npy,
    check_wav,
)
from gensig.text.user_file import read_table

ARRAY_KEY = "acceleration"
RATE_KEY = "sampling_rate_hz"
LEAST_SAMPLES = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Content:
    """Content of a file.

    Attributes
    ----------
    values : (channel, sample)
    sampling_rate : Hz    None where the file does not tell
    rate_from : its source, in words
    has_level : False for samples of whole numbers without a unit
    names : of the columns of a table; None for other files
    """

    values: Array
    sampling_rate: float | None
    rate_from: str = RATE_KEY
    has_level: bool = True
    names: tuple[str, ...] | None = None


def read_csv(file: str, array: str | None) -> Content:
    """Columns of a table, the time among them."""
    _no_array_name(file, array)
    names, values = read_table("recording", file, least_rows=LEAST_SAMPLES)
    check_decoded(file, values.size)
    return Content(values=values, sampling_rate=None, names=tuple(names))


def read_wav(file: str, array: str | None) -> Content:
    """Samples and rate of a WAV file; whole numbers have no level in m/s2."""
    from scipy.io import wavfile

    _no_array_name(file, array)
    with _one_line(file, "it is no WAV file"), warnings.catch_warnings():
        # chunks that are no samples
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        check_wav(file)
        rate, samples = wavfile.read(Path(file).expanduser())
    rows = np.atleast_2d(np.asarray(samples).T).astype(np.float64)
    return Content(
        values=rows,
        sampling_rate=float(rate),
        rate_from="its header",
        has_level=samples.dtype.kind == "f",
    )


def read_npy(file: str, array: str | None) -> Content:
    """The array of a .npy file."""
    _no_array_name(file, array)
    with _one_line(file, "it is no plain array of numbers of numpy"):
        path = Path(file).expanduser()
        with path.open("rb") as stream:
            check_npy(file, stream, path.stat().st_size)
        content = np.load(path, allow_pickle=False)
    return Content(values=_rows(file, content), sampling_rate=None)


def read_npz(file: str, array: str | None) -> Content:
    """One array of a .npz file, with its rate where the file has one."""
    with _one_line(file, "it is no plain array of numbers of numpy"):
        content = np.load(Path(file).expanduser(), allow_pickle=False)
        if not isinstance(content, np.lib.npyio.NpzFile):
            raise ValueError
        with content:
            name = _chosen(file, array, content.files)
            for key in (name, RATE_KEY):
                _check_member(file, content, key)
            values, rate = content[name], content.get(RATE_KEY)
    return Content(values=_rows(file, values), sampling_rate=_rate(file, rate))


def read_hdf5(file: str, array: str | None, *, from_matlab: bool = False) -> Content:
    """One array of an HDF5 file.

    The rate may be an array or an attribute of the file or of the array.
    """
    import h5py

    with (
        _one_line(file, "it is no HDF5 file"),
        h5py.File(Path(file).expanduser(), "r") as content,
    ):
        arrays: dict[str, Any] = {}

        def keep(name: str, item: Any) -> None:
            if _is_plain(item):
                arrays[name] = item

        # visits the items of the file alone: neither soft nor external links
        content.visititems(keep)
        chosen = arrays[_chosen(file, array, arrays)]
        _check_stored(file, chosen)
        values = chosen[()]
        rates: list[Mapping[str, Any]] = [chosen.attrs, content.attrs]
        rate = next((group[RATE_KEY] for group in rates if RATE_KEY in group), None)
        if rate is None and RATE_KEY in arrays:
            _check_stored(file, arrays[RATE_KEY])
            rate = arrays[RATE_KEY][()]
    return Content(
        values=_rows(file, values, from_matlab=from_matlab),
        sampling_rate=_rate(file, rate),
    )


def read_mat(file: str, array: str | None) -> Content:
    """One array of a MATLAB file, samples along its longer side.

    Versions 4, 5 and 7 are read by scipy, 7.3 is HDF5.
    """
    import h5py
    from scipy import io

    path = Path(file).expanduser()
    if h5py.is_hdf5(path):
        return read_hdf5(file, array, from_matlab=True)
    with _one_line(file, "it is no MATLAB file"):
        check_mat_elements(file)
        shapes = {row[0]: row[1] for row in io.whosmat(path)}
        name = _chosen(file, array, list(shapes))
        check_mat(file, shapes, name, RATE_KEY)
        content = io.loadmat(path, variable_names=[name, RATE_KEY])
    return Content(
        values=_rows(file, content[name], from_matlab=True),
        sampling_rate=_rate(file, content.get(RATE_KEY)),
    )


@contextmanager
def _one_line(file: str, what: str) -> Iterator[None]:
    """Turn what a reader raises on a damaged file into one line; a ConfigError passes."""
    try:
        yield
    except (ConfigError, MemoryError):
        raise
    except OSError as error:
        reason = what
        if error.errno and error.strerror:
            reason = error.strerror
        raise ConfigError(f"{file} cannot be read: {reason}") from None
    # the parsers of scipy and h5py raise nearly any on bytes that were made to mislead them
    except Exception:
        raise ConfigError(f"{file} cannot be read: {what}") from None


def _check_member(file: str, content: np.lib.npyio.NpzFile, key: str) -> None:
    """Check the size that an array of a .npz file promises, where it has this array."""
    archive = content.zip
    assert archive is not None
    names = archive.namelist()
    member = f"{key}.npy"
    if member not in names:
        member = key
    if member not in names:
        return
    with archive.open(member) as stream:
        check_npy(file, stream, archive.getinfo(member).file_size, key)


def _check_stored(file: str, dataset: Any) -> None:
    """Check the size that an array of an HDF5 file promises, and that of its chunks."""
    check_decoded(file, dataset.size, dataset.name)
    if dataset.chunks is not None:
        check_decoded(file, math.prod(dataset.chunks), f"a chunk of {dataset.name}")
    begin = dataset.id.get_offset()
    if begin is not None:
        n_bytes = Path(file).expanduser().stat().st_size
        check_held(file, dataset.size * dataset.dtype.itemsize, n_bytes - begin)


def _is_plain(item: Any) -> bool:
    """A data set whose numbers lie in the file itself."""
    import h5py

    return (
        isinstance(item, h5py.Dataset)
        and item.dtype.kind in "fiu"
        and not item.is_virtual
        and not item.external
    )


def _chosen(file: str, array: str | None, names: Any) -> str:
    wanted = array or ARRAY_KEY
    if wanted not in names:
        has = ", ".join(sorted(names)[:12]) or "nothing"
        hint = ""
        if array is None and names:
            hint = "; name one with --array"
        raise ConfigError(f"{file}: no array {wanted}; it has {has}{hint}")
    return wanted


def _no_array_name(file: str, array: str | None) -> None:
    if array is not None:
        raise ConfigError(
            f"{file}: --array is for .npz, .h5, .hdf5 and .mat; leave it out"
        )


def _rows(file: str, content: Any, *, from_matlab: bool = False) -> Array:
    """(channel, sample) of an array; those of MATLAB may stand either way."""
    is_array = isinstance(content, np.ndarray) and content.dtype.kind in "fiu"
    if not is_array or content.ndim not in (1, 2):
        raise ConfigError(
            f"{file}: give one array of real numbers, (sample,) or (sensor, sample)"
        )
    rows = np.atleast_2d(content).astype(np.float64)
    if rows.shape[0] > rows.shape[1]:
        if not from_matlab:
            raise ConfigError(
                f"{file} has the shape {content.shape}; give (sensor, sample): transpose it"
            )
        rows = np.ascontiguousarray(rows.T)
    return rows


def _rate(file: str, content: Any) -> float | None:
    """Rate as one number, also from an array of one value."""
    if content is None:
        return None
    numbers = np.asarray(content)
    if numbers.dtype.kind not in "fiu" or numbers.size != 1:
        raise ConfigError(f"{file}: {RATE_KEY} must be one number")
    return float(numbers.ravel()[0])
