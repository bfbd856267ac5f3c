"""HDF5 files built in memory and written in one go.

HDF5 itself crashes the process when a disk is full.
"""

import hashlib
import io
from pathlib import Path

import h5py

from gensig.dataset.storage.atomic import write_bytes

# The oldest file format h5py can write: MATLAB, Octave and old HDF5 tools read it.
LIBRARY_VERSIONS = ("earliest", "v110")


ROOM = (
    2**20
)  # bytes for what follows the time signals, so that they are not copied for it


class _Content(io.BytesIO):
    """Bytes that become longer, too, when their length is set, as those of a file do."""

    def truncate(self, size: int | None = None) -> int:
        """Set the length; new bytes are 0, and there is room for some more."""
        end = self.seek(0, io.SEEK_END)
        if size is None or size < end:
            return super().truncate(size)
        if size > end:  # else a view of the bytes may be in use
            self.write(bytes(size - end + ROOM))
            super().truncate(size)
        return size


class MemoryFile(h5py.File):  # type: ignore[misc]
    """An empty HDF5 file that exists in memory only, and is written without a copy of it."""

    def __init__(self) -> None:
        content = _Content()
        super().__init__(content, "w", libver=LIBRARY_VERSIONS)
        self._content = content

    def publish(self, path: Path) -> tuple[str, int]:
        """Write it atomically under its final name; returns sha256 and number of bytes."""
        self.flush()
        with self._content.getbuffer() as image:
            write_bytes(path, image)
            return hashlib.sha256(image).hexdigest(), len(image)
