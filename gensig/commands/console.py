"""What commands print while they work: a progress bar on a terminal, plain lines elsewhere, warnings as one line."""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.generation import Progress


@contextmanager
def one_line_warnings(program: str) -> Iterator[None]:
    """Print each different warning once, as one line."""
    seen: set[str] = set()

    def show(message: Warning | str, *_details: Any, **_more: Any) -> None:
        text = " ".join(str(message).split())
        if text not in seen:
            seen.add(text)
            print(f"{program}: note: {text}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show
        yield


class ShardProgress:
    """Progress over records: rich bar on a terminal, a line every few seconds otherwise, nothing when quiet."""

    def __init__(self, *, quiet: bool, n_records: int) -> None:
        self.quiet = quiet
        self.n_records = n_records
        self._begin = time.monotonic()
        self._last_line = self._begin
        self._bar: Any = None

    def __enter__(self) -> ShardProgress:
        if not self.quiet and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._bar = Progress(
                TextColumn("records"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TimeRemainingColumn(),
                console=Console(stderr=True),
            )
            self._bar.start()
            self._task = self._bar.add_task("records", total=self.n_records, rate="")
        return self

    def __exit__(self, *_details: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, progress: Progress) -> None:
        """Take one finished shard."""
        now = time.monotonic()
        rate = progress.n_done / max(now - self._begin, 1e-9)
        failed = f", {progress.n_failed} failed" if progress.n_failed else ""
        if self._bar is not None:
            self._bar.update(self._task, completed=progress.n_done, rate=f"{rate:.1f} records/s{failed}")
        elif not self.quiet and (now - self._last_line > 5.0 or progress.n_done == progress.n_records):
            self._last_line = now
            left = (progress.n_records - progress.n_done) / max(rate, 1e-9)
            print(
                f"{progress.n_done} of {progress.n_records} records, {rate:.1f} records/s, {left:.0f} s left{failed}",
                file=sys.stderr,
                flush=True,
            )


@contextmanager
def replaced_file(path: str | Path) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place when the block ends well: nothing is half written."""
    target = Path(path)
    if not target.parent.is_dir():
        raise ConfigError(f"{target}: there is no folder {target.parent}; make it first")
    temporary = target.with_name(f".{target.name}.{os.getpid()}{target.suffix}")
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
