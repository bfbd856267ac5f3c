"""Replay: simulated records held in memory, of which windows are drawn more than once."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from typing import Any, Generic, TypeVar

import numpy as np
import torch
import torch.utils.data
from numpy.typing import NDArray

from diagnose.data.loading.items import Item
from diagnose.data.loading.streamed import (
    StreamedRecord,
    StreamedWindows,
    worker_share,
)
from diagnose.data.loading.transforms import transformed
from diagnose.data.windows import normalised
from gensig.errors import ConfigError

# Records made before they are asked for, by each worker: two groups of the integrator.
N_AHEAD = 16
# Spawn keys of the seeds of one record's starts and of one worker's draws.
START_STREAM, DRAW_STREAM = 9201, 9202
T = TypeVar("T")
Draw = tuple[StreamedRecord, int]  # of one window: its record and its first sample


class ReplayStream(StreamedWindows):
    """Windows drawn at random from simulated records, each record ``reuse`` times over.

    Every worker of a loader holds ``buffer_records`` records in memory. It draws a record of
    them at random, and cuts a window. A record with ``n`` planned windows is drawn ``reuse * n``
    times. Then it leaves, and the next record of the stream takes its turn. A thread simulates
    the next records meanwhile. Where simulation is slower than training, the loader waits.

    Parameters
    ----------
    stream, protocol, subset, options : as for `StreamedWindows`
    reuse : draws of each planned window of a record; None keeps each record until a newer one
        is ready and never waits, but is then not repeatable, and needs ``n_epochs=None``
    buffer_records : records that each worker holds, 4 bytes a sample
    crop : cut anywhere in the stretch of the subset; False cuts the planned windows, each
        exactly ``reuse`` times
    batch_size : windows of a batch; None yields single windows, for a loader that makes batches
    transform : of the options: function of a batch (batch, channel, sample), or of a window
        (channel, sample) where ``batch_size`` is None, after `normalise`

    Raises
    ------
    ConfigError    as `StreamedWindows`, and for a number below 1

    Notes
    -----
    With ``batch_size`` an item is a batch, ``(windows, targets)`` or with ``return_metadata`` a
    third item of lists and tensors; give the loader ``batch_size=None`` then. Draws follow counts
    and seeds, never time. The set of windows before ``transform`` depends on seed and epoch
    alone. Their order, and the draws of a `Transform`, depend on the number of workers too.
    Other callables draw from where they like. ``n_windows`` is the number of windows that an
    epoch without failed records gives, None without ``reuse``.
    """

    def __init__(
        self,
        stream: Any,
        protocol: str | None = None,
        subset: str | None = None,
        *,
        reuse: int | None = 16,
        buffer_records: int = 64,
        crop: bool = True,
        batch_size: int | None = None,
        **options: Any,
    ) -> None:
        numbers = {
            "reuse": reuse,
            "buffer_records": buffer_records,
            "batch_size": batch_size,
        }
        for name, number in numbers.items():
            if number is not None and number < 1:
                raise ConfigError(f"{name} = {number} must be at least 1")
        super().__init__(stream, protocol, subset, **options)
        if reuse is None and self.n_epochs is not None:
            raise ConfigError(
                f"reuse=None never ends, and n_epochs = {self.n_epochs}; give n_epochs=None"
            )
        self.reuse, self.crop = reuse, crop
        self.buffer_records, self.batch_size = buffer_records, batch_size

    @property
    def n_windows(self) -> int | None:
        """Windows that an epoch gives if no record fails; None without ``reuse``."""
        if self.reuse is None:
            return None
        return self._n_planned * self.reuse

    def __iter__(self) -> Iterator[Item]:
        index, n_workers = worker_share()
        epoch = self.epoch
        sequence = np.random.SeedSequence(
            self.stream.seed, spawn_key=(DRAW_STREAM, epoch, index)
        )
        order, transform = sequence.spawn(2)
        generator = torch.Generator()
        generator.manual_seed(int(transform.generate_state(1, np.uint64)[0] >> 1))
        records = self._records(epoch, index, n_workers)
        ahead = RecordsAhead(records, N_AHEAD)
        with closing(ahead):
            draws = self._draws(ahead, np.random.default_rng(order))
            while chosen := list(itertools.islice(draws, self.batch_size or 1)):
                yield self._item(chosen, generator)

    def _draws(
        self, ahead: RecordsAhead[StreamedRecord], rng: np.random.Generator
    ) -> Iterator[Draw]:
        """Draws from a buffer, in which a record that is used up gives way to the next."""
        buffer: list[_HeldRecord] = []
        while len(buffer) < self.buffer_records and (record := ahead.take()):
            buffer.append(self._held(record))
        n_replaced = 0
        while buffer:
            place = int(rng.integers(len(buffer)))
            held = buffer[place]
            yield held.record, held.next_start()
            if self.reuse is None:
                if ahead.is_ready() and (record := ahead.take()):
                    buffer[n_replaced % len(buffer)] = self._held(record)
                    n_replaced += 1
            elif held.is_used_up:
                if record := ahead.take():
                    buffer[place] = self._held(record)
                else:
                    buffer[place] = buffer[-1]
                    buffer.pop()

    def _held(self, record: StreamedRecord) -> _HeldRecord:
        return _HeldRecord(record, reuse=self.reuse or 1, crop=self.crop)

    def _item(self, chosen: Sequence[Draw], generator: torch.Generator) -> Item:
        """Batch of some draws, or the one window."""
        length = self._window_samples
        n_channels = chosen[0][0].signal.shape[0]
        signals = np.empty((len(chosen), n_channels, length), dtype=np.float32)
        for row, (record, start) in zip(signals, chosen, strict=True):
            row[...] = record.signal[:, start : start + length]
        windows = torch.from_numpy(normalised(signals, self._normalise))
        if self.batch_size is None:
            window = transformed(windows[0], self.transform, generator)
            return window, *self._facts(*chosen[0])
        windows = transformed(windows, self.transform, generator)
        facts = torch.utils.data.default_collate(
            [self._facts(*draw) for draw in chosen]
        )
        return windows, *facts


class _HeldRecord:
    """Record in a buffer, with the windows that are still to be drawn from it.

    Their first samples are drawn from a generator of this record, so that they depend on neither
    the worker nor the time.
    """

    def __init__(self, record: StreamedRecord, *, reuse: int, crop: bool) -> None:
        self.record = record
        self._reuse, self._crop = reuse, crop
        self._rng = np.random.default_rng(
            np.random.SeedSequence(record.seed, spawn_key=(START_STREAM, record.number))
        )
        self._starts = self._drawn().tolist()

    @property
    def is_used_up(self) -> bool:
        """True if every window has been drawn as often as it may be."""
        return not self._starts

    def next_start(self) -> int:
        """First sample of the next window; those of another round if all are drawn."""
        if not self._starts:
            self._starts = self._drawn().tolist()
        return int(self._starts.pop())

    def _drawn(self) -> NDArray[np.integer[Any]]:
        """First samples of ``reuse`` draws of each planned window, in random order."""
        windows = self.record.windows
        place = self._rng.permutation(
            np.repeat(np.arange(windows.start.size), self._reuse)
        )
        if not self._crop:
            return windows.start[place]
        return self._rng.integers(windows.earliest[place], windows.latest[place] + 1)


class RecordsAhead(Generic[T]):
    """Items of an iterator in its order, made ahead of time by one thread of this process.

    The integrator of records runs without the lock of the interpreter, so that the thread takes
    a second core where there is one.

    Parameters
    ----------
    items : iterated by the thread alone
    n_ahead : items that are made before they are asked for
    """

    def __init__(self, items: Iterator[T], n_ahead: int) -> None:
        self._items = items
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._waiting: deque[Future[T | None]] = deque()
        for _ in range(n_ahead):
            self._order()

    def take(self) -> T | None:
        """Next item, waited for; None after the last.

        Raises the error of the iterator.
        """
        if not self._waiting:
            return None
        item = self._waiting.popleft().result()
        if item is not None:
            self._order()
        return item

    def is_ready(self) -> bool:
        """True if ``take`` returns at once."""
        return not self._waiting or self._waiting[0].done()

    def close(self) -> None:
        """Stop the thread after the item that it makes now."""
        self._thread.shutdown(wait=True, cancel_futures=True)

    def _order(self) -> None:
        self._waiting.append(self._thread.submit(next, self._items, None))
