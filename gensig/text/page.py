"""Self-contained HTML pages of text, tables, figures and charts; every text is escaped.

Charts are drawn in the browser by plotly.js, which is copied into the page once, from data that
is copied into it too. The page reads nothing else: its content security policy lets only those two
scripts run, and nothing be fetched.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

MARKS = ("", "good", "bad", "quiet")
GENERATOR_BYTES = 1000  # of a page, within which its generator is named


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Cells, shown as plain text, under a head; `quiet` rows are set in grey.

    Parameters
    ----------
    folded : what the reader clicks to open the table; "" for one that is open
    """

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    quiet: Sequence[int] = ()
    folded: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """One answer in large type: title, number, interval, verdict, and its meaning."""

    title: str
    value: str
    spread: str
    verdict: str
    meaning: str
    mark: str = ""

    def __post_init__(self) -> None:
        if self.mark not in MARKS:
            raise ValueError(
                f"mark must be one of {', '.join(MARKS)}, not {self.mark!r}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Select:
    """A drop-down of charts: a label, and groups of (value, text).

    A group without a title stands alone.
    """

    name: str
    label: str
    groups: Sequence[tuple[str, Sequence[tuple[str, str]]]]
    chosen: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch:
    """A box of charts to tick."""

    name: str
    label: str
    on: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Slider:
    """A range of charts, from 0 to `last` in whole steps; the script says what a step is."""

    name: str
    label: str
    last: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Charts:
    """Charts that share controls: `name` finds the function of the page's script that draws them.

    Parameters
    ----------
    plots : (name, what it shows)
    sounds : (name, what is heard), players whose file the script sets
    """

    name: str
    label: str
    selects: Sequence[Select] = ()
    sliders: Sequence[Slider] = ()
    switches: Sequence[Switch] = ()
    plots: Sequence[tuple[str, str]] = ()
    sounds: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A heading and below it, in this order, text, charts, cards, a table, notes, figures and code.

    Parameters
    ----------
    text : paragraphs
    notes : points of a list, each a term in bold, or "", and what is said of it
    figures : (file in the folder of the page, what it shows)
    side_by_side : True for figures that share a line
    code : text to copy, set as it is
    folded : True for a section that the reader opens by a click
    """

    title: str
    text: Sequence[str] = ()
    cards: Sequence[Card] = ()
    table: Table | None = None
    notes: Sequence[tuple[str, str]] = ()
    figures: Sequence[tuple[str, str]] = field(default=())
    side_by_side: bool = False
    charts: Charts | None = None
    code: str = ""
    folded: bool = False


def generator_mark(program: str) -> str:
    """Tag that names the program in each of its pages."""
    return f'<meta name="generator" content="{program}">'


def is_page_of(path: Path, program: str) -> bool:
    """True for an ordinary file that says it is a page of the program."""
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        return generator_mark(program).encode() in file.read(GENERATOR_BYTES)


def write_page(
    path: Path,
    *,
    title: str,
    lead: Sequence[str],
    sections: Sequence[Section],
    program: str,
) -> None:
    """Write the page with copies of its figures, which lie in its folder.

    Parameters
    ----------
    program : named as the generator of the page
    """

    def embedded(name: str) -> str:
        return f"data:image/png;base64,{_base64((path.parent / name).read_bytes())}"

    text = _render(
        title=title,
        lead=lead,
        sections=sections,
        program=program,
        embedded=embedded,
        scripts=(),
        data="",
    )
    path.write_text(text, encoding="utf-8")


def interactive_page(
    *,
    title: str,
    lead: Sequence[str],
    sections: Sequence[Section],
    script: str,
    data: Mapping[str, Any],
    program: str,
) -> str:
    """The text of a page with charts, which cannot hold figures of files.

    Parameters
    ----------
    program : named as the generator of the page
    script : file in the folder ``templates`` whose functions draw the charts
    data : JSON, without NaN, that the script draws; see ``gensig.report.packing`` for arrays
    """
    from plotly.offline import get_plotlyjs

    scripts = [
        get_plotlyjs(),
        (Path(__file__).parent / "templates" / script).read_text(encoding="utf-8"),
    ]
    # neither a tag nor a comment can begin inside of the block that holds the data
    content = (
        json.dumps(data, allow_nan=False, separators=(",", ":"))
        .replace("<", "\\u003c")
        .replace(">", "\\u003e")
    )
    return _render(
        title=title,
        lead=lead,
        sections=sections,
        program=program,
        embedded=None,
        scripts=scripts,
        data=content,
    )


def _render(*, scripts: Sequence[str], program: str, **content: Any) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("gensig.text"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    policy = ""
    if scripts:
        digests = [_base64(hashlib.sha256(text.encode()).digest()) for text in scripts]
        policy = " ".join(["script-src", *(f"'sha256-{text}'" for text in digests)])
        policy += "; "
    content |= {
        "generator": Markup(generator_mark(program)),
        "data": Markup(content["data"]),
        "scripts": [Markup(text) for text in scripts],
        "policy": Markup(policy),
    }
    return environment.get_template("page.html").render(content) + "\n"


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
