"""Files that are written whole or not at all, and text read with a limit of its size."""

import errno
import fcntl
import hashlib
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gensig.errors import DatasetError

TEMPORARY_SUFFIX = ".tmp"
# causes of a refusal by the disk
FULL = (errno.ENOSPC, errno.EDQUOT)
FORBIDDEN = (errno.EACCES, errno.EPERM)


def temporary_name(path: Path) -> Path:
    """A name in the same folder that no other process uses.

    Hidden, ending in `TEMPORARY_SUFFIX`.
    """
    unique = f"{os.getpid()}-{secrets.token_hex(4)}"
    return path.with_name(f".{path.name}.{unique}{TEMPORARY_SUFFIX}")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other local processes from changing the same data set.

    A lock ends with its process and leaves no file.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise DatasetError(
            f"{folder} cannot be opened: {error.strerror}; give the folder of a data set"
        ) from error
    try:
        # On a file system without locks, one writer at a time is the caller's duty.
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_file(path: Path) -> None:
    """Make the bytes of a file survive a power cut."""
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def publish(temporary: Path, path: Path) -> None:
    """Give a finished temporary file its name: fsync, rename, fsync of the folder."""
    sync_file(temporary)
    os.replace(temporary, path)
    sync_folder(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write or replace a UTF-8 file atomically; DatasetError when the disk refuses."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write or replace a file atomically.

    DatasetError when the disk refuses, after which no part of it is left.
    """
    temporary = temporary_name(path)
    try:
        with temporary.open("wb") as file:
            file.write(content)
        publish(temporary, path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        temporary.unlink(missing_ok=True)


def cannot_write(path: Path, error: Exception) -> DatasetError:
    """Error of one line with the cause: a full disk, no right to write, no place for folders."""
    reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
    remedy = "choose another out=DIR"
    number = getattr(error, "errno", None)
    if number in FULL:
        remedy = f"free some space or {remedy}"
    elif number == errno.ENOENT:
        standing = next(folder for folder in path.absolute().parents if folder.exists())
        reason = f"{standing} takes no new folders or files"
    elif number in FORBIDDEN:
        remedy = f"get the right to write there or {remedy}"
    return DatasetError(f"cannot write {path}: {reason}; {remedy}")


def read_text(path: Path, *, limit: int) -> str:
    """A UTF-8 file of at most `limit` bytes.

    DatasetError when it is absent, no ordinary file, too long or not text.
    """
    try:
        if not path.is_file():
            raise DatasetError(
                f"{path} is missing or no ordinary file; the folder is damaged or no gensig data "
                "set"
            )
        size = path.stat().st_size
        if size > limit:
            raise DatasetError(
                f"{path} has {size} bytes, at most {limit} are allowed; it is no file of a "
                "gensig data set"
            )
        return path.read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        raise DatasetError(
            f"{path} is not UTF-8 text (byte {error.start}); it is damaged, restore it"
        ) from error
    except (OSError, ValueError) as error:
        raise DatasetError(
            f"{path} cannot be read: {error}; check its permissions"
        ) from error


def sha256_file(path: Path) -> str:
    """Hexadecimal sha256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
