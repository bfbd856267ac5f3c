"""Check of `index.h5`: the same data sets as the shards, each a virtual one over them alone."""

import math
from collections.abc import Iterator
from pathlib import Path

import h5py

from gensig.dataset.folder.layout import INDEX, SHARDS, Manifest
from gensig.dataset.storage.atomic import link_text
from gensig.dataset.storage.attributes import HDF5_ERRORS, read_attributes
from gensig.dataset.storage.compression import filters
from gensig.dataset.storage.guard import datasets, first_line, open_file, shown
from gensig.errors import DatasetError

# Sources that are looked at when a set is opened: 0.3 s on a slow processor.
QUICK_SOURCES = 10_000
# Bytes of an index beside what its sources take, and of one source with its names and stretches.
FREE_BYTES, SOURCE_BYTES = 1024**2, 1024


def quick_index_problem(folder: Path, manifest: Manifest, shard: h5py.File) -> str:
    """As `index_problem`; '' too for an index of more sources than `QUICK_SOURCES` or without one.

    Readers of gensig never read the index, so that a set which has lost it is still readable.
    """
    n_sources = len(datasets(shard, folder)) * len(manifest.shards)
    if not manifest.is_complete or n_sources > QUICK_SOURCES:
        return ""
    if not (folder / INDEX).exists():
        return ""
    return index_problem(folder, manifest, shard)


def index_problem(folder: Path, manifest: Manifest, shard: h5py.File) -> str:
    """One line on an index that is not the one over the shards of a manifest; '' for none.

    Parameters
    ----------
    folder : of the data set
    manifest : of the data set
    shard : one of its shards, checked; all have the same data sets and attributes
    """
    path = folder / INDEX
    if path.is_symlink():
        return link_text(path)
    try:
        with open_file(path) as index:
            try:
                return next(_problems(index, path, manifest, shard), "")
            except HDF5_ERRORS as error:
                return (
                    f"{path} is damaged ({first_line(error)}); restore it from a copy"
                )
    except DatasetError as error:
        return str(error)


def _problems(
    index: h5py.File, path: Path, manifest: Manifest, shard: h5py.File
) -> Iterator[str]:
    wanted = datasets(shard, path)
    most = FREE_BYTES + SOURCE_BYTES * len(wanted) * len(manifest.shards)
    if path.stat().st_size > most:
        yield f"{path} has {path.stat().st_size} bytes, {most} are the most for its shards"
    contents = datasets(index, path)
    for name in sorted(contents.keys() ^ wanted.keys()):
        state = "lacks" if name in wanted else "has besides those of the shards"
        yield f"{path} {state} the data set '{shown(name)}'"
    if read_attributes(index) != read_attributes(shard):
        yield f"{path} has other attributes than the shards"
    for name, data in wanted.items():
        label = f"{path}: data set '{shown(name)}'"
        given = contents[name]
        shape = (manifest.n_records, *data.shape[1:])
        if not given.is_virtual or given.external or filters(given):
            yield f"{label} holds or names data of its own; an index maps shards only"
        if given.shape != shape or given.dtype != data.dtype:
            yield (
                f"{label} has type {given.dtype} and shape {given.shape}; the shards have "
                f"{data.dtype} and {shape}"
            )
        yield from (
            f"{label} {line}" for line in _source_problems(name, given, manifest)
        )


def _source_problems(
    name: str, data: h5py.Dataset, manifest: Manifest
) -> Iterator[str]:
    """Lines on virtual sources that are not the shards in their order, each whole and once."""
    properties = data.id.get_create_plist()
    n_sources = properties.get_virtual_count()
    if n_sources != len(manifest.shards):
        yield f"has {n_sources} sources for {len(manifest.shards)} shards"
        return
    rest, start = data.shape[1:], 0
    for i, entry in enumerate(manifest.shards):
        source = _text(properties.get_virtual_filename(i))
        if source != f"{SHARDS}/{entry.name}":
            yield f"is mapped to '{shown(source)}'; the only file allowed there is {entry.name}"
        if _text(properties.get_virtual_dsetname(i)).lstrip("/") != name:
            yield f"is mapped to another data set of {entry.name}"
        space = properties.get_virtual_vspace(i)
        first, last = space.get_select_bounds()
        wanted = (start, *[0] * len(rest))
        end = (start + entry.rows - 1, *(length - 1 for length in rest))
        n_values = entry.rows * math.prod(rest)
        is_whole = (
            properties.get_virtual_srcspace(i).get_select_type() == h5py.h5s.SEL_ALL
        )
        is_box = space.get_select_npoints() == n_values
        if (first, last) != (wanted, end) or not (is_whole and is_box):
            yield f"has other rows of {entry.name} than the manifest says"
        start += entry.rows


def _text(name: bytes | str) -> str:
    if isinstance(name, bytes):
        return name.decode("utf-8", "replace")
    return name
