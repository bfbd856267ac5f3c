"""Progress and warnings on stderr, and files that are replaced as a whole."""

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
LONG_SECONDS = 10.0  # without a record, after which the text explains the wait


def note(*texts: str) -> None:
    """Warn of each text; `one_line_warnings` prints it once however often it is true."""
    for text in texts:
        warnings.warn(text, stacklevel=2)


def remark(text: str) -> None:
    """Print one line of the command on stderr."""
    print(f"gensig: {text}", file=sys.stderr)


def step(text: str) -> None:
    """Print at once, on stderr, the step of a long command that begins now."""
    print(text, file=sys.stderr, flush=True)


class ShardProgress:
    """Progress over records: a bar on a terminal, elsewhere a line every few seconds.

    Records count when their shard is whole. Before the first shard is whole, the text says how
    many of ``n_shards`` are at work.
    """

    def __init__(
        self, *, quiet: bool, n_records: int, n_shards: int, n_at_work: int
    ) -> None:
        self.quiet = quiet
        self.n_records = n_records
        n_at_work = min(n_at_work, n_shards)
        self.at_work = f"{n_at_work} of {n_shards} shards at work, counted when whole"
        self._last: Progress | None = None
        self._begin = self._last_time = time.monotonic()
        self._bar: Any = None
        self._ended = threading.Event()
        self._ticker = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> ShardProgress:
        if self.quiet:
            return self
        if sys.stderr.isatty():
            self._start_bar()
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
        if self._bar is not None or self._n_done == self.n_records:
            self._show()

    @property
    def _n_done(self) -> int:
        if self._last is None:
            return 0
        return self._last.n_done

    def _start_bar(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

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

    def _tick(self) -> None:
        """Show the time pass, also while no shard is finished."""
        while not self._ended.wait(self._pause()):
            if self._bar is not None or self._n_done < self.n_records:
                self._show()

    def _pause(self) -> float:
        """Seconds to the next line; lines come less often in a long run."""
        if self._bar is not None:
            return 1.0
        return max(LINE_SECONDS, 0.01 * (time.monotonic() - self._begin))

    def _show(self) -> None:
        if self.quiet:
            return
        if self._bar is not None:
            self._bar.update(self._task, completed=self._n_done, facts=self.facts())
            return
        line = f"{self._n_done} of {self.n_records} records, {self.facts()}"
        if self._n_done == self.n_records:
            line += "; checksums, figures and card follow"
        step(line)

    def facts(self) -> str:
        """Rate, bytes and time left, as far as they are known."""
        last, now = self._last, time.monotonic()
        seconds = self._last_time - self._begin
        if last is None or not last.n_made or seconds <= 0.0:
            waited = now - self._begin
            text = f"{waited:.0f} s; {self.at_work}"
            if waited > LONG_SECONDS:
                text += "; the first run compiles for up to a minute"
            return text
        rate = last.n_made / seconds
        n_left = last.n_records - last.n_done
        left = _duration(max(0.0, n_left / rate - (now - self._last_time)))
        text = f"{rate:.1f} records/s, {last.n_bytes / 1e6:.1f} MB, {left} left"
        if last.n_failed:
            text += f", {last.n_failed} failed"
        return text


def _duration(seconds: float) -> str:
    """A time for reading, such as '42 s', '3 min 10 s', '2 h 5 min'."""
    minutes, seconds = divmod(round(seconds), 60)
    if not minutes:
        return f"{seconds} s"
    if minutes < 60:
        return f"{minutes} min {seconds} s"
    return f"{minutes // 60} h {minutes % 60} min"


@contextmanager
def replaced_file(path: str | Path) -> Iterator[Path]:
    """Temporary path in the folder of ``path``; it replaces ``path`` when the block ends well."""
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
