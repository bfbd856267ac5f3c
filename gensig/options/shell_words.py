"""Lists and mappings that the shell took apart, because they were typed without quotes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

OPENING, CLOSING = "[{(", "]})"
# a name and its value outside braces, or a value that is a name with a value itself
LOST_BRACES = re.compile(r"^\[?[^{\[]*:|:[^{}\[\],:]*:")


def unquoted(words: Sequence[str]) -> str | None:
    """Advice to quote a word that the shell took apart; None where all words are whole.

    A shell splits ``plan.classes=[healthy, crack]`` at the space, and makes
    ``plan.vary=a:1 plan.vary=b:2`` of ``plan.vary={a:1,b:2}``.
    """
    for first, word in enumerate(words):
        if "=" not in word or _depth(word) <= 0:
            continue
        for last in range(first + 1, len(words)):
            whole = " ".join(words[first : last + 1])
            if _depth(whole) == 0:
                return f"the shell split a list or mapping; quote it: '{whole}'"
    keys = Counter(word.partition("=")[0] for word in words if "=" in word)
    for key, n_times in keys.items():
        values = [
            word.partition("=")[2] for word in words if word.startswith(f"{key}=")
        ]
        if n_times > 1 and any(map(_is_entry, values)):
            return (
                f"{key} came in {n_times} parts: the shell took braces apart; quote the "
                f"whole word: '{key}={{...}}'"
            )
    return None


def _is_entry(value: str) -> bool:
    """True for an entry of a mapping that has lost its braces."""
    return "://" not in value and LOST_BRACES.search(value) is not None


def _depth(text: str) -> int:
    """Number of brackets that are opened and not closed."""
    n_open = sum(text.count(sign) for sign in OPENING)
    n_closed = sum(text.count(sign) for sign in CLOSING)
    return n_open - n_closed
