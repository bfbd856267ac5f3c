"""index.h5: all shards as one file, through HDF5 virtual data sets with relative paths."""

from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.folder.layout import (
    INDEX,
    SHARDS,
    Manifest,
    shard_path,
)
from gensig.dataset.storage.attributes import (
    read_attributes,
    set_attribute,
)
from gensig.dataset.storage.guard import datasets, open_shard
from gensig.dataset.storage.image import MemoryFile


def write_index(folder: Path, manifest: Manifest) -> str:
    """Write `index.h5` over all shards of the manifest and return its sha256.

    Rows stand in plan order. Where a shard is missing a reader finds NaN in floating-point data
    sets (scales among them), -1 in integer ones and '' in text. The bytes depend on the shards'
    names and shapes only, not on time or place.
    """
    path = folder / INDEX
    with (
        open_shard(shard_path(folder, 0), folder=folder) as first,
        MemoryFile() as index,
    ):
        for name, value in read_attributes(first).items():
            set_attribute(index, name, value)
        for name, data in datasets(first, path).items():
            _map(index, name, data, manifest)
        return index.publish(path)[0]


def _map(index: h5py.File, name: str, data: h5py.Dataset, manifest: Manifest) -> None:
    """Add one virtual data set, at the low level because `create_virtual_dataset` stores times."""
    row_shape = data.shape[1:]
    space = h5py.h5s.create_simple((manifest.n_records, *row_shape))
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.VIRTUAL)
    properties.set_obj_track_times(False)
    missing = {"f": np.nan, "i": -1}.get(data.dtype.kind)
    if missing is not None:
        properties.set_fill_value(np.array(missing, dtype=data.dtype))
    start = 0
    for entry in manifest.shards:
        shape = (entry.rows, *row_shape)
        space.select_hyperslab((start, *[0] * len(row_shape)), shape)
        source = h5py.h5s.create_simple(shape)
        properties.set_virtual(
            space, f"{SHARDS}/{entry.name}".encode(), name.encode(), source
        )
        start += entry.rows
    space.select_all()
    group, _, leaf = name.rpartition("/")
    parent = index.require_group(f"/{group}")
    identifier = h5py.h5d.create(
        parent.id, leaf.encode(), data.id.get_type(), space, dcpl=properties
    )
    notes = read_attributes(data)
    for note in ("unit", "scale"):
        if isinstance(notes.get(note), str):
            set_attribute(h5py.Dataset(identifier), note, notes[note])
