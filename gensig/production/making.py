"""A whole data set from overrides, as ``gensig.generate`` makes it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

from gensig.dataset.folder.joining import joined_folder
from gensig.dataset.folder.layout import MANIFEST, read_manifest
from gensig.dataset.folder.quick_check import absences
from gensig.errors import ConfigError, SimulationError
from gensig.execution.base import Executor, read_n_workers
from gensig.execution.local import LocalExecutor
from gensig.execution.registry import read_executor
from gensig.options.typed_only import refuse_untyped
from gensig.plan.doubts import plan_doubts
from gensig.plan.request import Request, read_request
from gensig.production.folder import begin_folder, run_folder
from gensig.production.record_counts import record_counts
from gensig.record.inputs import InputReader
from gensig.terminal.run_progress import RunProgress


def make_folder(
    overrides: Sequence[str],
    out: Path,
    *,
    config_dir: str | Path | None,
    workers: int | None,
    progress: bool,
    reuse: bool,
) -> None:
    """Make a data set, or finish the same one with ``reuse``; see ``gensig.generate``."""
    request = read_request(overrides, config_dir=config_dir)
    executor = _executor(request, workers)
    if reuse and (out / MANIFEST).is_file():
        joined_folder(out, asked=request.config.with_entries(out=None).plain())
    else:
        plan = begin_folder(request.config, request.overrides, out)
        for text in plan_doubts(InputReader(request.config), plan):
            warnings.warn(text, stacklevel=3)
    manifest = read_manifest(out)
    if manifest.is_complete and not absences(out, manifest):
        return
    with record_counts(len(manifest.shards)) as counts:
        shown = RunProgress(
            quiet=not progress, n_records=manifest.n_records, counts=counts
        )
        with shown:
            _, problems = run_folder(
                out, executor=executor, on_shard=shown, counts=counts
            )
    if problems:
        raise SimulationError(f"{out} is incomplete: {problems[0]}")


def _executor(request: Request, workers: int | None) -> Executor:
    refuse_untyped(request.config.with_entries(out=None), request.overrides)
    if workers is not None:
        return LocalExecutor(n_workers=read_n_workers(workers))
    executor = read_executor(request.config["executor"])
    if not executor.closes:
        raise ConfigError(
            "a task of an array job makes its share of a folder only; run it as `gensig generate`"
        )
    return executor
