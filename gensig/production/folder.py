"""Making a data set on disk from a configuration: the joint of physics and data-set code."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.failures import commonest, failure_reasons
from gensig.dataset.folder.joining import joined_folder
from gensig.dataset.folder.layout import (
    SHARDS,
    ConfigContent,
    Manifest,
    ShardEntry,
    read_manifest,
    shard_path,
)
from gensig.dataset.folder.manifest import record_shards
from gensig.dataset.folder.quick_check import size_problem
from gensig.dataset.folder.run_log import log
from gensig.dataset.plan import Plan
from gensig.dataset.schema import SAMPLE_TYPES
from gensig.dataset.storage.atomic import at_work
from gensig.dataset.storage.compression import COMPRESSIONS, creation_options
from gensig.dataset.storage.receipts import (
    collect_receipts,
    receipt_path,
    shard_entries,
)
from gensig.errors import ConfigError
from gensig.execution.base import Executor, ShardFailure
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.production.record_counts import RecordCounts
from gensig.production.restoring import restore_index, restore_tables
from gensig.production.run_check import (
    folder_kept,
    lost_shards,
    require_tables,
    require_whole,
)
from gensig.production.shard_writing import write_shard
from gensig.record.inputs import InputReader
from gensig.terminal.run_progress import Progress
from gensig.version import __version__


@dataclass(frozen=True, slots=True, kw_only=True)
class Maker:
    """Functions that make parts of a folder, each with the bits that they had.

    Attributes
    ----------
    plan : takes folder and configuration
    check : takes the folder; raises GensigError where no shard can be made, with one line
    write : takes folder, number of a shard and ``counts``; executors pickle it
    """

    plan: Callable[[Path, ConfigContent], Plan]
    check: Callable[[Path], None]
    write: Callable[..., ShardEntry]


def _plan(_out: Path, config: ConfigContent) -> Plan:
    return make_plan(Configuration(config))


def _check(_out: Path) -> None:
    """A simulation needs nothing but the folder."""


SIMULATION = Maker(plan=_plan, check=_check, write=write_shard)


def begin_folder(config: Configuration, overrides: Sequence[str], out: Path) -> Plan:
    """Plan a data set and make its folder, ready for ``run_folder``.

    Nothing is touched if anything is wrong.
    """
    for key, allowed in (("compression", COMPRESSIONS), ("sample_type", SAMPLE_TYPES)):
        if config["dataset"][key] not in allowed:
            raise ConfigError(
                f"dataset.{key} = {config['dataset'][key]!r}; allowed: {', '.join(allowed)}"
            )
    dataset = InputReader(config).dataset
    creation_options(dataset.compression)  # refuses one whose package is missing
    plan = make_plan(config)
    recorded = config.with_entries(out=None).plain()
    create_folder(
        out,
        config=recorded,
        overrides=overrides,
        plan=plan,
        seed=config.seed,
        generator_version=__version__,
    )
    planned = f"{plan.n_records} records in {plan.n_shards} shards are planned"
    log(out, f"gensig {__version__}: {planned}")
    return plan


def run_folder(
    out: Path,
    *,
    executor: Executor,
    on_shard: Callable[[Progress], None],
    asked: ConfigContent | None = None,
    counts: RecordCounts | None = None,
    maker: Maker = SIMULATION,
) -> tuple[int, list[str]]:
    """Make the shards that a folder still lacks, then close it.

    A task of an array job makes its share only.

    Parameters
    ----------
    executor : where the shards are made; it decides no bit
    on_shard : called at the beginning, and for every shard that is finished or could not be made
    counts : takes the records of shards at work
    asked : a configuration, plain, that must agree with the folder's in all that decides bits
    maker : of the plan and the shards that are missing

    Returns
    -------
    number of failed records, and one line for each shard that could not be made; the folder is
    complete only without such a line
    """
    out = out.resolve()
    with folder_kept(out), at_work(out / SHARDS, others=not executor.closes):
        _join(out, asked, maker, closes=executor.closes)
        return _run_shards(out, executor, on_shard, counts, maker)


def _join(
    out: Path, asked: ConfigContent | None, maker: Maker, *, closes: bool
) -> None:
    """Refuse a folder of another version or configuration; restore lost tables of one to close."""
    if not closes:
        joined_folder(out, asked=asked)
        return

    def restore(manifest: Manifest, config: ConfigContent) -> None:
        restore_tables(out, manifest, lambda: maker.plan(out, config))

    manifest, _ = joined_folder(out, asked=asked, restore=restore)
    collect_receipts(out)
    if not manifest.is_complete:
        require_tables(out, manifest)


def _run_shards(
    out: Path,
    executor: Executor,
    on_shard: Callable[[Progress], None],
    counts: RecordCounts | None,
    maker: Maker,
) -> tuple[int, list[str]]:
    """See `run_folder`."""
    manifest = read_manifest(out)
    rows = manifest.shard_sizes
    mine = executor.share(range(len(rows)))
    entries = shard_entries(out, manifest, mine)
    missing = [index for index in mine if not _is_there(out, index, entries[index])]
    if missing:
        maker.check(out)
    done = [index for index in mine if index not in missing]
    progress = Progress(
        n_records=sum(rows[index] for index in mine),
        n_done=sum(rows[index] for index in done),
        n_failed=sum(entries[index].n_failed for index in done),
        n_made=0,
        n_bytes=0,
        reason="",
    )
    problems: list[str] = []
    made: dict[int, str] = {}
    # The log of a closed folder is closed too.
    logged = executor.closes and not manifest.is_complete
    if logged:
        n_missing = f"{len(missing)} of {len(mine)} shards to make"
        log(out, f"gensig {__version__}, {executor}: {n_missing}")
    on_shard(progress)
    job = functools.partial(maker.write, out, counts=counts)
    try:
        for index, result in executor.run(job, missing):
            if counts is not None:
                counts.set(index, 0)
            reason = _recorded(out, index, result, manifest, closes=executor.closes)
            if reason:
                problems.append(reason)
            elif isinstance(result, ShardEntry):
                made[index] = result.sha256
                progress = _counted(progress, result)
            on_shard(replace(progress, reason=reason))
        if not problems:
            problems = lost_shards(out, mine, made)
    except BaseException as error:
        if logged:
            log(out, f"ended by {type(error).__name__}: {error}")
        raise
    if executor.closes and not problems:
        _close(out)
    return progress.n_failed, problems


def _counted(progress: Progress, shard: ShardEntry) -> Progress:
    """The state after a shard that was made."""
    return replace(
        progress,
        n_done=progress.n_done + shard.rows,
        n_made=progress.n_made + shard.rows,
        n_failed=progress.n_failed + shard.n_failed,
        n_bytes=progress.n_bytes + shard.bytes,
    )


def _recorded(
    out: Path,
    index: int,
    result: ShardEntry | ShardFailure,
    manifest: Manifest,
    *,
    closes: bool,
) -> str:
    """Enter a shard in manifest and log; returns the reason why it could not be made, or ''.

    A task of an array job enters nothing: ``gensig finalize`` does. Nor is anything entered in a
    folder that was closed before: a shard that was lost since must have its bits again.
    """
    if manifest.is_complete:
        return _again(out, index, result, manifest.shards[index])
    if isinstance(result, ShardFailure):
        reason = f"shard {index}: {result.reason}"
        if closes:
            record_shards(out, {index: manifest.shards[index].failed()})
            log(out, f"{reason}; not made")
        return reason
    if closes:
        record_shards(out, {index: result})
        receipt_path(out, index).unlink(missing_ok=True)
        sizes = f"{result.n_failed} failed, {result.bytes} bytes"
        log(out, f"shard {index}: {result.rows} records, {sizes}")
    return ""


def _again(
    out: Path, index: int, result: ShardEntry | ShardFailure, entry: ShardEntry
) -> str:
    """The reason why a lost shard of a closed folder is not as it was, or ''."""
    receipt_path(out, index).unlink(missing_ok=True)
    if isinstance(result, ShardFailure):
        return f"shard {index}: {result.reason}"
    if result.sha256 == entry.sha256:
        return ""
    shard_path(out, index).unlink(missing_ok=True)
    return (
        f"shard {index}: {entry.name} was lost and has other bits when made here; restore it "
        "from a copy"
    )


def _close(out: Path) -> None:
    """Close the folder where it is open, and check that everything it lists is there.

    The log is closed with it, and takes no line afterwards.
    """
    manifest = read_manifest(out)
    if manifest.is_complete:
        restore_index(out, manifest)
    else:
        require_tables(out, manifest)
        _finalize(out)
    require_whole(out)


def _finalize(out: Path) -> None:
    """Write index, card and checksums, and say in the log why records failed."""
    if reasons := failure_reasons(out):
        failed = f"{len(reasons)} of {read_manifest(out).n_records} records failed"
        log(out, f"{failed}: {commonest(reasons)}")
    log(out, "every shard is done; closing")
    finalize(out)


def _is_there(out: Path, index: int, entry: ShardEntry) -> bool:
    """True for a shard that is done and whose file has not been lost or cut since."""
    return entry.state == "done" and not size_problem(shard_path(out, index), entry)


def close_folder(out: Path) -> int:
    """Close a folder made by tasks of an array job; returns the number of failed records.

    Raises
    ------
    DatasetError    when a shard is missing, which is named, and while a task is at work
    """
    joined_folder(out)
    with folder_kept(out), at_work(out / SHARDS, others=False):
        collect_receipts(out)
        _close(out)
    return read_manifest(out).n_failed
