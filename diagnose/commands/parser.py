"""What the verbs share.

A parser that complains in one line, and the refusal of a folder that holds something.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gensig.errors import DatasetError
from gensig.terminal.program import Parser


def verb_parser(
    verb: str, description: str, examples: str, exits: Mapping[int, str] | None = None
) -> Parser:
    """Parser of a verb, to be given its arguments.

    ``exits`` says what exit statuses of its own mean.
    """
    return Parser(f"diagnose {verb}", description, examples, exits or {})


def refuse_existing(folder: Path) -> None:
    """Refuse an output folder that holds anything; touches nothing."""
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        raise DatasetError(
            f"out={folder} exists and is not an empty folder; choose another or remove it"
        )
