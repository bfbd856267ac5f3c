"""Reasons of failed records of a data set."""

import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from gensig.dataset.folder.layout import read_manifest, shard_path
from gensig.dataset.storage.guard import open_shard, read_rows

_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", re.IGNORECASE)


def commonest(reasons: Iterable[str]) -> str:
    """The most frequent reason but for its numbers; with its count where others differ.

    >>> commonest(["torque 3 N m: no end", "torque 5 N m: no end", "not finite"])
    'torque 3 N m: no end (2 of 3)'
    """
    kept = list(reasons)
    kind, n = Counter(map(without_numbers, kept)).most_common(1)[0]
    first = next(reason for reason in kept if without_numbers(reason) == kind)
    if n == len(kept):
        return first
    return f"{first} ({n} of {len(kept)})"


def without_numbers(reason: str) -> str:
    """A reason with '#' for each of its numbers."""
    return _NUMBER.sub("#", reason)


def failure_reasons(folder: Path) -> list[str]:
    """`status_reason` of every failed record of the finished shards that store it."""
    reasons: list[str] = []
    for index, entry in enumerate(read_manifest(folder).shards):
        if entry.state == "done" and entry.n_failed:
            with open_shard(shard_path(folder, index), folder=folder) as file:
                if "status_reason" in file:
                    failed = read_rows(file["status"]) == "failed"
                    reasons += read_rows(file["status_reason"])[failed].tolist()
    return reasons
