"""Processes of a group that still run. Needs Linux (/proc)."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path


def alive_in_group(group: int) -> list[str]:
    """Commands of a process group that still run."""
    result = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, own_group = path.read_text().rpartition(")")[2].split()[:3]
            if int(own_group) == group and state not in "ZX":
                words = (path.parent / "cmdline").read_bytes().split(b"\0")
                result.append(b" ".join(words[:4]).decode())
    return result
