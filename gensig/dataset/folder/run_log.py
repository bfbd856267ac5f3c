"""run.log: events while a data set is made, one line each, with the time in UTC."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from gensig.dataset.folder.environment import now
from gensig.dataset.folder.layout import LOG


def log(folder: Path, text: str) -> None:
    """Append one line; a disk that refuses it stops nothing, because the log decides nothing."""
    line = f"{now()} {' '.join(text.split())}\n"
    with suppress(OSError), (folder / LOG).open("a", encoding="utf-8") as file:
        file.write(line)
