"""One self-contained HTML page out of sections of text, tables and figures; every text is escaped."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

MARKS = ("", "good", "bad", "quiet")


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Cells of plain text under a head; `quiet` rows are set in grey."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    quiet: Sequence[int] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """One answer in large type: what it is about, the number, its interval, what it says, and what it claims."""

    title: str
    value: str
    spread: str
    verdict: str
    meaning: str
    mark: str = ""

    def __post_init__(self) -> None:
        if self.mark not in MARKS:
            raise ValueError(f"mark must be one of {', '.join(MARKS)}, not {self.mark!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A heading and below it, in this order, text, cards, a table, notes and figures.

    Parameters
    ----------
    text : paragraphs
    notes : points of a list, each a term in bold, or "", and what is said of it
    figures : (file in the folder of the page, what it shows)
    side_by_side : whether figures share a line
    folded : whether the reader opens it by a click
    """

    title: str
    text: Sequence[str] = ()
    cards: Sequence[Card] = ()
    table: Table | None = None
    notes: Sequence[tuple[str, str]] = ()
    figures: Sequence[tuple[str, str]] = field(default=())
    side_by_side: bool = False
    folded: bool = False


def write_page(path: Path, *, title: str, lead: Sequence[str], sections: Sequence[Section]) -> None:
    """Write the page; the figures lie beside it and are copied into it, so that it can be sent alone."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("diagnose"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )

    def embedded(name: str) -> str:
        return "data:image/png;base64," + base64.b64encode((path.parent / name).read_bytes()).decode("ascii")

    template = environment.get_template("page.html")
    text = template.render(title=title, lead=lead, sections=sections, embedded=embedded)
    path.write_text(text + "\n", encoding="utf-8")
