"""The one way to answer a name that does not exist: the nearest names, else all there are."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def hint(name: str, known: Iterable[str], *, n: int = 3, listed: int = 24) -> str:
    """'did you mean 'crack' or 'chipped'?', or where nothing is near 'there is ...' with at most ``listed`` names."""
    names = [str(one) for one in known]
    close = near(name, names, n=n)
    if close:
        return f"did you mean {' or '.join(repr(one) for one in close)}?"
    if not names:
        return "there is none"
    more = f" and {len(names) - listed} more" if len(names) > listed else ""
    return f"there is {', '.join(names[:listed])}{more}"


def near(name: str, names: Iterable[str], *, n: int = 3) -> list[str]:
    """At most ``n`` names that are spelled much alike, or that ``name`` begins; case does not count."""
    by_lower = {one.lower(): one for one in reversed(list(names))}
    wanted = str(name).lower()
    found = difflib.get_close_matches(wanted, by_lower, n=n, cutoff=0.65)
    begun = [one for one in by_lower if len(wanted) >= 3 and one.startswith(wanted) and one not in found]
    return [by_lower[one] for one in [*found, *begun][:n]]
