"""Whole numbers of overrides that are typed with a point or an exponent, such as ``1e3``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from gensig.text.amounts import typed_count
from gensig.units import split_unit


def with_whole_numbers(
    words: Sequence[str], default_of: Callable[[str], Any]
) -> tuple[str, ...]:
    """Overrides in which every whole number of a counting key is typed in digits.

    A counting key has no unit, and its default is a whole number or null. Other keys keep what is
    typed, and so does a number that is not whole.

    Parameters
    ----------
    words : ``key=value`` and others, as typed
    default_of : the default of a dotted key
    """
    return tuple(_in_digits(word, default_of) for word in words)


def _in_digits(word: object, default_of: Callable[[str], Any]) -> Any:
    """One override; what is no text is left to the parser, which refuses it."""
    if not isinstance(word, str):
        return word
    head, _, value = word.partition("=")
    number = typed_count(value)
    key = head.lstrip("+")
    if number is None or split_unit(key)[1] is not None:
        return word
    default = default_of(key)
    is_count = isinstance(default, int) and not isinstance(default, bool)
    return f"{head}={number}" if is_count or default is None else word
