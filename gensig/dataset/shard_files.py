"""Open shards of a data set, each checked before a record is read from it."""

import os
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gensig.dataset.folder.layout import PLAN, Manifest, shard_path
from gensig.dataset.folder.quick_check import label_problem, size_problem
from gensig.dataset.plan import PlanRows
from gensig.dataset.schema import IDENTITY
from gensig.dataset.storage.attributes import HDF5_ERRORS, decoded
from gensig.dataset.storage.guard import (
    first_line,
    open_file,
    open_shard,
    same_file,
    shard_labels,
)
from gensig.errors import DatasetError

MAX_OPEN_SHARDS = 64


class ShardFiles:
    """Open shards of a data set; can be pickled and forked.

    At most `MAX_OPEN_SHARDS` stay open, and none is shared with another process.

    Parameters
    ----------
    folder : Path
    manifest : Manifest
    """

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self.folder = folder
        self.manifest = manifest
        self.starts = np.cumsum([0, *manifest.shard_sizes])
        self._plan: PlanRows | None = None
        self._labelled: bool | None = None
        self._files: OrderedDict[int, h5py.File] = OrderedDict()
        self._checked: dict[int, tuple[int, ...]] = {}
        self._pid = os.getpid()

    def open(self, shard: int) -> h5py.File:
        """The open file of a finished shard.

        One that was checked and has not changed since is not checked again.

        Raises
        ------
        DatasetError    for a shard that is missing or damaged, has another size, number of rows,
                        format version, number or identity than the manifest says, or does not
                        begin with the record that the plan says
        """
        if self._pid != os.getpid():
            self._files, self._pid = OrderedDict(), os.getpid()
        if shard in self._files:
            self._files.move_to_end(shard)
            return self._files[shard]
        file = self._opened(shard_path(self.folder, shard), shard)
        self._files[shard] = file
        if len(self._files) > MAX_OPEN_SHARDS:
            self._files.popitem(last=False)[1].close()
        return file

    @contextmanager
    def reading(self, shard: int) -> Iterator[h5py.File]:
        """The file as `open` gives it; what HDF5 raises in the block names the shard."""
        try:
            yield self.open(shard)
        except HDF5_ERRORS as error:
            raise self.unreadable(shard, first_line(error)) from error

    def _opened(self, path: Path, shard: int) -> h5py.File:
        if shard in self._checked and self._checked[shard] == same_file(path):
            return open_file(path)
        before = same_file(path)
        if problem := size_problem(path, self.manifest.shards[shard]):
            raise self.unreadable(shard, problem)
        file = open_shard(path, folder=self.folder)
        try:
            problem = self._problem(file, shard)
        except HDF5_ERRORS as error:
            problem = first_line(error)
        except BaseException:
            file.close()
            raise
        if problem:
            file.close()
            raise self.unreadable(shard, problem)
        if before == same_file(path):
            self._checked[shard] = before
        return file

    def _problem(self, file: h5py.File, shard: int) -> str:
        """The reason why a shard is not the one of the manifest and the plan; '' for none."""
        labels = shard_labels(file)
        if problem := label_problem(labels, self.manifest, shard):
            return f"it {problem}"
        labelled = IDENTITY in labels
        if self._labelled not in (None, labelled):
            return "it was made by another version than the other shards"
        self._labelled = labelled
        if file["record_id"].shape[0] != self.manifest.shards[shard].rows:
            return "another number of rows than the manifest says"
        stored = str(decoded(file["record_id"][:1])[0])
        planned = self._first_planned(shard)
        if stored != planned:
            return (
                f"its first record is {stored[:40]!a}, the plan says {planned[:40]!a}"
            )
        return ""

    def _first_planned(self, shard: int) -> str:
        """Id of the record that a shard begins with, by the plan."""
        if self._plan is None:
            self._plan = PlanRows(self.folder / PLAN)
        (record,) = self._plan.records(int(self.starts[shard]), 1)
        return str(record.get("record_id", ""))

    def unreadable(self, shard: int, reason: str) -> DatasetError:
        """Error of one line on a shard that cannot be read."""
        return DatasetError(
            f"{shard_path(self.folder, shard)} cannot be read ({reason}); run `gensig verify "
            f"{self.folder}`"
        )

    def close(self) -> None:
        """Close the files; they open again when needed."""
        files, self._files = self._files, OrderedDict()
        if self._pid == os.getpid():
            for file in files.values():
                file.close()

    def __getstate__(self) -> dict[str, Any]:
        # another process checks for itself: that is also what makes HDF5 know the filters there
        return {**self.__dict__, "_files": OrderedDict(), "_checked": {}}
