"""Hints for a name that does not exist: the nearest names, else all there are."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

# Shares of letters in common; between them the nearest name is a guess, followed by all names.
NEAR, FAR = 0.65, 0.5


def hint(name: str, known: Iterable[str], *, n: int = 3, listed: int = 24) -> str:
    """Hint such as "did you mean 'crack' or 'chipped'?".

    Where nothing is near, the hint is 'there is ...' with at most ``listed`` names.
    """
    names = list(map(str, known))
    close = near(name, names, n=n)
    if close:
        return f"did you mean {' or '.join(map(repr, close))}?"
    if not names:
        return "there is none"
    text = f"there is {', '.join(names[:listed])}"
    if len(names) > listed:
        text += f" and {len(names) - listed} more"
    for guess in near(name, names, n=1, cutoff=FAR):
        text = f"did you mean '{guess}'? {text}"
    return text


def near(
    name: str, names: Iterable[str], *, n: int = 3, cutoff: float = NEAR
) -> list[str]:
    """At most ``n`` names that are spelled alike or begin with ``name``, whatever their case."""
    by_lower = {known.lower(): known for known in reversed(list(names))}
    wanted = str(name).lower()
    result = difflib.get_close_matches(wanted, by_lower, n=n, cutoff=cutoff)
    if len(wanted) >= 3:
        result += [known for known in by_lower if known.startswith(wanted)]
    return [by_lower[known] for known in dict.fromkeys(result)][:n]
