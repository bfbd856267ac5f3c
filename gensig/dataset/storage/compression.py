"""Compression of the time signals, Blosc2 included, which is no part of HDF5."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import h5py

from gensig.errors import DatasetError
from gensig.text.installation import install

COMPRESSIONS = ("none", "gzip", "lzf", "blosc2")

BLOSC2_FILTER = 32026
# Blosc2 stores a constant chunk in some 260 bytes, so that the size of a chunk says nothing about
# what is stored.
BLOSC2_CHUNK_LIMIT = 256 * 1024**2
# what one record, or a whole column, may take after decompression
COMPRESSED_LIMIT = 512 * 1024**2

_NAMES = {
    h5py.h5z.FILTER_DEFLATE: "gzip",
    h5py.h5z.FILTER_LZF: "lzf",
    BLOSC2_FILTER: "blosc2",
}


def creation_options(compression: str) -> dict[str, Any]:
    """Arguments of h5py's `create_dataset` for one of `COMPRESSIONS`.

    Raises
    ------
    DatasetError    for 'blosc2' where the package hdf5plugin is not installed
    """
    if compression == "none":
        return {}
    if compression == "blosc2":
        plugin = load_blosc2("dataset.compression=blosc2")
        shuffle = plugin.Blosc2.BITSHUFFLE
        return dict(plugin.Blosc2(cname="lz4", clevel=5, filters=shuffle))
    return {"compression": compression, "shuffle": True}


def load_blosc2(what: str) -> ModuleType:
    """The package hdf5plugin, whose import makes HDF5 know Blosc2.

    DatasetError says that `what` needs it.
    """
    try:
        import hdf5plugin
    except ImportError as error:
        raise DatasetError(
            f"{what} needs the package hdf5plugin, which is an extra: {install('blosc2')}"
        ) from error
    return hdf5plugin


@contextmanager
def fixed_settings() -> Iterator[None]:
    """Hide the environment variables BLOSC_*.

    Blosc2 obeys them before its arguments, and they change the bytes.
    """
    names = [name for name in os.environ if name.startswith("BLOSC_")]
    hidden = {name: os.environ.pop(name) for name in names}
    try:
        yield
    finally:
        os.environ.update(hidden)


def filters(data: h5py.Dataset) -> set[int]:
    """Numbers of the HDF5 filters that a data set is stored with."""
    properties = data.id.get_create_plist()
    return {properties.get_filter(i)[0] for i in range(properties.get_nfilters())}


def compression_of(data: h5py.Dataset) -> str:
    """Compression of a data set of a checked shard, one of `COMPRESSIONS`."""
    names = [_NAMES[number] for number in filters(data) if number in _NAMES]
    return (*names, "none")[0]
