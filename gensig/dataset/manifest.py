"""The life of a data-set folder: created, filled shard by shard, closed. Only closing makes it look whole."""

import fcntl
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import yaml

from gensig.dataset.atomic import TEMPORARY_SUFFIX, cannot_write, sha256_file, write_text
from gensig.dataset.card import write_card
from gensig.dataset.environment import environment, now
from gensig.dataset.index import write_index
from gensig.dataset.layout import (
    CONFIG,
    INDEX,
    OVERRIDES,
    PLAN,
    SHARDS,
    SPLITS,
    Manifest,
    ShardEntry,
    read_manifest,
    shard_entry,
    shard_name,
    shard_path,
    write_manifest,
)
from gensig.dataset.plan import Plan, plan_text
from gensig.dataset.schema import SCHEMA_VERSION
from gensig.dataset.splits import make_splits
from gensig.errors import DatasetError

__all__ = [
    "create_folder",
    "differing_keys",
    "finalize",
    "identity_hash",
    "read_manifest",
    "record_failed_shard",
    "record_shard",
    "record_shards",
    "refuse_used",
]

# These change where and how a data set is made, not one bit of it.
NOT_IDENTITY = ("out", "executor", "verbosity")
RECEIPT_SUFFIX = ".done"


def identity_hash(config: dict[str, Any], generator_version: str) -> str:
    """sha256 over what decides the bits: the configuration less `NOT_IDENTITY`, schema and generator version.

    Raises
    ------
    DatasetError    when the configuration holds something other than text, numbers, booleans, null, lists and mappings
    """
    content = {
        "config": {key: value for key, value in _plain(config).items() if key not in NOT_IDENTITY},
        "generator_version": generator_version,
        "schema_version": SCHEMA_VERSION,
    }
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(canonical.encode()).hexdigest()


