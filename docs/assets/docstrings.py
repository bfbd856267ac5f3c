"""The house's docstrings as Markdown: ``name : shape unit, meaning`` under NumPy's headings
becomes a list.

NumPy's own form has a type behind the colon and the meaning on a line of its own; here types
stand in the signature.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

SECTION = re.compile(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", re.MULTILINE)
ENTRY = re.compile(r"^(?P<name>[*\w.][\w.,*/ ]*?)(?: : | {2,})(?P<text>.*)$")


class HouseDocstrings(griffe.Extension):
    """Rewrites each docstring when its object is read."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one module, class, function or attribute."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)


def as_markdown(text: str) -> str:
    """Return the docstring with its sections as bold words and lists."""
    summary, *parts = SECTION.split(text)
    sections = [
        f"**{name}**\n\n{_entries(body)}"
        for name, body in zip(parts[::2], parts[1::2], strict=True)
    ]
    return "\n\n".join([summary.strip(), *sections])


def _entries(body: str) -> str:
    """Return what stands under a heading.

    Entries as a list, with what follows the blank line behind them.
    """
    block, _, rest = body.strip("\n").partition("\n\n")
    lines = []
    for line in block.split("\n"):
        entry = ENTRY.match(line)
        if entry:
            lines.append(f"- `{entry['name']}`: {entry['text'].strip()}")
        else:
            lines.append(
                line if not line.startswith(" ") or not lines else f"    {line.strip()}"
            )
    return "\n".join(lines) + (f"\n\n{rest.strip()}" if rest.strip() else "")
