"""Checks at the end of a run: what it claims to have made is there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from gensig.dataset.folder.layout import (
    MANIFEST,
    PLAN,
    SPLITS,
    Manifest,
    ShardEntry,
    read_manifest,
    shard_path,
)
from gensig.dataset.folder.manifest import file_digests, record_shards
from gensig.dataset.folder.quick_check import absences, size_problem
from gensig.dataset.storage.atomic import REMEDIES, cannot_write, sha256_file
from gensig.dataset.storage.receipts import receipt_path, shard_entries
from gensig.errors import DatasetError, WriteError


@contextmanager
def folder_kept(out: Path) -> Iterator[None]:
    """Name the folder or the manifest where an error comes from their being gone.

    Where the disk refuses to write, say how the run goes on.
    """
    try:
        yield
    except (DatasetError, OSError) as error:
        for path in (out, out / MANIFEST):
            if not path.exists():
                raise DatasetError(
                    f"{path} was deleted or renamed while the run was going on; put it back and "
                    f"run `gensig resume {out}`, or begin another folder"
                ) from error
        if not isinstance(error, WriteError):
            if not isinstance(error, OSError) or error.errno not in REMEDIES:
                raise
            error = cannot_write(Path(error.filename or out), error)
        raise WriteError(f"{error}; then `gensig resume {out}` goes on") from error


def lost_shards(
    out: Path, indices: Sequence[int], made: Mapping[int, str]
) -> list[str]:
    """A line for each shard that is not as it was made; the next run makes it again.

    Parameters
    ----------
    out : folder of a data set
    indices : shards that must be there, with the size that was recorded
    made : sha256 of those that this run wrote, which are read and compared
    """
    manifest, lines = read_manifest(out), []
    for index, entry in shard_entries(out, manifest, indices).items():
        problem = _shard_problem(shard_path(out, index), entry, made.get(index))
        if not problem:
            continue
        lines.append(f"shard {index}: {problem}; it changed while the run was going on")
        receipt_path(out, index).unlink(missing_ok=True)
        if not manifest.is_complete and manifest.shards[index].state == "done":
            record_shards(out, {index: entry.failed()})
    return lines


def _shard_problem(path: Path, entry: ShardEntry, sha256: str | None) -> str:
    if entry.state != "done":
        return f"{entry.name} or its receipt is missing"
    if problem := size_problem(path, entry):
        return problem
    if sha256 is None or sha256 == entry.sha256 == sha256_file(path):
        return ""
    return f"{entry.name} has other bytes than were written"


def require_tables(out: Path, manifest: Manifest) -> None:
    """Raise DatasetError for the first file beside the shards that is not as it was written."""
    for name, recorded, actual in file_digests(out, manifest):
        if actual == recorded:
            continue
        state = "was altered" if actual else "is missing"
        remedy = "restore it from a copy"
        if name == PLAN or name.startswith(f"{SPLITS}/"):
            remedy = f"without it `gensig resume {out}` makes it again"
        raise DatasetError(f"{out / name} {state}; {remedy}")


def require_whole(out: Path) -> None:
    """Raise DatasetError where a complete data set lacks anything that it lists."""
    lines = absences(out, read_manifest(out))
    if lines:
        raise DatasetError(f"{out}: {lines[0]}")
