"""Progress of a long run: a bar on a terminal and in notebooks, elsewhere a line at times."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass
from typing import Any, Protocol

from gensig.terminal.printing import tell
from gensig.text.amounts import duration_text, size_text

LINE_SECONDS = 5.0
COMPILING = "compiling, once for this kind of machine: half a minute of a core"
STARTING = "workers start"
LEAST_COMPILING = 1.0  # seconds of which a line is told


class Counts(Protocol):
    """Records of shards at work, when the first was begun, and whether a worker compiles."""

    @property
    def n_made(self) -> int:
        """Records of all shards at work."""

    @property
    def begun(self) -> float | None:
        """Time of ``time.monotonic`` at which the first record was begun; None before."""

    @property
    def is_compiling(self) -> bool:
        """True while a worker compiles."""

    @property
    def compile_seconds(self) -> float:
        """Seconds that the slowest worker has compiled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """State of a run at its beginning, and after every shard that is finished or given up.

    Parameters
    ----------
    n_done, n_records : int    records on disk, of all that are planned
    n_failed : int             records among `n_done` whose simulation failed
    n_made, n_bytes : int      records and bytes that this run has made
    reason : str               why this shard could not be made; empty when it was
    """

    n_done: int
    n_records: int
    n_failed: int
    n_made: int
    n_bytes: int
    reason: str


class RunProgress:
    """Progress over records: a bar on a terminal and in notebooks, elsewhere a line at times.

    Parameters
    ----------
    quiet : True shows nothing
    n_records : records of the run
    counts : records of shards at work; without it records count when their shard is whole
    """

    def __init__(
        self, *, quiet: bool, n_records: int, counts: Counts | None = None
    ) -> None:
        self.quiet = quiet
        self.n_records = n_records
        self.counts = counts
        self._last: Progress | None = None
        self._begin = time.monotonic()
        self._compiling_is_told = False
        self._bar: Any = None
        self._ended = threading.Event()
        self._ticker = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> RunProgress:
        if self.quiet:
            return self
        if _is_interactive():
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
        """Take the state at the beginning, and after a shard that is finished or given up."""
        self._last = progress
        if self._bar is not None or self._is_done:
            self._show()

    @property
    def _is_done(self) -> bool:
        last = self._last
        return last is not None and last.n_made > 0 and last.n_done == self.n_records

    @property
    def _n_at_work(self) -> int:
        if self.counts is None:
            return 0
        return self.counts.n_made

    @property
    def _n_done(self) -> int:
        whole = self._last.n_done if self._last is not None else 0
        return min(self.n_records, whole + self._n_at_work)

    @property
    def _n_made(self) -> int:
        """Records of this run."""
        whole = self._last.n_made if self._last is not None else 0
        return whole + self._n_at_work

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
        """Show the time pass, also while no record is finished."""
        while not self._ended.wait(self._pause()):
            if self._bar is not None or not self._is_done:
                self._show()

    def _pause(self) -> float:
        """Seconds to the next line; lines come less often in a long run."""
        if self._bar is not None:
            return 0.5
        return max(LINE_SECONDS, 0.01 * (time.monotonic() - self._begin))

    def _show(self) -> None:
        if self.quiet:
            return
        if self._bar is not None:
            self._bar.update(self._task, completed=self._n_done, facts=self.facts())
            return
        self._tell_compiled()
        line = f"{self._n_done} of {self.n_records} records, {self.facts()}"
        if self._is_done:
            line += "; checksums, figures and card follow"
        tell(line)

    def facts(self) -> str:
        """Rate, bytes and time left, as far as they are known.

        The rate is the mean since the first record was begun, so that compiling does not count.
        """
        now, n_made = time.monotonic(), self._n_made
        if not n_made:
            return f"{now - self._begin:.0f} s{self._before_the_first()}"
        rate = n_made / max(now - self._begun(), 1e-3)
        n_left = self.n_records - self._n_done
        text = f"{rate:.1f} records/s"
        if self._last is not None and self._last.n_bytes:
            text += f", {size_text(self._last.n_bytes)}"
        if n_left:
            text += f", {duration_text(n_left / rate)} left"
        if self._last is not None and self._last.n_failed:
            text += f", {self._last.n_failed} failed"
        return text

    def _begun(self) -> float:
        """Time at which the first record of this run was begun, as far as it is known."""
        begun = None
        if self.counts is not None:
            begun = self.counts.begun
        if begun is None:
            return self._begin
        return begun

    def _before_the_first(self) -> str:
        """Words on the step that the run is in before its first record is made."""
        if self.counts is None:
            return ""
        if self.counts.is_compiling:
            return f"; {COMPILING}"
        if self.counts.begun is None:
            return f"; {STARTING}"
        return ""

    def _tell_compiled(self) -> None:
        """Say once how long the run compiled, when it no longer does."""
        if self.counts is None or self._compiling_is_told or self.counts.is_compiling:
            return
        seconds = self.counts.compile_seconds
        if seconds >= LEAST_COMPILING:
            tell(f"compiled in {duration_text(seconds)}")
            self._compiling_is_told = True


def _is_interactive() -> bool:
    """True on a terminal and in a notebook, where a bar can move."""
    if sys.stderr.isatty():
        return True
    if "IPython" not in sys.modules:
        return False
    from rich.console import Console

    return Console().is_jupyter
