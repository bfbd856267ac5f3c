"""Identity of a data set, and entries of shards in its manifest."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from gensig.dataset.folder.layout import (
    FINGERPRINTS,
    ConfigContent,
    Manifest,
    ShardEntry,
    read_manifest,
    shard_entry,
    shard_path,
    write_manifest,
)
from gensig.dataset.schema import SCHEMA_VERSION
from gensig.dataset.storage.atomic import locked, sha256_file
from gensig.errors import DatasetError

# These change where and how a data set is made, not one bit of it.
NOT_IDENTITY = ("out", "executor", "verbosity", FINGERPRINTS)
# Keys that came after 0.9.0 and their values where they are missing. At that value they are not
# stored and no part of the identity: a folder that was begun without the key is the same data set.
SINCE_0_9 = {
    "solver.backend": "runge_kutta",
    "plan.machines": "crossed",
    "plan.fault_gear": "as_given",
    "plan.n_reference": 0,
    "quality.run_in_share": 0,
    "mesh.heat_law": "grown",
}


def identity_hash(config: ConfigContent, generator_version: str) -> str:
    """sha256 over what decides the bits: the configuration less `NOT_IDENTITY`, schema and
    generator version.

    Raises
    ------
    DatasetError    when the configuration holds something other than text, numbers, booleans,
                    null, lists and mappings
    """
    content = {
        "config": deciding(config),
        "generator_version": generator_version,
        "schema_version": SCHEMA_VERSION,
    }
    canonical = json.dumps(
        content, sort_keys=True, separators=(",", ":"), ensure_ascii=True
    )
    return hashlib.sha256(canonical.encode()).hexdigest()


def deciding(config: ConfigContent) -> dict[str, Any]:
    """The part of a configuration that decides bits, as a copy of plain data."""
    stored = stored_config(config)
    return {key: stored[key] for key in stored if key not in NOT_IDENTITY}


def stored_config(config: dict[str, Any]) -> dict[str, Any]:
    """A configuration as a data set stores it.

    Plain data, without the keys of ``SINCE_0_9`` that have their value.
    """
    stored = plain_data(config)
    for dotted, default in SINCE_0_9.items():
        section, _, key = dotted.partition(".")
        options = stored.get(section)
        if isinstance(options, dict) and options.get(key) == default:
            del options[key]
    return stored


def differing_keys(config: ConfigContent, other: ConfigContent) -> list[str]:
    """Dotted keys that decide bits and whose values differ between two configurations, in order."""
    ours, theirs = SINCE_0_9 | _leaves(config), SINCE_0_9 | _leaves(other)
    missing = object()
    return [
        key
        for key in sorted(ours | theirs)
        if repr(ours.get(key, missing)) != repr(theirs.get(key, missing))
    ]


def _leaves(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    leaves: dict[str, Any] = {}
    for key, value in content.items():
        if not prefix and key in NOT_IDENTITY:
            continue
        if isinstance(value, Mapping) and value:
            leaves.update(_leaves(value, f"{prefix}{key}."))
        else:
            leaves[f"{prefix}{key}"] = value
    return leaves


def record_shards(out: Path, entries: Mapping[int, ShardEntry]) -> None:
    """Enter shards in the manifest in one go; local processes may do so at once.

    Finished ones are under their final name already. A data set with a failed one cannot be closed
    until that is made.
    """
    for index, entry in entries.items():
        if entry.state == "done" and not shard_path(out, index).is_file():
            raise DatasetError(
                f"{shard_path(out, index)} does not exist; a shard is written before it is recorded"
            )
    with locked(out):
        manifest = read_manifest(out)
        if manifest.is_complete:
            raise DatasetError(
                f"{out} is complete and closed; make another data set to change anything"
            )
        shards = list(manifest.shards)
        for index, entry in entries.items():
            if not 0 <= index < len(shards):
                raise DatasetError(
                    f"shard {index} does not exist; {out} has shards 0 to {len(shards) - 1}"
                )
            shards[index] = shard_entry(index, asdict(entry))
        write_manifest(out, replace(manifest, shards=tuple(shards)))


def file_digests(folder: Path, manifest: Manifest) -> Iterator[tuple[str, str, str]]:
    """Name, recorded and actual sha256 ('' when missing) of the files beside the shards."""
    for name, recorded in manifest.files.items():
        path = folder / name
        inside = path.is_file() and path.resolve().is_relative_to(folder.resolve())
        digest = sha256_file(path) if inside else ""
        yield name, recorded, digest


def plain_data(config: ConfigContent) -> dict[str, Any]:
    """A copy made of JSON's types only, sharing nothing with the original."""
    try:
        return json.loads(json.dumps(config))
    except (TypeError, ValueError, RecursionError) as error:
        raise DatasetError(
            f"the configuration holds a value that is no plain data ({error}); use text, "
            "numbers, lists"
        ) from error
