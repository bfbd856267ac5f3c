"""Verbs on data sets: generate, resume, finalize, plan, reproduce, inspect, verify."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from gensig.commands.console import ShardProgress, note
from gensig.dataset.folder.beginning import refuse_used
from gensig.dataset.folder.failures import commonest, failure_reasons
from gensig.dataset.folder.inspection import inspect as inspect_path
from gensig.dataset.folder.joining import joined_folder
from gensig.dataset.folder.layout import CONFIG_BYTES_LIMIT, MANIFEST, OVERRIDES
from gensig.dataset.folder.manifest import read_manifest
from gensig.dataset.folder.verify import verify as verify_folder
from gensig.dataset.storage.atomic import read_text
from gensig.errors import ConfigError
from gensig.options.compose import job_folders, override_keys, sweep
from gensig.options.configuration import Configuration
from gensig.plan.request import Request, read_request

if TYPE_CHECKING:
    from gensig.dataset.plan import Plan
    from gensig.execution.base import Executor


def generate(arguments: Namespace) -> int:
    """Make one data set, or with -m one for each combination of values."""
    from gensig.execution.registry import read_executor

    jobs = sweep(arguments.overrides) if arguments.multirun else [arguments.overrides]
    requests = [read_request(job, config_dir=arguments.config_dir) for job in jobs]
    parents = {str(request.config["out"]) for request in requests}
    if requests[0].config["out"] in (None, ""):
        raise ConfigError(
            "out is required: give out=DIR, a folder that does not exist or is empty"
        )
    if len(parents) > 1:
        raise ConfigError(
            "out must be one folder; with -m each data set gets a folder below it"
        )
    executors = [read_executor(request.config["executor"]) for request in requests]
    if not executors[0].closes:
        if arguments.multirun:
            raise ConfigError(
                "-m makes several data sets; an array job makes one: plan each with --freeze"
            )
        return _generate_share(executors[0], arguments)
    parent = Path(str(requests[0].config["out"])).expanduser()
    refuse_used(parent)
    folders = (
        [parent / name for name in job_folders(jobs)]
        if arguments.multirun
        else [parent]
    )
    return max(
        _generate_one(request, folder, executor, arguments)
        for request, folder, executor in zip(requests, folders, executors, strict=True)
    )


def _generate_one(
    request: Request, out: Path, executor: Executor, arguments: Namespace
) -> int:
    from gensig.plan.notes import plan_notes
    from gensig.production.folder import begin_folder, run_folder

    begin = time.monotonic()
    table = begin_folder(request.config, request.overrides, out)
    if not arguments.quiet:
        note(*request.notes, *plan_notes(request.config, table))
    n_records = table.n_records
    if not arguments.quiet:
        print(
            f"{out}: making {n_records} records in {table.n_shards} shard(s)",
            file=sys.stderr,
            flush=True,
        )
    with _progress(arguments, executor, n_records, table.n_shards) as progress:
        outcome = run_folder(out, executor=executor, on_shard=progress)
    return _closing_line(out, outcome, n_records, time.monotonic() - begin, arguments)


def _progress(
    arguments: Namespace, executor: Executor, n_records: int, n_shards: int
) -> ShardProgress:
    return ShardProgress(
        quiet=arguments.quiet,
        n_records=n_records,
        n_shards=n_shards,
        n_at_work=executor.n_processes,
    )


def _generate_share(executor: Executor, arguments: Namespace) -> int:
    """One task of an array job: its shards of a folder that was planned before."""
    from gensig.production.folder import run_folder

    out = Path(override_keys(arguments.overrides)["out"]).expanduser()
    if not (out / MANIFEST).is_file():
        raise ConfigError(
            f"out={out}: a task joins a frozen folder; make it once with `gensig plan --freeze out={out}`"
        )
    begin = time.monotonic()
    manifest = read_manifest(out)
    mine = executor.share(range(len(manifest.shards)))
    n_records = sum(manifest.shards[index].rows for index in mine)
    with _progress(arguments, executor, n_records, len(mine)) as progress:
        n_failed, problems = run_folder(
            out,
            executor=executor,
            on_shard=progress,
            asked=_asked(out, arguments.overrides, arguments.config_dir),
        )
    for problem in problems:
        print(f"gensig: {problem}", file=sys.stderr)
    if problems:
        print(
            "gensig: this task's share is incomplete; the same command tries again",
            file=sys.stderr,
        )
        return 1
    _say_failed(out, n_failed, n_records)
    if not arguments.quiet:
        print(
            f"{out}: {n_records} records of this task in {time.monotonic() - begin:.1f} s; gensig finalize {out}"
        )
    return 0


def _asked(
    out: Path, overrides: Sequence[str], config_dir: str | None = None
) -> Configuration | None:
    """The configuration that a folder's own words and those typed now make.

    None where they ask for no other bits.
    """
    words = [word for word in overrides if not _is_free(word)]
    if not words:
        return None
    keys = {_key(word) for word in words}
    begun = [
        word
        for word in _recorded_words(out)
        if not _is_free(word) and _key(word) not in keys
    ]
    try:
        return read_request([*begun, *words], config_dir=config_dir).config
    except ConfigError as error:
        if config_dir is not None:
            raise
        raise ConfigError(
            f"{out} goes on with what it was begun with, and only executor.* may change: leave out {' '.join(words)}"
        ) from error


def _key(word: str) -> str:
    return word.lstrip("+~").partition("=")[0]


def _is_free(word: str) -> bool:
    """True for what may differ from one run on a folder to the next."""
    return _key(word) in ("out", "executor") or _key(word).startswith("executor.")


def _recorded_words(out: Path) -> list[str]:
    """What was typed when the folder was begun."""
    content = yaml.safe_load(read_text(out / OVERRIDES, limit=CONFIG_BYTES_LIMIT))
    return [str(word) for word in content] if isinstance(content, list) else []


def resume(arguments: Namespace) -> int:
    """Finish an interrupted data set, on the same or another executor."""
    from gensig.execution.base import read_n_workers
    from gensig.execution.local import LocalExecutor
    from gensig.execution.registry import read_executor
    from gensig.production.folder import run_folder

    out = Path(arguments.folder)
    manifest = read_manifest(out)
    free = [word for word in arguments.overrides if _is_free(word)]
    executor = read_executor(read_request(free).config["executor"])
    if arguments.workers is not None:
        executor = LocalExecutor(n_workers=read_n_workers(arguments.workers))
    asked = _asked(out, arguments.overrides)
    if manifest.is_complete:
        if asked is not None:
            joined_folder(out, asked=asked.plain())
        _say_failed(out, manifest.n_failed, manifest.n_records)
        print(f"{out} is complete: {manifest.n_records} records")
        return 1 if manifest.n_failed else 0
    begin = time.monotonic()
    n_left = len(manifest.shards) - manifest.n_done
    with _progress(arguments, executor, manifest.n_records, n_left) as progress:
        outcome = run_folder(out, executor=executor, on_shard=progress, asked=asked)
    return _closing_line(
        out, outcome, manifest.n_records, time.monotonic() - begin, arguments
    )


def finalize(arguments: Namespace) -> int:
    """Close a data set whose shards were made by tasks of an array job.

    Accept an edited card of a closed one.
    """
    from gensig.dataset.storage.checksums import accept_edits

    out = Path(arguments.folder)
    manifest = read_manifest(out)
    if manifest.is_complete:
        accepted = accept_edits(out)
        if accepted:
            print(f"{out}: accepted as it is now: {', '.join(accepted)}")
        n_failed = manifest.n_failed
    else:
        from gensig.production.folder import close_folder

        n_failed = close_folder(out)
    n_records = manifest.n_records
    _say_failed(out, n_failed, n_records)
    print(f"{out} is complete: {n_records} records")
    return 1 if n_failed else 0


def _closing_line(
    out: Path,
    outcome: tuple[int, list[str]],
    n_records: int,
    seconds: float,
    arguments: Namespace,
) -> int:
    n_failed, problems = outcome
    for problem in problems:
        print(f"gensig: {problem}", file=sys.stderr)
    if problems:
        print(
            f"gensig: {out} is incomplete; gensig resume {out} tries the missing shards again",
            file=sys.stderr,
        )
        return 1
    _say_failed(out, n_failed, n_records)
    if not arguments.quiet:
        print(
            f"{out}: {n_records} records in {seconds:.1f} s; gensig inspect {out} describes them"
        )
    return 1 if n_failed else 0


def _say_failed(out: Path, n_failed: int, n_records: int) -> None:
    if n_failed:
        why = f": {commonest(reasons)}" if (reasons := failure_reasons(out)) else ""
        print(
            f"gensig: {n_failed} of {n_records} records failed and are marked so in {out}{why}",
            file=sys.stderr,
        )


def plan(arguments: Namespace) -> int:
    """Dry run: how many records, how many bytes, how long.

    With --freeze the folder is made, ready for array jobs.
    """
    from gensig.plan.notes import plan_notes
    from gensig.production.folder import begin_folder
    from gensig.production.prediction import predict

    request = read_request(arguments.overrides, config_dir=arguments.config_dir)
    out = request.config["out"]
    if arguments.freeze:
        if out is None:
            raise ConfigError(
                "--freeze makes a folder: give out=DIR, one that does not exist or is empty"
            )
        begin_folder(request.config, request.overrides, Path(str(out)).expanduser())
        print(
            f"{out} is planned; gensig resume {out} makes it here, tasks with executor=slurm as an array job"
        )

    def say(table: Plan, n_timed: int) -> None:
        note(*request.notes, *plan_notes(request.config, table))
        print(
            f"making {n_timed} of {table.n_records} records to time them",
            file=sys.stderr,
            flush=True,
        )

    for name, value in predict(request.config, on_plan=say).items():
        print(f"{name:<11}{value}")
    return 0


def reproduce(arguments: Namespace) -> int:
    """Simulate records again from what is recorded of them.

    The exit status is 0 only where they agree.
    """
    from gensig.production.reproduction import ACCEPTED
    from gensig.production.reproduction import reproduce as reproduce_records

    if arguments.records < 1:
        raise ConfigError(f"--records {arguments.records} must be at least 1")
    found = reproduce_records(Path(arguments.folder), arguments.records)
    for name, (recorded, present) in found.other.items():
        print(
            f"made with {name} {recorded or 'unknown'}, here is {present or 'unknown'}"
        )
    again = (
        f"; {found.n_failed} failed again for the same reason and hold no signal"
        if found.n_failed
        else ""
    )
    print(f"{found.n_equal} of {found.n_records} records have the same bits{again}")
    if found.worst:
        print(
            f"largest difference {found.largest:.2g} of the record's RMS, in {found.worst}"
        )
        accepted = (
            f"{ACCEPTED:g} is accepted" if found.other else "here every bit must agree"
        )
        print(f"{found.n_refused} record(s) NOT reproduced; {accepted}")
    return 1 if found.n_refused else 0


def inspect(arguments: Namespace) -> int:
    """Describe a data set or file."""
    print(inspect_path(Path(arguments.path)))
    return 0


def verify(arguments: Namespace) -> int:
    """Check a data set; the exit status is 0 only for a whole and unaltered one."""
    result = verify_folder(Path(arguments.folder), quick=arguments.quick)
    for problem in result.problems:
        print(problem)
    if result.problems:
        print(f"{arguments.folder} is NOT whole: {len(result.problems)} problem(s)")
        return 1
    depth = "sizes and manifest" if arguments.quick else "every byte"
    failed = f", {result.n_failed} marked failed" if result.n_failed else ""
    print(
        f"{arguments.folder} is whole and unaltered ({depth} checked): {result.n_records} records{failed}"
    )
    return 0
