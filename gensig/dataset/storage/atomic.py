"""Files that are written whole or not at all, and text read with a limit of its size."""

import errno
import hashlib
import os
import secrets
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from io import BufferedReader
from pathlib import Path

from gensig.errors import DatasetError, WriteError
from gensig.text.ordinary_file import is_refused, open_ordinary

TEMPORARY_SUFFIX = ".tmp"
TASK = "task"  # mark of a run that shares a folder, while it is at work
LOCK_POLL_SECONDS = 0.01
INSTEAD = "choose another out=DIR"  # remedy that helps whatever the disk says
DATA_SET = "data set"
# remedies where the disk refuses to write, by the number of the error
REMEDIES = {
    errno.ENOSPC: "free some space there",
    errno.EDQUOT: "your quota there is used up: delete files of yours, or ask for more",
    errno.EACCES: "get the right to write there",
    errno.EPERM: "the file system forbids it, even to its owner: lift the attribute (lsattr)",
    errno.EROFS: "it is mounted read-only: mount it for writing",
}


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
    with _opened(folder) as descriptor:
        _lock(descriptor, waits=True)
        yield


@contextmanager
def at_work(folder: Path, *, others: bool) -> Iterator[None]:
    """Keep other local processes from making the files of the same folder.

    A run alone locks the folder, which leaves no file. Runs that share it lock a hidden file each,
    which is removed at the end. Both locks end with their process, and a file without its lock
    counts for nothing. A folder that does not exist is not locked.

    Parameters
    ----------
    folder : of the shards, since `locked` is for the data set's
    others : True allows those that allow others too, as the tasks of an array job do

    Raises
    ------
    DatasetError    where another process is at work
    """
    if not folder.is_dir():
        yield
        return
    with ExitStack() as held:
        with locked(folder.parent):  # one at a time looks for others and begins
            if others:
                _begin_beside_others(folder, held)
            else:
                _begin_alone(folder, held)
        yield


def _begin_alone(folder: Path, held: ExitStack) -> None:
    _lock_at_once(held.enter_context(_opened(folder)), folder)
    for mark in folder.glob(f".{TASK}.*{TEMPORARY_SUFFIX}"):
        # another run's mark may go at any time; a link or a pipe is none
        with suppress(OSError), open_ordinary(mark) as file:
            _lock_at_once(file.fileno(), folder)


def _begin_beside_others(folder: Path, held: ExitStack) -> None:
    with _opened(folder) as descriptor:
        _lock_at_once(descriptor, folder)
    mark = temporary_name(folder / TASK)
    file = mark.open("xb")
    held.callback(mark.unlink, missing_ok=True)
    _lock_at_once(held.enter_context(file).fileno(), folder)


