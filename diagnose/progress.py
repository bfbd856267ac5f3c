"""Progress of long runs: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from gensig.terminal.printing import tell
from gensig.text.escaping import escaped


@contextmanager
def progress(n_steps: int, what: str = "training") -> Iterator[Callable[[str], None]]:
    """Yield a function to call with one line for each finished step."""
    started = time.perf_counter()
    if sys.stderr.isatty():
        with _bar(n_steps, what) as advance:
            yield advance
        return
    tell(f"[0/{n_steps}] {what}; each step tells a line when it is done")
    done = 0

    def write(line: str) -> None:
        nonlocal done
        done += 1
        elapsed = f"{time.perf_counter() - started:.0f} s"
        tell(f"[{done}/{n_steps}] {elapsed}  {line}")

    yield write


@contextmanager
def _bar(n_steps: int, what: str) -> Iterator[Callable[[str], None]]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.description}", markup=False),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(what, total=n_steps)
        yield lambda line: bar.update(task, advance=1, description=escaped(line))
