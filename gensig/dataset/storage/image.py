"""HDF5 files built in memory and written in one go.

HDF5 itself crashes the process when a disk is full.
"""

import hashlib
import itertools
from pathlib import Path

import h5py

from gensig.dataset.storage.atomic import write_bytes

# The oldest file format h5py can write: MATLAB, Octave and old HDF5 tools read it.
LIBRARY_VERSIONS = ("earliest", "v110")
GROWTH = 4 * 1024**2

_COUNTER = itertools.count()


def memory_file() -> h5py.File:
    """An empty HDF5 file that exists in memory only."""
    # No file of this name is made; HDF5 wants distinct names for files that are open together.
    name = f"gensig-memory-{next(_COUNTER)}"
    return h5py.File(
        name,
        "w",
        driver="core",
        backing_store=False,
        block_size=GROWTH,
        libver=LIBRARY_VERSIONS,
    )


def publish_image(file: h5py.File, path: Path) -> tuple[str, int]:
    """Write a memory file atomically under its final name; returns sha256 and number of bytes."""
    file.flush()
    image = file.id.get_file_image()
    write_bytes(path, image)
    return hashlib.sha256(image).hexdigest(), len(image)
