"""``gensig generate``, ``plan``, ``resume`` and ``finalize``: making a data set."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gensig.commands.console import note, step
from gensig.commands.sets.jobs import Job, read_jobs, typed_words
from gensig.commands.sets.running import (
    interruption_told,
    print_failed,
    resumed,
    run,
)
from gensig.dataset.folder.beginning import config_text, refuse_used
from gensig.dataset.folder.joining import joined_folder
from gensig.dataset.folder.layout import MANIFEST, read_manifest, read_overrides
from gensig.dataset.folder.quick_check import absences
from gensig.errors import ConfigError
from gensig.options.compose import override_keys
from gensig.plan.request import STORED_FLAG, Request, read_request
from gensig.terminal.printing import show, show_text

if TYPE_CHECKING:
    from gensig.dataset.plan import Plan
    from gensig.execution.base import Executor


def generate(arguments: Namespace) -> int:
    """Make one data set, or with -m one for each combination of values."""
    from gensig.execution.registry import read_executor

    jobs = read_jobs(arguments)
    if jobs[0].folder is None:
        raise ConfigError(
            "out is required: give out=DIR, a folder that does not exist or is empty"
        )
    executors = [read_executor(job.request.config["executor"]) for job in jobs]
    if not executors[0].closes:
        if arguments.multirun:
            raise ConfigError(
                "-m makes several data sets; an array job makes one: "
                "plan them with --freeze"
            )
        return _generate_share(executors[0], arguments)
    refuse_used(_parent(jobs))
    return max(
        _generate(job.request, job.folder, executor, arguments)
        for job, executor in zip(jobs, executors, strict=True)
        if job.folder is not None
    )


def _parent(jobs: Sequence[Job]) -> Path:
    """The folder that all data sets are made in; of one without a name its own."""
    folder = jobs[0].folder
    assert folder is not None
    if jobs[0].name:
        return folder.parent
    return folder


def _generate(
    request: Request, out: Path, executor: Executor, arguments: Namespace
) -> int:
    from gensig.plan.doubts import plan_doubts
    from gensig.plan.notes import plan_notes
    from gensig.production.folder import begin_folder
    from gensig.record.inputs import InputReader

    begin = time.monotonic()
    table = begin_folder(request.config, request.overrides, out)
    n_records, n_shards = table.n_records, table.n_shards
    with interruption_told(out, resumed(out)):
        if not arguments.quiet:
            reader = InputReader(request.config)
            note(*request.notes, *plan_notes(reader, table))
            note(*plan_doubts(reader, table))
            step(f"{out}: making {n_records} records in {n_shards} shard(s)")
        return run(
            out,
            executor,
            arguments,
            n_records=n_records,
            begin=begin,
        )


def _generate_share(executor: Executor, arguments: Namespace) -> int:
    """One task of an array job: its shards of a folder that was planned before."""
    words = typed_words(arguments)
    out = Path(override_keys(words)["out"]).expanduser()
    if not (out / MANIFEST).is_file():
        raise ConfigError(
            f"out={out}: a task joins a frozen folder; "
            f"make it once with `gensig plan --freeze out={out}`"
        )
    begin = time.monotonic()
    manifest = read_manifest(out)
    mine = executor.share(range(len(manifest.shards)))
    return run(
        out,
        executor,
        arguments,
        n_records=sum(manifest.shards[index].rows for index in mine),
        begin=begin,
        asked=_asked(out, words, arguments.config_dir, arguments.config),
        of_task=True,
    )


def _asked(
    out: Path,
    overrides: Sequence[str],
    config_dir: str | None = None,
    stored: str | None = None,
) -> dict[str, Any] | None:
    """Plain configuration of a folder's recorded overrides and those typed now.

    ``stored`` is the file of ``--config``, which takes the place of the recorded ones. None where
    the typed ones change nothing that decides bits.
    """
    words = [word for word in overrides if not _is_free(word)]
    if stored is not None:
        return read_request(words, config_dir=config_dir, stored=stored).config.plain()
    if not words:
        return None
    keys = {_key(word) for word in words}
    recorded = read_overrides(out)
    kept = [word for word in recorded if not _is_free(word) and _key(word) not in keys]
    try:
        if recorded and recorded[0].startswith(STORED_FLAG):
            return read_request(words, config_dir=config_dir, stored=out).config.plain()
        return read_request([*kept, *words], config_dir=config_dir).config.plain()
    except ConfigError as error:
        if config_dir is not None:
            raise
        raise ConfigError(
            f"{out} goes on with what it was begun with, and only executor.* may change: "
            f"leave out {' '.join(words)}"
        ) from error


def _key(word: str) -> str:
    return word.lstrip("+~").partition("=")[0]


def _is_free(word: str) -> bool:
    """True for an override that may differ from one run on a folder to the next."""
    return _key(word) in ("out", "executor") or _key(word).startswith("executor.")


def resume(arguments: Namespace) -> int:
    """Finish an interrupted data set, on the same or another executor."""
    from gensig.execution.base import read_n_workers
    from gensig.execution.local import LocalExecutor
    from gensig.execution.registry import read_executor

    out = Path(arguments.folder)
    manifest = read_manifest(out)
    free = [word for word in arguments.overrides if _is_free(word)]
    executor = read_executor(read_request(free).config["executor"])
    if arguments.workers is not None:
        executor = LocalExecutor(n_workers=read_n_workers(arguments.workers))
    asked = _asked(out, arguments.overrides)
    if manifest.is_complete and not absences(out, manifest):
        if asked is not None:
            joined_folder(out, asked=asked)
        return _print_complete(
            out, manifest.n_failed, manifest.n_records, quiet=arguments.quiet
        )
    return run(
        out,
        executor,
        arguments,
        n_records=manifest.n_records,
        begin=time.monotonic(),
        asked=asked,
    )


def finalize(arguments: Namespace) -> int:
    """Close a data set made by tasks of an array job, or accept an edited card."""
    from gensig.dataset.storage.checksums import accept_edits
    from gensig.production.folder import close_folder
    from gensig.production.run_check import require_whole

    out = Path(arguments.folder)
    manifest = read_manifest(out)
    if not manifest.is_complete:
        return _print_complete(out, close_folder(out), manifest.n_records)
    accepted = accept_edits(out)
    require_whole(out)
    if accepted:
        show(f"{out}: accepted as it is now: {', '.join(accepted)}")
    return _print_complete(out, manifest.n_failed, manifest.n_records)


def _print_complete(
    out: Path, n_failed: int, n_records: int, *, quiet: bool = False
) -> int:
    """Print that a folder is complete, and return its exit status."""
    print_failed(out, n_failed, n_records)
    if not quiet:
        show(f"{out} is complete: {n_records} records")
    return int(n_failed > 0)


def plan(arguments: Namespace) -> int:
    """Print records, bytes and time of each data set; with --freeze make its folder too."""
    jobs = read_jobs(arguments)
    if arguments.show_config or arguments.cfg is not None:
        return _show_configurations(jobs)
    if arguments.freeze:
        if jobs[0].folder is None:
            raise ConfigError(
                "--freeze makes a folder: "
                "give out=DIR, one that does not exist or is empty"
            )
        refuse_used(_parent(jobs))
    for number, job in enumerate(jobs):
        if job.name:
            show(*[""] * (number > 0), job.name)
        _plan(job, freeze=arguments.freeze)
    return 0


def _show_configurations(jobs: Sequence[Job]) -> int:
    """Print the configuration of each data set as its ``config.yaml`` would hold it."""
    for job in jobs:
        if job.name:
            show(f"--- # {job.name}")
        show_text(config_text(job.request.config.with_entries(out=None).plain()))
    return 0


def _plan(job: Job, *, freeze: bool) -> None:
    from gensig.plan.doubts import plan_doubts
    from gensig.plan.notes import plan_notes
    from gensig.production.folder import begin_folder
    from gensig.production.prediction import predict
    from gensig.record.inputs import InputReader

    reader, out = InputReader(job.request.config), job.folder
    frozen: Plan | None = None
    if freeze and out is not None:
        frozen = begin_folder(reader.config, job.request.overrides, out)
        show(
            f"{out} is planned; gensig resume {out} makes it here, "
            "tasks with executor=slurm as an array job"
        )

    def on_plan(table: Plan, n_timed: int) -> None:
        note(*job.request.notes, *plan_notes(reader, table))
        note(*plan_doubts(reader, table))
        step(f"making {n_timed} of {table.n_records} records to time them")

    for name, value in predict(reader, table=frozen, on_plan=on_plan).items():
        first, *others = value.split("\n")
        show(f"{name:<11}{first}", *[f"{'':<11}{other}" for other in others])
