"""What commands print while they work.

A progress bar on a terminal, plain lines elsewhere, warnings as one line.
"""

from __future__ import annotations

import os
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.production.folder import Progress

LINE_SECONDS = 5.0
LONG_SECONDS = 10.0  # without a record: time to say what may take so long


@contextmanager
def one_line_warnings(program: str) -> Iterator[None]:
    """Print each different warning once, as one line.

    Of a category with ``once`` only the first.
    """
    seen: set[object] = set()

    def show(
        message: Warning | str, category: type[Warning], *_details: Any, **_more: Any
    ) -> None:
        text = " ".join(str(message).split())
        key = category if getattr(category, "once", False) else text
        if key not in seen:
            seen.add(key)
            print(f"{program}: note: {text}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show
        yield


def note(*texts: str) -> None:
    """One line each, as a warning: said once however often it is true."""
    for text in texts:
        warnings.warn(text, stacklevel=2)


class ShardProgress:
    """Progress over records: a bar on a terminal, a line every few seconds elsewhere, nothing
    when quiet.

    Records count when their shard is whole. Until the first is, ``n_at_work`` of ``n_shards``
    that are to be made tell what is going on.
    """

    def __init__(
        self, *, quiet: bool, n_records: int, n_shards: int, n_at_work: int
    ) -> None:
        self.quiet = quiet
        self.n_records = n_records
        self.at_work = f"{min(n_at_work, n_shards)} of {n_shards} shards at work, counted when whole"
        self._last: Progress | None = None
        self._begin = self._last_time = time.monotonic()
        self._bar: Any = None
        self._ended = threading.Event()
        self._ticker = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> ShardProgress:
        if self.quiet:
            return self
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import (
                BarColumn,
                MofNCompleteColumn,
                Progress,
                TextColumn,
            )

            self._bar = Progress(
                TextColumn("records"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[facts]}"),
                console=Console(stderr=True),
            )
            self._bar.start()
            self._task = self._bar.add_task(
                "records", total=self.n_records, facts=self.facts()
            )
        self._ticker.start()
        return self

    def __exit__(self, *_details: object) -> None:
        self._ended.set()
        if self._ticker.is_alive():
            self._ticker.join()
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, progress: Progress) -> None:
        """Take one shard that is finished or given up."""
        self._last, self._last_time = progress, time.monotonic()
        if self._bar is not None:
            self._show_bar()
        elif not self.quiet and progress.n_done == progress.n_records:
            self._print_line()

    def _tick(self) -> None:
        """Show the time pass, also where no shard is finished yet.

        Lines come less often in a long run.
        """
        while not self._ended.wait(1.0 if self._bar is not None else self._pause()):
            if self._bar is not None:
                self._show_bar()
            elif self._last is None or self._last.n_done < self.n_records:
                self._print_line()

    def _pause(self) -> float:
        return max(LINE_SECONDS, 0.01 * (time.monotonic() - self._begin))

    def _show_bar(self) -> None:
        n_done = self._last.n_done if self._last is not None else 0
        self._bar.update(self._task, completed=n_done, facts=self.facts())

    def facts(self) -> str:
        """Rate, bytes and time left, as far as they are known."""
        last = self._last
        seconds = self._last_time - self._begin
        if last is None or not last.n_made or seconds <= 0.0:
            waited = time.monotonic() - self._begin
            first = (
                "; the first run compiles for a minute or two"
                if waited > LONG_SECONDS
                else ""
            )
            return f"{waited:.0f} s; {self.at_work}{first}"
        rate = last.n_made / seconds
        left = max(
            0.0,
            (last.n_records - last.n_done) / rate
            - (time.monotonic() - self._last_time),
        )
        failed = f", {last.n_failed} failed" if last.n_failed else ""
        return f"{rate:.1f} records/s, {last.n_bytes / 1e6:.1f} MB, {_duration(left)} left{failed}"

    def _print_line(self) -> None:
        n_done = self._last.n_done if self._last is not None else 0
        then = (
            "; checksums, figures and card follow" if n_done == self.n_records else ""
        )
        print(
            f"{n_done} of {self.n_records} records, {self.facts()}{then}",
            file=sys.stderr,
            flush=True,
        )


def _duration(seconds: float) -> str:
    """'42 s', '3 min 10 s', '2 h 5 min'."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


@contextmanager
def replaced_file(path: str | Path) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place when the block ends well.

    Nothing is half written.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise ConfigError(
            f"{target}: there is no folder {target.parent}; make it first"
        )
    temporary = target.with_name(f".{target.name}.{os.getpid()}{target.suffix}")
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
