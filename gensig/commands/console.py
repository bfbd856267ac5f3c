"""Progress and warnings on stderr, and files that are replaced as a whole."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gensig.errors import ConfigError
from gensig.terminal import printing


def note(*texts: str) -> None:
    """Warn of each text; `one_line_warnings` prints it once however often it is true."""
    for text in texts:
        warnings.warn(text, stacklevel=2)


def remark(text: str) -> None:
    """Print one line of the command on stderr."""
    printing.remark("gensig", text)


def step(text: str) -> None:
    """Print at once, on stderr, the step of a long command that begins now."""
    printing.tell(text)


@contextmanager
def replaced_file(path: str | Path) -> Iterator[Path]:
    """Temporary path in the folder of ``path``; it replaces ``path`` when the block ends well."""
    target = Path(path)
    if not target.parent.is_dir():
        raise ConfigError(
            f"{target}: there is no folder {target.parent}; make it first"
        )
    temporary = target.with_name(f".{target.name}.{os.getpid()}{target.suffix}")
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        with suppress(OSError):  # a read-only disk refuses it even where there is none
            temporary.unlink(missing_ok=True)
