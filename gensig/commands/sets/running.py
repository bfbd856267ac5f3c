"""Run of the shards that a folder lacks, with its progress and its outcome in words."""

from __future__ import annotations

import shlex
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from gensig.commands.console import remark
from gensig.dataset.folder.failures import commonest, failure_reasons
from gensig.dataset.folder.layout import read_manifest
from gensig.errors import Interrupted
from gensig.terminal.printing import show
from gensig.terminal.run_progress import RunProgress

if TYPE_CHECKING:
    from gensig.dataset.folder.layout import ConfigContent
    from gensig.execution.base import Executor
    from gensig.production.folder import Maker


def run(
    out: Path,
    executor: Executor,
    arguments: Namespace,
    *,
    n_records: int,
    begin: float,
    asked: ConfigContent | None = None,
    of_task: bool = False,
    maker: Maker | None = None,
) -> int:
    """Make the shards that a folder, or a task's share of it, lacks; returns the exit status.

    ``maker`` makes them; None takes that of the folder.
    """
    folder = shlex.quote(str(out))
    advice = (
        f"{out} is incomplete; gensig resume {folder} tries the missing shards again"
    )
    records = f"{n_records} records"
    following = f"gensig inspect {folder} describes them"
    going_on = resumed(out)
    if of_task:
        going_on = "and the same command goes on with this task's share"
        advice = "this task's share is incomplete; the same command tries again"
        records += " of this task"
        following = f"gensig finalize {folder}"
    with interruption_told(out, going_on):
        from gensig.implants.implant_folder import maker_of
        from gensig.production.folder import run_folder
        from gensig.production.record_counts import record_counts

        with (
            record_counts(len(read_manifest(out).shards)) as counts,
            RunProgress(
                quiet=arguments.quiet, n_records=n_records, counts=counts
            ) as progress,
        ):
            n_failed, problems = run_folder(
                out,
                executor=executor,
                on_shard=progress,
                asked=asked,
                counts=counts,
                maker=maker or maker_of(out),
            )
    for problem in problems:
        remark(problem)
    if problems:
        remark(advice)
        return 1
    print_failed(out, n_failed, n_records)
    if not arguments.quiet:
        show(f"{out}: {records} in {time.monotonic() - begin:.1f} s; {following}")
    # A task of an array job has done its work; finalize answers for the whole folder.
    return int(n_failed > 0 and not of_task)


def resumed(out: Path) -> str:
    """Words on how an incomplete folder is finished."""
    return f"and gensig resume {shlex.quote(str(out))} finishes it"


@contextmanager
def interruption_told(out: Path, going_on: str) -> Iterator[None]:
    """Say of a folder that is begun how it goes on, where the block is interrupted."""
    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt:
        raise Interrupted(f"{out} is incomplete, {going_on}") from None


def print_failed(out: Path, n_failed: int, n_records: int) -> None:
    """Say on stderr how many records failed and why; nothing where none did."""
    if not n_failed:
        return
    text = f"{n_failed} of {n_records} records failed and are marked so in {out}"
    reasons = failure_reasons(out)
    if reasons:
        text += f": {commonest(reasons)}"
    remark(text)
