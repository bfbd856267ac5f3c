"""Receipts of finished shards, which wait beside them for their entry in the manifest.

Processes that may not see each other, such as the tasks of an array job, write separate shards and
receipts, and so never share a file. One process enters the receipts in the manifest. A shard whose
writer was killed before its receipt is made again.
"""

import json
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from gensig.dataset.folder.layout import (
    ShardEntry,
    read_manifest,
    shard_entry,
    shard_name,
    shard_path,
)
from gensig.dataset.folder.manifest import RECEIPT_SUFFIX, record_shards
from gensig.dataset.storage.atomic import read_text, write_text
from gensig.errors import DatasetError

RECEIPT_BYTES_LIMIT = 4096


def receipt_path(folder: Path, shard_index: int) -> Path:
    """Path of a shard's receipt: hidden, beside the shard."""
    path = shard_path(folder, shard_index)
    return path.with_name(f".{path.name}{RECEIPT_SUFFIX}")


def write_receipt(
    folder: Path,
    shard_index: int,
    *,
    rows: int,
    sha256: str,
    n_bytes: int,
    n_failed: int,
) -> None:
    """Write the receipt of a shard that is whole under its final name."""
    entry = ShardEntry(
        name=shard_name(shard_index),
        rows=rows,
        state="done",
        sha256=sha256,
        bytes=n_bytes,
        n_failed=n_failed,
    )
    write_text(receipt_path(folder, shard_index), json.dumps(asdict(entry)) + "\n")


def read_receipt(folder: Path, shard_index: int) -> ShardEntry | None:
    """Entry of a shard by its receipt; None without one, or for a shard of another size."""
    path, shard = receipt_path(folder, shard_index), shard_path(folder, shard_index)
    if not path.is_file():
        return None
    try:
        entry = shard_entry(
            shard_index, json.loads(read_text(path, limit=RECEIPT_BYTES_LIMIT))
        )
    except (DatasetError, ValueError, RecursionError):
        return None  # damaged: the shard is made again
    if entry.state != "done" or not shard.is_file():
        return None
    return entry if shard.stat().st_size == entry.bytes else None


def collect_receipts(folder: Path) -> int:
    """Enter every shard that has a receipt in the manifest; returns how many there were."""
    manifest = read_manifest(folder)
    entries = {}
    for index, planned in enumerate(manifest.shards):
        if planned.state != "done":
            entry = read_receipt(folder, index)
            if entry is not None and entry.rows == planned.rows:
                entries[index] = entry
    if entries:
        record_shards(folder, entries)
    if not manifest.is_complete:
        for index in range(len(manifest.shards)):
            with suppress(FileNotFoundError):
                receipt_path(folder, index).unlink()
    return len(entries)
