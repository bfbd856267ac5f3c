"""Items that a thread makes while others are used."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

T = TypeVar("T")


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
