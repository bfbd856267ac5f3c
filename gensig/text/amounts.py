"""Sizes and durations as people read them, counts as people type them, numbers as JSON has them."""

from __future__ import annotations

import math
import re

SIZE_UNITS = ("B", "kB", "MB", "GB", "TB", "PB")
STEP = 1000
LARGEST_COUNT = 1e15  # above it not every whole number is a float
DECIMAL = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d{1,3})?")
MINUTE, HOUR, DAY = 60, 3600, 86_400  # s


def size_text(n_bytes: float) -> str:
    """A number of bytes with three digits, such as '413 MB' or '1.21 TB'."""
    size, unit = float(n_bytes), 0
    while size >= STEP - 0.5 and unit < len(SIZE_UNITS) - 1:
        size, unit = size / STEP, unit + 1
    return f"{size:.3g} {SIZE_UNITS[unit]}"


def duration_text(seconds: float) -> str:
    """A time of at least a second, such as '42 s', '3 min 10 s', '2 h 5 min', '11 d 3 h'."""
    rest = max(1, round(seconds))
    if rest < MINUTE:
        return f"{rest} s"
    if rest < HOUR:
        return f"{rest // MINUTE} min {rest % MINUTE} s"
    if rest < DAY:
        return f"{rest // HOUR} h {rest % HOUR // MINUTE} min"
    return f"{rest // DAY} d {rest % DAY // HOUR} h"


def finite(value: float) -> float | None:
    """A number that JSON can hold; None for one that is not finite."""
    return float(value) if math.isfinite(value) else None


def typed_count(text: str) -> int | None:
    """The whole number of a text such as '1e3' or '1000.0'.

    None for digits alone, which need no reading, for other numbers and for other texts.
    """
    if text.lstrip("+-").isdigit() or not DECIMAL.fullmatch(text):
        return None
    number = float(text)
    if not number.is_integer() or abs(number) > LARGEST_COUNT:
        return None
    return int(number)
