"""Checks of a data set that read no record: names, sizes, and what a shard says of itself."""

import hashlib
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from gensig.dataset.folder.layout import (
    CHECKSUMS,
    CONFIG,
    INDEX,
    MANIFEST,
    OVERRIDES,
    PLAN,
    Manifest,
    ShardEntry,
    shard_path,
)
from gensig.dataset.schema import IDENTITY, SHARD_INDEX
from gensig.dataset.storage.atomic import sha256_file
from gensig.dataset.storage.checksums import differences, read_checksums
from gensig.errors import DatasetError
from gensig.text.ordinary_file import open_ordinary

READ_AT_ONCE = 1024**2  # bytes


def check_opening(folder: Path, manifest: Manifest) -> None:
    """Check what decides which records a reader gives, as far as that reads no record.

    The manifest is compared with `SHA256SUMS` where there is one, the plan and the sizes of the
    finished shards with the manifest.

    Raises
    ------
    DatasetError    for the first difference
    """
    problem = next(_opening_problems(folder, manifest), "")
    if problem:
        raise DatasetError(f"{folder}: {problem}; run `gensig verify {folder}`")


def _opening_problems(folder: Path, manifest: Manifest) -> Iterator[str]:
    yield from unlisted_files(manifest)
    is_listed = manifest.is_complete and (folder / CHECKSUMS).is_file()
    if is_listed and read_checksums(folder).get(MANIFEST) != sha256_file(
        folder / MANIFEST
    ):
        yield f"{MANIFEST} was altered: its sha256 is not the one in {CHECKSUMS}"
    if problem := plan_problem(folder, manifest):
        yield problem
    yield from shard_sizes(folder, manifest)


def plan_problem(folder: Path, manifest: Manifest) -> str:
    """One line on a plan of another sha256 or number of records than the manifest says.

    '' for none. No count of a manifest decides what is allocated before the plan has so many rows.
    """
    digest, n_records = plan_digest(folder)
    if not digest or digest != manifest.files.get(PLAN):
        return f"{PLAN} is missing or was altered"
    return records_problem(n_records, manifest)


def records_problem(n_records: int, manifest: Manifest) -> str:
    """One line on a plan that has another number of records than the manifest; '' for none."""
    if n_records == manifest.n_records:
        return ""
    return f"{PLAN} has {n_records} records and the manifest {manifest.n_records}; one was altered"


def plan_digest(folder: Path) -> tuple[str, int]:
    """The sha256 of the plan and the number of its records; '' and 0 where there is none.

    No cell of a plan holds a line break, so that lines are records.
    """
    digest, n_lines = hashlib.sha256(), 0
    try:
        with open_ordinary(folder / PLAN, follow_links=False) as file:
            while part := file.read(READ_AT_ONCE):
                digest.update(part)
                n_lines += part.count(b"\n")
    except OSError:
        return "", 0
    return digest.hexdigest(), n_lines - 1


def unlisted_files(manifest: Manifest) -> list[str]:
    """A line for each file that every manifest lists, and this one does not."""
    needed = [CONFIG, PLAN, OVERRIDES]
    if manifest.is_complete:
        needed.append(INDEX)
    return [
        f"the manifest does not list {name}; it is damaged"
        for name in needed
        if name not in manifest.files
    ]


def shard_sizes(folder: Path, manifest: Manifest) -> list[str]:
    """A line for each finished shard that is missing, or has another size than recorded."""
    lines = [
        size_problem(shard_path(folder, index), entry)
        for index, entry in enumerate(manifest.shards)
        if entry.state == "done"
    ]
    return [line for line in lines if line]


def size_problem(path: Path, entry: ShardEntry) -> str:
    """One line on a shard that is missing or has another size than recorded; '' for none."""
    try:
        status = path.stat()
    except OSError:
        return f"{entry.name} is missing"
    if not stat.S_ISREG(status.st_mode):
        return f"{entry.name} is no ordinary file"
    size = status.st_size
    if size == entry.bytes:
        return ""
    state = "truncated" if size < entry.bytes else "not the recorded file"
    return f"{entry.name} is {state}: {size} bytes, recorded are {entry.bytes}"


def label_problem(labels: Mapping[str, Any], manifest: Manifest, index: int) -> str:
    """One line on labels that are not those of a shard of this set; '' for none.

    Shards of older sets say neither their number nor their data set.

    Parameters
    ----------
    labels : root attributes of the shard, and its number as `SHARD_INDEX`
    manifest : manifest of the data set
    index : number of the shard by its name
    """
    version = labels["schema_version"]
    if version != manifest.schema_version:
        return (
            f"has format version {version}, the manifest says {manifest.schema_version}"
        )
    identity = labels.get(IDENTITY, manifest.identity)
    if identity != manifest.identity:
        return (
            f"is of another data set: its identity is {str(identity)[:12]!a}, the manifest "
            f"says '{manifest.identity[:12]}'"
        )
    number = labels.get(SHARD_INDEX, index)
    if number != index:
        return f"is swapped: it says that it is shard {str(number)[:12]}"
    return ""


def absences(folder: Path, manifest: Manifest) -> list[str]:
    """A line for each part of a data set that is missing; no record is read.

    Shards are compared by their sizes; of a complete set the manifest is compared with
    `SHA256SUMS`, whose files must be there.
    """
    lines = [
        f"{name} is missing" for name in manifest.files if not (folder / name).is_file()
    ]
    lines += shard_sizes(folder, manifest)
    if manifest.is_complete:
        lines += [each.line for each in differences(folder, manifest, quick=True)]
    return lines
