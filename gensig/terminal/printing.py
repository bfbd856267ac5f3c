"""The only door to the terminal: every line that either command prints, escaped."""

from __future__ import annotations

import sys
from typing import TextIO

from gensig.text.escaping import escaped, one_line


def show(*lines: object) -> None:
    """Print lines on stdout, each `escaped`; a line break within one is foreign, so shown."""
    _write(sys.stdout, lines)


def show_text(text: str) -> None:
    """Print a text on stdout that the program has laid out: its line breaks stay, as in JSON."""
    _write(sys.stdout, text.removesuffix("\n").split("\n"))


def tell(*lines: object) -> None:
    """Print lines on stderr, each `escaped`: progress and steps of a long command."""
    _write(sys.stderr, lines)


def tell_text(text: str) -> None:
    """Print a text on stderr that the program has laid out."""
    _write(sys.stderr, text.removesuffix("\n").split("\n"))


def remark(program: str, message: str) -> None:
    """Print a message on stderr as one line that begins with the name of the command."""
    _write(sys.stderr, [f"{program}: {one_line(message)}"])


def _write(stream: TextIO, lines: object) -> None:
    text = "\n".join(escaped(str(line)) for line in lines)  # type: ignore[attr-defined]
    encoding = getattr(stream, "encoding", None) or "utf-8"
    known = text.encode(encoding, "backslashreplace").decode(encoding)
    print(known, file=stream, flush=True)
