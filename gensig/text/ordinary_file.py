"""The door for files of others: ordinary files only, opened without waiting."""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path

NOT_ORDINARY = "it is no ordinary file"


def open_ordinary(path: Path, *, follow_links: bool = True) -> BufferedReader:
    """An ordinary file, open for reading.

    A named pipe without a writer would make ``open`` wait for ever, and a device has no end. The
    type is asked of what was opened, not of its name, which could change in between.

    Parameters
    ----------
    path : Path
    follow_links : bool    False refuses a symbolic link with `errno.ELOOP`

    Raises
    ------
    OSError    for what cannot be opened; with `NOT_ORDINARY` as its text for pipes, sockets and
               devices
    """
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC
    if not follow_links:
        flags |= os.O_NOFOLLOW
    try:
        descriptor = os.open(path, flags)
    except OSError as error:
        if error.errno in (
            errno.ENXIO,
            errno.ENODEV,
        ):  # a socket; a device without driver
            raise _refused(path) from error
        raise
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            raise _refused(path)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def _refused(path: Path) -> OSError:
    return OSError(errno.EINVAL, NOT_ORDINARY, str(path))


def is_refused(error: OSError) -> bool:
    """True for the error of `open_ordinary` on a pipe, a socket or a device."""
    return error.strerror == NOT_ORDINARY
