"""Receipts of finished shards, which wait beside them for their entry in the manifest.

Processes that may not see each other, such as the tasks of an array job, write separate shards and
receipts, and so never share a file. One process enters the receipts in the manifest; closing
removes them. A shard whose writer was killed before its receipt is made again.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from gensig.dataset.folder.layout import (
    Manifest,
    ShardEntry,
    read_manifest,
    shard_entry,
    shard_path,
)
from gensig.dataset.folder.manifest import record_shards
from gensig.dataset.folder.quick_check import size_problem
from gensig.dataset.storage.atomic import read_text, write_text
from gensig.errors import DatasetError

RECEIPT_SUFFIX = ".done"
RECEIPT_BYTES_LIMIT = 4096


def receipt_path(folder: Path, shard_index: int) -> Path:
    """Path of a shard's receipt: hidden, beside the shard."""
    path = shard_path(folder, shard_index)
    return path.with_name(f".{path.name}{RECEIPT_SUFFIX}")


def write_receipt(folder: Path, shard_index: int, entry: ShardEntry) -> None:
    """Write the receipt of a shard that is whole under its final name."""
    write_text(receipt_path(folder, shard_index), json.dumps(asdict(entry)) + "\n")


def shard_entries(
    folder: Path, manifest: Manifest, indices: Iterable[int]
) -> dict[int, ShardEntry]:
    """Entries of shards by the manifest, and by their receipts where it has none."""
    return {index: _entry(folder, index, manifest.shards[index]) for index in indices}


def _entry(folder: Path, index: int, planned: ShardEntry) -> ShardEntry:
    """Entry of one shard; a receipt that does not fit its shard counts for nothing."""
    path = receipt_path(folder, index)
    if planned.state == "done" or not path.is_file():
        return planned
    try:
        text = read_text(path, limit=RECEIPT_BYTES_LIMIT)
        entry = shard_entry(index, json.loads(text))
    except (DatasetError, ValueError, RecursionError):
        return planned  # damaged: the shard is made again
    fits = (entry.state, entry.rows) == ("done", planned.rows)
    if not fits or size_problem(shard_path(folder, index), entry):
        return planned
    return entry


def collect_receipts(folder: Path) -> None:
    """Enter every shard that has a receipt in the manifest."""
    manifest = read_manifest(folder)
    entries = shard_entries(folder, manifest, range(len(manifest.shards)))
    received = {
        index: entry
        for index, entry in entries.items()
        if entry != manifest.shards[index]
    }
    if received:
        record_shards(folder, received)