def differing_keys(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Dotted keys that decide bits and whose values differ between two configurations, in order."""
    ours, theirs = _leaves(one), _leaves(other)
    absent = object()
    return [key for key in sorted({*ours, *theirs}) if repr(ours.get(key, absent)) != repr(theirs.get(key, absent))]


def _leaves(config: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    leaves: dict[str, Any] = {}
    for key, value in config.items():
        if not prefix and key in NOT_IDENTITY:
            continue
        if isinstance(value, Mapping) and value:
            leaves.update(_leaves(value, f"{prefix}{key}."))
        else:
            leaves[f"{prefix}{key}"] = value
    return leaves


def create_folder(
    out: Path,
    *,
    config: dict[str, Any],
    overrides: Sequence[str],
    plan: Plan,
    identity: str,
    seed: int,
    generator_version: str,
) -> None:
    """Make a data-set folder with plan, splits and manifest, ready to take shards.

    Parameters
    ----------
    out : Path           a folder that does not exist or is empty
    config : dict        resolved configuration, plain values
    overrides : list     what the user typed
    plan : Plan          all records; it fixes the shards
    identity : str       `identity_hash(config, generator_version)`
    seed : int           root seed, also of the splits
    generator_version : str

    Raises
    ------
    DatasetError    when `out` exists and is not empty, before anything is touched; when the disk refuses, after which
                    nothing new is left
    """
    out = Path(out)
    if identity != identity_hash(config, generator_version):
        raise DatasetError(
            f"identity {identity[:12]} does not belong to this configuration; use identity_hash(config, ...)"
        )
    texts = {
        CONFIG: yaml.safe_dump(_plain(config), sort_keys=False, allow_unicode=True),
        OVERRIDES: yaml.safe_dump([str(item) for item in overrides], allow_unicode=True),
        PLAN: plan_text(plan),
        **{f"{SPLITS}/{name}.csv": table.to_csv() for name, table in make_splits(plan, seed).items()},
    }
    manifest = Manifest(
        generator_version=generator_version,
        identity=identity,
        seed=seed,
        n_records=plan.n_records,
        shards=tuple(ShardEntry(name=shard_name(i), rows=rows) for i, rows in enumerate(plan.shard_sizes())),
        files={name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()},
        environment=environment(),
    )
    made: list[Path] = []
    try:
        refuse_used(out)
        _make_folders(out, made)
        for name, text in texts.items():
            made.append(out / name)
            write_text(out / name, text)
        write_manifest(out, manifest)
    except BaseException as error:
        for path in reversed(made):
            with suppress(OSError):
                path.rmdir() if path.is_dir() else path.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise cannot_write(out, error) from error
        raise


def refuse_used(out: Path) -> None:
    """Raise DatasetError where a folder exists and holds something."""
    if out.is_dir():
        if any(out.iterdir()):
            raise DatasetError(f"{out} exists and is not empty; choose another out=DIR or empty it first")
    elif out.exists() or out.is_symlink():
        raise DatasetError(f"{out} exists and is no folder; choose another out=DIR")


def _make_folders(out: Path, made: list[Path]) -> None:
    missing = [folder for folder in (out, *out.parents) if not folder.exists()]
    for folder in (*reversed(missing), out / SHARDS, out / SPLITS):
        folder.mkdir()
        made.append(folder)


def record_shard(out: Path, shard_index: int, sha256: str, bytes: int, n_failed: int) -> None:
    """Enter a finished shard, already under its final name, in the manifest; local processes may do so at once."""
    _record(out, {shard_index: {"sha256": sha256, "bytes": bytes, "n_failed": n_failed}})


def record_shards(out: Path, entries: Mapping[int, ShardEntry]) -> None:
    """Enter finished shards in the manifest in one go."""
    _record(
        out, {i: {"sha256": one.sha256, "bytes": one.bytes, "n_failed": one.n_failed} for i, one in entries.items()}
    )


def _record(out: Path, facts: Mapping[int, Mapping[str, Any]]) -> None:
    for index in facts:
        if not shard_path(out, index).is_file():
            raise DatasetError(f"{shard_path(out, index)} does not exist; a shard is written before it is recorded")
    _update(out, {index: {"state": "done", **fact} for index, fact in facts.items()})


def record_failed_shard(out: Path, shard_index: int) -> None:
    """Enter in the manifest that a shard could not be made; the data set cannot be closed until it is."""
    _update(out, {shard_index: {"state": "failed", "sha256": "", "bytes": 0, "n_failed": 0}})


def _update(out: Path, changes: Mapping[int, Mapping[str, Any]]) -> None:
    with _locked(out):
        manifest = read_manifest(out)
        if manifest.is_complete:
            raise DatasetError(f"{out} is complete and closed; make another data set to change anything")
        shards = list(manifest.shards)
        for index, change in changes.items():
            if not 0 <= index < len(shards):
                raise DatasetError(f"shard {index} does not exist; {out} has shards 0 to {len(shards) - 1}")
            shards[index] = shard_entry(index, {**asdict(shards[index]), **change})
        write_manifest(out, replace(manifest, shards=tuple(shards)))


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep other local processes from rewriting the manifest; a lock ends with its process and leaves no file."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise DatasetError(f"{folder} cannot be opened: {error.strerror}; give the folder of a data set") from error
    try:
        with suppress(OSError):  # a file system without locks: one writer at a time is then the caller's duty
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def finalize(out: Path) -> None:
    """Close a data set whose shards are all done: index.h5, README.md, and the state 'complete' last of all.

    Raises
    ------
    DatasetError    when a shard is not done, is missing or has another size than the manifest says
    """
    out = Path(out)
    with _locked(out):
        manifest = read_manifest(out)
        if manifest.is_complete:
            return
        missing = [entry for entry in manifest.shards if entry.state != "done"]
        if missing:
            named = ", ".join(f"{entry.name} is {entry.state}" for entry in missing[:3])
            more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
            raise DatasetError(
                f"{out}: {manifest.n_done} of {len(manifest.shards)} shards are done, {named}{more}; run `gensig "
                f"resume {out}` first"
            )
        for i, entry in enumerate(manifest.shards):
            path = shard_path(out, i)
            if not path.is_file() or path.stat().st_size != entry.bytes:
                raise DatasetError(
                    f"{path} is missing or has not the {entry.bytes} bytes recorded; run `gensig resume {out}`"
                )
        _remove_leftovers(out)
        digest = write_index(out, manifest)
        write_card(out)
        write_manifest(
            out,
            replace(
                manifest,
                state="complete",
                files={**manifest.files, INDEX: digest},
                environment={**manifest.environment, "finished": now()},
            ),
        )


def _remove_leftovers(out: Path) -> None:
    """Remove temporary files and receipts of killed writers; every shard is done, so no writer is alive."""
    for folder in (out, out / SHARDS, out / SPLITS):
        for suffix in (TEMPORARY_SUFFIX, RECEIPT_SUFFIX):
            for path in folder.glob(f".*{suffix}"):
                path.unlink(missing_ok=True)


def file_digests(folder: Path, manifest: Manifest) -> Iterator[tuple[str, str, str]]:
    """Name, recorded and actual sha256 ('' when missing) of the files beside the shards."""
    for name, recorded in manifest.files.items():
        path = folder / name
        inside = path.is_file() and path.resolve().is_relative_to(folder.resolve())
        yield name, recorded, sha256_file(path) if inside else ""


def _plain(config: dict[str, Any]) -> dict[str, Any]:
    """A copy made of JSON's types only, sharing nothing with the original."""
    try:
        return json.loads(json.dumps(config))
    except (TypeError, ValueError, RecursionError) as error:
        raise DatasetError(
            f"the configuration holds a value that is no plain data ({error}); use text, numbers, lists"
        ) from error
