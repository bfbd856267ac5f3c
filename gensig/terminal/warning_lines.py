"""Warnings as notes of one line on stderr."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def one_line_warnings(program: str) -> Iterator[None]:
    """Print each different warning once, as one line.

    Of a category with the attribute ``once`` the first is printed only.
    """
    seen: set[object] = set()

    def show(
        message: Warning | str, category: type[Warning], *_details: Any, **_more: Any
    ) -> None:
        text = " ".join(str(message).split())
        key: object = text
        if getattr(category, "once", False):
            key = category
        if key not in seen:
            seen.add(key)
            print(f"{program}: note: {text}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show
        yield
