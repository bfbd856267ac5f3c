"""Warnings as notes of one line on stderr."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from gensig.terminal.printing import remark
from gensig.text.escaping import one_line


@contextmanager
def one_line_warnings(program: str, *, quiet: bool = False) -> Iterator[None]:
    """Print each different warning once, as one line.

    Of a category with the attribute ``once`` the first is printed only; ``quiet`` prints none.
    """
    seen: set[object] = set()

    def show(
        message: Warning | str, category: type[Warning], *_details: Any, **_more: Any
    ) -> None:
        text = one_line(str(message))
        key: object = text
        if getattr(category, "once", False):
            key = category
        if key not in seen:
            seen.add(key)
            remark(program, f"note: {text}")

    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if quiet else "always", UserWarning)
        warnings.showwarning = show
        yield
