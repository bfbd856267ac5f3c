"""Foreign text that is shown: invisible and controlling characters as escapes.

Names, classes, units and messages may come from anybody's file. A terminal obeys escape sequences,
a carriage return or a bidirectional override hides what stands before it, and characters without
width make two names look alike.
"""

from __future__ import annotations

import re
import unicodedata
import warnings
from typing import Any

# Unicode categories: control, format, surrogate, line and paragraph separators
HIDDEN = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))
# letters and marks without a picture: fillers of Hangul and Khmer, the empty Braille pattern,
# grapheme joiner, variation selectors
BLANK = re.compile(
    "[\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\u034f]"
)
SHORT = {"\t": "\\t", "\n": "\\n", "\r": "\\r"}


def escaped(text: str) -> str:
    """Text of one line in which every hidden character is an escape, as in Python's strings.

    A surrogate, by which Python keeps a byte of a file name that is no UTF-8, is shown as this
    byte. Printable ASCII is returned as it is.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(map(_shown, text))


def one_line(text: str) -> str:
    """Message of one line: its line breaks and runs of spaces are spaces, the rest `escaped`.

    Messages of libraries have several lines; breaks of other kinds are foreign and escaped.
    """
    return " ".join(escaped(part) for part in re.split("[ \n]+", text.strip(" \n")))


def plain(value: object) -> str:
    """Text of one line for a page: every character that is not printable is a space."""
    return "".join(c if c.isprintable() else " " for c in str(value))


def set_warning_lines(program: str) -> None:
    """Let Python print a warning of this process as one line, `escaped`, as in a worker process."""

    def line(message: Warning | str, *_details: Any, **_more: Any) -> str:
        return f"{program}: note: {one_line(str(message))}\n"

    warnings.formatwarning = line


def _shown(character: str) -> str:
    is_hidden = unicodedata.category(character) in HIDDEN
    if not is_hidden and not BLANK.match(character):
        return character
    if character in SHORT:
        return SHORT[character]
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:
        return f"\\x{code - 0xDC00:02x}"
    if code <= 0xFF:
        return f"\\x{code:02x}"
    if code <= 0xFFFF:
        return f"\\u{code:04x}"
    return f"\\U{code:08x}"