@contextmanager
def _opened(folder: Path) -> Iterator[int]:
    """Descriptor of a folder."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise DatasetError(
            f"{folder} cannot be opened: {error.strerror}; give the folder of a data set"
        ) from error
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _lock_at_once(descriptor: int, folder: Path) -> None:
    """Lock a descriptor until it is closed; raise DatasetError where another process has it."""
    if not _lock(descriptor, waits=False):
        raise DatasetError(
            f"another process is at work in {folder.parent}; wait until it ends, or stop it"
        )


def _lock(descriptor: int, *, waits: bool) -> bool:
    """False where another process has the lock, which is not waited for."""
    from filelock import lock_descriptor  # takes 40 ms, and readers lock nothing

    try:
        return lock_descriptor(
            descriptor, blocking=waits, poll_interval=LOCK_POLL_SECONDS
        )
    except OSError:
        # On a file system without locks, one writer at a time is the caller's duty.
        return True


def sync_folder(folder: Path) -> None:
    """Make the names in a folder survive a power cut."""
    _sync(folder, os.O_RDONLY)


def sync_file(path: Path) -> None:
    """Make the bytes of a file survive a power cut."""
    _sync(path, os.O_RDWR)


def _sync(path: Path, flags: int) -> None:
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def publish(temporary: Path, path: Path) -> None:
    """Give a finished temporary file its name: fsync, rename, fsync of the folder."""
    sync_file(temporary)
    os.replace(temporary, path)
    sync_folder(path.parent)


def write_text(path: Path, text: str, *, instead: str = INSTEAD) -> None:
    """Write or replace a UTF-8 file atomically; DatasetError when the disk refuses."""
    write_bytes(path, text.encode("utf-8"), instead=instead)


def write_bytes(
    path: Path, content: bytes | memoryview, *, instead: str = INSTEAD
) -> None:
    """Write or replace a file atomically.

    DatasetError when the disk refuses, after which no part of it is left. `instead` is the
    remedy that helps whatever the cause is.
    """
    temporary = temporary_name(path)
    try:
        with temporary.open("wb") as file:
            file.write(content)
        publish(temporary, path)
    except OSError as error:
        if error.errno == errno.ENOENT and not path.parent.is_dir():
            raise WriteError(
                f"cannot write {path}: its folder is missing, it was deleted or renamed; "
                "put it back"
            ) from error
        raise cannot_write(path, error, instead=instead) from error
    finally:
        with suppress(OSError):  # a read-only disk refuses it even where there is none
            temporary.unlink(missing_ok=True)


def cannot_write(path: Path, error: Exception, *, instead: str = INSTEAD) -> WriteError:
    """Error of one line with the cause of a refusal to write, and the remedy for that cause.

    Parameters
    ----------
    path : file or folder that was to be written
    error : what the system raised; its ``errno`` chooses the remedy of `REMEDIES`
    instead : remedy that helps whatever the cause is
    """
    reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
    number = getattr(error, "errno", None)
    remedy = instead
    if number in REMEDIES:
        remedy = f"{REMEDIES[number]}, or {instead}"
    elif number == errno.ENOENT:
        standing = next(folder for folder in path.absolute().parents if folder.exists())
        reason = f"{standing} takes no new folders or files"
    return WriteError(f"cannot write {path}: {reason}; {remedy}")


def read_text(path: Path, *, limit: int, follow_links: bool = False) -> str:
    """A UTF-8 file of at most `limit` bytes.

    Parameters
    ----------
    path : Path
    limit : int            bytes
    follow_links : bool    False refuses a symbolic link, as in a data set; True reads its target

    Raises
    ------
    DatasetError    when it is absent, no ordinary file, a link, too long or not text
    """
    try:
        content = _ordinary_bytes(path, limit=limit, follow_links=follow_links)
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise DatasetError(
            f"{path} is not UTF-8 text (byte {error.start}); it is damaged, restore it"
        ) from error
    except (OSError, ValueError) as error:
        raise DatasetError(
            f"{path} cannot be read: {error}; check its permissions"
        ) from error


def _ordinary_bytes(path: Path, *, limit: int, follow_links: bool) -> bytes:
    """Bytes of an ordinary file of at most so many."""
    with open_part(path, follow_links=follow_links) as file:
        n_bytes = refuse_larger(path, file, limit)
        return file.read(n_bytes)


def open_part(
    path: Path, *, follow_links: bool = False, part_of: str = DATA_SET
) -> BufferedReader:
    """An ordinary file of a stranger's folder, open for reading; never waits.

    Parameters
    ----------
    path : Path
    follow_links : bool    False refuses a symbolic link, True opens its target
    part_of : str          thing that the file belongs to, for messages

    Raises
    ------
    DatasetError    when it is absent, a link, a folder, a pipe or a device
    OSError         when the system refuses
    """
    try:
        return open_ordinary(path, follow_links=follow_links)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise DatasetError(link_text(path, part_of)) from error
        absent = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR)
        if error.errno in absent or is_refused(error):
            raise _no_file(path, part_of) from error
        raise


def refuse_larger(
    path: Path, file: BufferedReader, limit: int, part_of: str = DATA_SET
) -> int:
    """Bytes of an open file; DatasetError for more than a limit."""
    size = os.fstat(file.fileno()).st_size
    if size > limit:
        raise DatasetError(
            f"{path} has {size} bytes, at most {limit} are allowed; it is no file of a "
            f"gensig {part_of}"
        )
    return size


def _no_file(path: Path, part_of: str) -> DatasetError:
    return DatasetError(
        f"{path} is missing or no ordinary file; the folder is damaged or no gensig {part_of}"
    )


def link_text(path: Path, part_of: str = DATA_SET) -> str:
    """The line on a symbolic link, which is never a part of a data set or a model."""
    return (
        f"{path} is a symbolic link; a {part_of} holds its files itself: put the file or folder "
        "in place of the link"
    )


def require_digest(path: Path, text: str, sha256: str) -> None:
    """Raise DatasetError for a text that was read from a file and has another sha256."""
    if sha256_text(text) != sha256:
        raise DatasetError(
            f"{path} was altered: its sha256 is not the one in the manifest; restore it from a "
            "copy"
        )


def sha256_text(text: str) -> str:
    """Hexadecimal sha256 of a text as a file holds it."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def sha256_file(path: Path) -> str:
    """Hexadecimal sha256 of an ordinary file's bytes; OSError for anything else."""
    with open_ordinary(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
