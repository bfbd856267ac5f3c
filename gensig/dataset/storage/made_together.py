"""Files and folders that are made together, or not at all where one of them fails."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from gensig.dataset.storage.atomic import INSTEAD, cannot_write, write_text


class Made:
    """Files and folders that a block makes, in their order."""

    def __init__(self) -> None:
        self._paths: list[Path] = []

    def file(self, path: Path) -> Path:
        """Take the path of a file that is about to be written, and return it."""
        self._paths.append(path)
        return path

    def folder(self, path: Path) -> None:
        """Make a folder, and those above it that are missing."""
        for each in (*reversed(path.parents), path):
            if each.exists():
                continue
            with suppress(FileExistsError):  # another process made it meanwhile
                each.mkdir()
                self._paths.append(each)

    def remove(self) -> None:
        """Remove all of it, the last first, as far as the disk allows."""
        for path in reversed(self._paths):
            with suppress(OSError):
                remove(path)


@contextmanager
def made_together() -> Iterator[Made]:
    """A block whose files and folders are removed where it raises, also when interrupted."""
    made = Made()
    try:
        yield made
    except BaseException:
        made.remove()
        raise


def write_together(files: Mapping[Path, str], *, instead: str = INSTEAD) -> None:
    """Write texts to new files in their order, with the folders that they need.

    A reader that waits for the last file finds all others whole.

    Parameters
    ----------
    files : text by file; none of them exists
    instead : remedy that helps whatever the disk says

    Raises
    ------
    DatasetError    when the disk refuses, after which nothing new is left
    """
    with made_together() as made:
        for path, text in files.items():
            try:
                made.folder(path.parent)
            except OSError as error:
                raise cannot_write(path, error, instead=instead) from error
            write_text(made.file(path), text, instead=instead)


def remove(path: Path) -> None:
    """Remove a file, a link or an empty folder; nothing where there is none."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()
    else:
        path.unlink(missing_ok=True)
