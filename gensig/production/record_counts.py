"""Progress of the shards at work, told from process to process."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NUMBER = np.dtype(np.float64)
# columns of a shard: records made; when its first record was begun, 0 before; 1 while its worker
# compiles; seconds that it has compiled
MADE, BEGUN, COMPILING, COMPILED = range(4)
N_COLUMNS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordCounts:
    """A small file of numbers: what every shard at work has made, and how long it compiled.

    Times are those of ``time.monotonic``, which the processes of a computer share. A worker that
    does not see the file, as on another computer, tells nothing.
    """

    path: Path
    n_shards: int

    def begin(self, shard: int) -> None:
        """Tell that the first record of a shard begins to be made."""
        self._write(shard, COMPILING, 0.0)
        self._write(shard, BEGUN, time.monotonic())

    def set(self, shard: int, n_records: int) -> None:
        """Tell how many records of a shard are made; 0 once the shard is whole."""
        self._write(shard, MADE, n_records)

    def compiling(self, shard: int) -> None:
        """Tell that the worker of a shard compiles; its records are not begun."""
        self._write(shard, COMPILING, 1.0)
        if not self._read()[shard, MADE]:
            self._write(shard, BEGUN, 0.0)

    def compiled(self, shard: int, seconds: float) -> None:
        """Tell that the worker goes on, and the seconds that it has compiled for the shard."""
        self._write(shard, COMPILED, seconds)
        self._write(shard, COMPILING, 0.0)
        if not self._read()[shard, MADE]:
            self._write(shard, BEGUN, time.monotonic())

    @property
    def n_made(self) -> int:
        """Records of all shards at work."""
        return int(self._read()[:, MADE].sum())

    @property
    def begun(self) -> float | None:
        """Time at which the first record of the run began to be made; None before."""
        times = self._read()[:, BEGUN]
        if not times.any():
            return None
        return float(times[times > 0.0].min())

    @property
    def is_compiling(self) -> bool:
        """True while a worker compiles."""
        return bool(self._read()[:, COMPILING].any())

    @property
    def compile_seconds(self) -> float:
        """Seconds that the slowest worker has compiled; workers compile at the same time."""
        return float(self._read()[:, COMPILED].max(initial=0.0))

    def _read(self) -> np.ndarray:
        """(shard, column)"""
        numbers = np.zeros((self.n_shards, N_COLUMNS), NUMBER)
        with suppress(OSError):
            content = np.fromfile(self.path, NUMBER, numbers.size)
            numbers.flat[: content.size] = content
        return numbers

    def _write(self, shard: int, column: int, value: float) -> None:
        with suppress(OSError):
            file = os.open(self.path, os.O_WRONLY)
            try:
                place = (shard * N_COLUMNS + column) * NUMBER.itemsize
                os.pwrite(file, np.array([value], NUMBER).tobytes(), place)
            finally:
                os.close(file)


@contextmanager
def record_counts(n_shards: int) -> Iterator[RecordCounts]:
    """Counts of a run on so many shards; the file is removed with the block."""
    with tempfile.TemporaryDirectory(prefix="gensig-") as folder:
        path = Path(folder) / "records"
        path.write_bytes(bytes(n_shards * N_COLUMNS * NUMBER.itemsize))
        yield RecordCounts(path=path, n_shards=n_shards)
