"""run.log: events while a data set is made, one line each, with the time in UTC."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

from gensig.dataset.folder.environment import now
from gensig.dataset.folder.layout import LOG
from gensig.text.escaping import one_line


def log(folder: Path, text: str) -> None:
    """Append one line; a disk that refuses it stops nothing, because the log decides nothing."""
    line = f"{now()} {one_line(text)}\n"
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
    with (
        suppress(OSError),
        os.fdopen(os.open(folder / LOG, flags, 0o666), "ab") as file,
    ):
        if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            file.write(line.encode("utf-8"))
