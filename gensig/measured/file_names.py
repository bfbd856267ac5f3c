"""Patterns of file names, such as ``{class}_{speed_hz}_{load}.csv``.

They come from YAML files of users: matching takes a time that grows slowly with the name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.text.nearest import hint

CLASS = "class"
NUMBERS = ("speed_hz", "speed_rpm", "torque_nm")
WORDS = ("load", "specimen", "repeat")
FIELDS = (CLASS, *NUMBERS, *WORDS)
MOST_STARS = 2
LONGEST_NAME = 400  # characters
TOKEN = re.compile(r"\{([^{}]*)\}|(\*)|([^{}*]+)|(.)")
# possessive: a field takes all it can, so that nothing is tried twice
NUMBER_FORM = r"\d++(?:\.\d++)?+"
WORD_FORM = r"[0-9A-Za-z%]++(?:\.\d++)?+"


@dataclass(frozen=True, slots=True, kw_only=True)
class NamePattern:
    """Pattern of the names of recordings.

    Attributes
    ----------
    text : as written, with ``*`` for any letters and fields in braces
    form : its expression; compared with the path below the folder where the text has a ``/``,
        with the file's name alone elsewhere
    """

    text: str
    form: re.Pattern[str]

    def match(self, path: str) -> dict[str, str] | None:
        """Field -> its text in a path below the folder; None for another name."""
        name = path
        if "/" not in self.text:
            name = path.rpartition("/")[2]
        if len(name) > LONGEST_NAME:
            return None
        found = self.form.fullmatch(name)
        if found is None:
            return None
        return {
            key: text for key, text in found.groupdict().items() if text is not None
        }


def name_pattern(text: str, classes: Iterable[str], where: str) -> NamePattern:
    """Pattern of a text.

    Parameters
    ----------
    text : the pattern
    classes : words that the field ``class`` can have
    where : file and key, in messages

    Raises
    ------
    ConfigError    for unknown or repeated fields, too many stars, and paths out of the folder
    """
    parts = text.split("/")
    if ".." in parts or text.startswith(("/", "~")) or "\\" in text:
        raise ConfigError(
            f"{where}: the pattern '{text}' leads out of the folder; write it from the folder on"
        )
    if text.count("*") > MOST_STARS:
        raise ConfigError(
            f"{where}: the pattern '{text}' has more than {MOST_STARS} stars; use fields such as "
            f"{{load}} for parts of the name"
        )
    seen: list[str] = []
    form = "".join(
        _part(token, text, tuple(classes), where, seen)
        for token in TOKEN.finditer(text)
    )
    return NamePattern(text=text, form=re.compile(form))


def _part(
    token: re.Match[str],
    text: str,
    classes: tuple[str, ...],
    where: str,
    seen: list[str],
) -> str:
    """Expression of one field, star or text."""
    field, star, literal, brace = token.groups()
    if brace is not None:
        raise ConfigError(
            f"{where}: the pattern '{text}' has a brace without its other"
        )
    if star:
        return "[^/]*"
    if literal is not None:
        return re.escape(literal)
    if field not in FIELDS:
        raise ConfigError(
            f"{where}: the pattern '{text}' has the unknown field '{field}'; {hint(field, FIELDS)}"
        )
    if field in seen:
        raise ConfigError(f"{where}: the pattern '{text}' has {{{field}}} twice")
    seen.append(field)
    if field == CLASS:
        if not classes:
            raise ConfigError(
                f"{where}: the pattern '{text}' has {{class}}; list the classes under classes"
            )
        words = sorted(classes, key=len, reverse=True)
        return f"(?P<{CLASS}>{'|'.join(map(re.escape, words))})"
    if field in NUMBERS:
        return f"(?P<{field}>{NUMBER_FORM})"
    return f"(?P<{field}>{WORD_FORM})"
