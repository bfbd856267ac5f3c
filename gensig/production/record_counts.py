"""Records that the shards at work have made so far, told from process to process."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NUMBER = np.dtype(np.int32)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordCounts:
    """A small file of numbers: records of every shard at work, and whether a worker compiles.

    A worker that does not see the file, as on another computer, tells nothing.
    """

    path: Path
    n_shards: int

    def set(self, shard: int, n_records: int) -> None:
        """Tell how many records of a shard are made; 0 once the shard is whole."""
        self._write(shard, n_records)

    def compiling(self) -> None:
        """Tell that a worker compiles the kernels."""
        self._write(self.n_shards, 1)

    @property
    def n_made(self) -> int:
        """Records of all shards at work."""
        return int(self._read()[: self.n_shards].sum())

    @property
    def is_compiling(self) -> bool:
        """True from the first compilation on."""
        return bool(self._read()[self.n_shards])

    def _read(self) -> np.ndarray:
        return np.fromfile(self.path, NUMBER, self.n_shards + 1)

    def _write(self, place: int, value: int) -> None:
        with suppress(OSError):
            file = os.open(self.path, os.O_WRONLY)
            try:
                content = np.array([value], NUMBER).tobytes()
                os.pwrite(file, content, place * NUMBER.itemsize)
            finally:
                os.close(file)


@contextmanager
def record_counts(n_shards: int) -> Iterator[RecordCounts]:
    """Counts of a run on so many shards; the file is removed with the block."""
    with tempfile.TemporaryDirectory(prefix="gensig-") as folder:
        path = Path(folder) / "records"
        path.write_bytes(bytes((n_shards + 1) * NUMBER.itemsize))
        yield RecordCounts(path=path, n_shards=n_shards)
