"""Pages of sections as Markdown: for the hub, the terminal and those who read text."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Iterator, Sequence

from gensig.text.escaping import plain
from gensig.text.page import Section

# a low line between two letters or digits is no markup
MARKUP = re.compile(r"([\\`*\[\]|#~!]|(?<![^\W_])_|_(?![^\W_]))")


def escape(value: object) -> str:
    """Text for one Markdown table cell: no HTML, no markup, no line breaks, nothing invisible."""
    return MARKUP.sub(r"\\\1", html.escape(plain(value), quote=False))


def table_lines(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Lines of a table, its cells as they are."""
    lines = [f"| {' | '.join(map(str, cells))} |" for cells in (head, *rows)]
    lines.insert(1, "|---" * len(head) + "|")
    return lines


def page_text(title: str, lead: Sequence[str], sections: Sequence[Section]) -> str:
    """A page without charts: its prose is Markdown as it stands, all else is escaped.

    A section without a title goes on with the one before it.
    """
    parts = [f"# {escape(title)}", *lead]
    for section in sections:
        parts += _parts(section)
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _parts(section: Section) -> Iterator[str]:
    if section.title:
        yield f"## {escape(section.title)}"
    yield from section.text
    if section.table is not None:
        cells = (section.table.head, *section.table.rows)
        head, *rows = (list(map(escape, row)) for row in cells)
        yield "\n".join(table_lines(head, rows))
    if section.notes:
        yield "\n".join(_note(*note) for note in section.notes)
    for name, caption in section.figures:
        yield f"![{escape(caption)}]({name})"
    if section.code:
        yield f"```python\n{section.code}\n```"


def _note(term: str, meaning: str) -> str:
    if term:
        return f"- **{term}**: {meaning}"
    return f"- {meaning}"
