"""The one way to answer a name that does not exist: the nearest names, else all there are."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

NEAR, FAR = (
    0.65,
    0.5,
)  # shares of letters in common; between them the nearest is a guess, beside all there are


def hint(name: str, known: Iterable[str], *, n: int = 3, listed: int = 24) -> str:
    """'did you mean 'crack' or 'chipped'?', or where nothing is near 'there is ...' with at most
    ``listed`` names.
    """
    names = [str(one) for one in known]
    close = near(name, names, n=n)
    if close:
        return f"did you mean {' or '.join(repr(one) for one in close)}?"
    if not names:
        return "there is none"
    perhaps = "".join(
        f"did you mean '{one}'? " for one in near(name, names, n=1, cutoff=FAR)
    )
    more = f" and {len(names) - listed} more" if len(names) > listed else ""
    return f"{perhaps}there is {', '.join(names[:listed])}{more}"


def near(
    name: str, names: Iterable[str], *, n: int = 3, cutoff: float = NEAR
) -> list[str]:
    """At most ``n`` names that are spelled much alike, or that ``name`` begins.

    Case does not count.
    """
    by_lower = {one.lower(): one for one in reversed(list(names))}
    wanted = str(name).lower()
    found = difflib.get_close_matches(wanted, by_lower, n=n, cutoff=cutoff)
    begun = [
        one
        for one in by_lower
        if len(wanted) >= 3 and one.startswith(wanted) and one not in found
    ]
    return [by_lower[one] for one in [*found, *begun][:n]]
