"""index.h5: all shards seen as one file, through HDF5 virtual data sets with relative paths."""

from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.folder.layout import (
    INDEX,
    SHARDS,
    Manifest,
    read_manifest,
    shard_path,
)
from gensig.dataset.storage.attributes import (
    HDF5_ERRORS,
    read_attributes,
    set_attribute,
)
from gensig.dataset.storage.guard import datasets, first_line, open_file, open_shard
from gensig.dataset.storage.image import memory_file, publish_image
from gensig.errors import DatasetError


def write_index(folder: Path, manifest: Manifest) -> str:
    """Write `index.h5` over all shards of the manifest and return its sha256.

    Rows stand in plan order. Where a shard is missing a reader finds NaN in floating-point data
    sets (scales among them), -1 in integer ones and '' in text. The bytes depend on the shards'
    names and shapes only, not on time or place.
    """
    path = folder / INDEX
    with (
        open_shard(shard_path(folder, 0), folder=folder) as first,
        memory_file() as index,
    ):
        for name, value in read_attributes(first).items():
            set_attribute(index, name, value)
        for name, data in datasets(first, path).items():
            _map(index, name, data, manifest)
        return publish_image(index, path)[0]


def _map(index: h5py.File, name: str, data: h5py.Dataset, manifest: Manifest) -> None:
    """One virtual data set.

    Made at the low level, because h5py's own way stores the time of day.
    """
    row_shape = data.shape[1:]
    space = h5py.h5s.create_simple((manifest.n_records, *row_shape))
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.VIRTUAL)
    properties.set_obj_track_times(False)
    kind = data.dtype.kind
    if kind in "fi":
        properties.set_fill_value(
            np.array(np.nan if kind == "f" else -1, dtype=data.dtype)
        )
    start = 0
    for entry in manifest.shards:
        shape = (entry.rows, *row_shape)
        space.select_hyperslab((start, *(0 for _ in row_shape)), shape)
        source = h5py.h5s.create_simple(shape)
        properties.set_virtual(
            space, f"{SHARDS}/{entry.name}".encode(), name.encode(), source
        )
        start += entry.rows
    space.select_all()
    parent = index
    if "/" in name:
        parent = index.require_group(name.rpartition("/")[0])
    leaf = name.rpartition("/")[2]
    identifier = h5py.h5d.create(
        parent.id, leaf.encode(), data.id.get_type(), space, dcpl=properties
    )
    notes = read_attributes(data)
    for note in ("unit", "scale"):
        if isinstance(notes.get(note), str):
            set_attribute(h5py.Dataset(identifier), note, notes[note])


def open_index(folder: Path) -> h5py.File:
    """`index.h5`, open for reading once it is known to show the folder's own shards and nothing
    else.

    Raises
    ------
    DatasetError    when it is missing or damaged, or a data set of it is no view of all shards in
                    the manifest's order
    """
    path = Path(folder) / INDEX
    manifest = read_manifest(folder)
    if not path.resolve().is_relative_to(Path(folder).resolve()):
        raise DatasetError(
            f"{path} is a link that leads out of {folder}; put the file itself there"
        )
    file = open_file(path)
    try:
        for name, data in datasets(file, path).items():
            _check_view(data, name, manifest, path)
    except HDF5_ERRORS as error:
        file.close()
        raise DatasetError(
            f"{path} is damaged ({first_line(error)}); restore it from a copy"
        ) from error
    except BaseException:
        file.close()
        raise
    return file


def _check_view(data: h5py.Dataset, name: str, manifest: Manifest, path: Path) -> None:
    expected = [(f"{SHARDS}/{entry.name}", name) for entry in manifest.shards]
    found = (
        [
            (str(source.file_name), str(source.dset_name))
            for source in data.virtual_sources()
        ]
        if data.is_virtual
        else []
    )
    if (
        found != expected
        or data.dtype.kind not in "Siuf"
        or data.shape[:1] != (manifest.n_records,)
    ):
        shown = "".join(c if c.isprintable() else "?" for c in name)[:80]
        raise DatasetError(
            f"{path}: '{shown}' does not show the shards of this folder; restore it from a copy"
        )
