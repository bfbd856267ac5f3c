"""A disk that refuses at any change of a beginning: one line, and nothing in the way of another."""

import errno
import os
from contextlib import contextmanager
from pathlib import Path

import pytest
from test_beginning import begin, files

from gensig.dataset.folder.layout import MANIFEST
from gensig.dataset.storage import made_together
from gensig.dataset.storage.atomic import REMEDIES, cannot_write
from gensig.errors import DatasetError
from gensig.production.run_check import folder_kept

TAKING = ("mkdir", "fsync", "replace")
REMOVING = ("unlink", "rmdir", "remove")


@contextmanager
def refusing(number, code, *, removal):
    """Refuse from the change of this number on; yields a list with an entry for each change."""
    changes = []

    def refused(real, *words, **options):
        changes.append(real)
        if len(changes) > number:
            raise OSError(code, os.strerror(code))
        return real(*words, **options)

    def opened(path, mode="r", *words, **options):
        if "w" in mode:
            return refused(real_open, path, mode, *words, **options)
        return real_open(path, mode, *words, **options)

    real_open = Path.open
    with pytest.MonkeyPatch.context() as patch:
        for name in TAKING + REMOVING * removal:
            real = getattr(os, name)
            patch.setattr(
                os, name, lambda *words, real=real, **o: refused(real, *words, **o)
            )
        patch.setattr(Path, "open", opened)
        yield changes


def refusals(folder, code, *, removal):
    """Folder and line of a beginning, refused from each of its changes on in turn."""
    with refusing(1000, code, removal=removal) as changes:
        begin(folder / "whole")
    for number in range(len(changes)):
        out = folder / f"{number}" / "deep" / "set"
        with (
            pytest.raises(DatasetError) as caught,
            refusing(number, code, removal=removal),
        ):
            begin(out)
        yield out, str(caught.value)


def outcomes(folder):
    """Names that full disks leave, with the line where nothing is left."""
    for out, line in refusals(folder, errno.ENOSPC, removal=False):
        assert line.count(REMEDIES[errno.ENOSPC]) == 1
        assert "\n" not in line
        yield out, sorted(path.name for path in out.parent.parent.glob("**/*"))


def test_a_full_disk_leaves_nothing_and_the_same_call_works_with_space(tmp_path):
    n_refused = 0
    for out, left in outcomes(tmp_path):
        assert left == []
        assert not out.parent.parent.exists()
        begin(out)
        made, whole = files(out), files(tmp_path / "whole")
        del made[MANIFEST], whole[MANIFEST]
        assert made == whole
        n_refused += 1
    assert n_refused > 20


def test_without_the_removal_something_is_left(tmp_path, monkeypatch):
    monkeypatch.setattr(made_together.Made, "remove", lambda _: None)
    assert any(left for _, left in outcomes(tmp_path))


def test_a_folder_that_was_there_stays_and_is_empty(tmp_path):
    out = tmp_path / "set"
    out.mkdir()
    with pytest.raises(DatasetError), refusing(30, errno.ENOSPC, removal=False):
        begin(out)
    assert list(out.iterdir()) == []


def test_a_folder_that_another_process_makes_meanwhile_stays(tmp_path, monkeypatch):
    folder, mkdir = tmp_path / "sets" / "mine", Path.mkdir

    def overtaken(path):
        mkdir(path)
        if path.name == "sets":
            raise FileExistsError(path)

    monkeypatch.setattr(Path, "mkdir", overtaken)

    def stopped():
        with made_together.made_together() as made:
            made.folder(folder)
            assert folder.is_dir()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        stopped()
    assert not folder.exists()
    assert folder.parent.is_dir()


def test_a_disk_that_is_read_only_keeps_its_remedy(tmp_path):
    """It refuses removal too, so that what was begun stays, and is begun anew."""
    for out, line in refusals(tmp_path, errno.EROFS, removal=True):
        assert line.count(REMEDIES[errno.EROFS]) == 1
        assert "\n" not in line
        if (out / MANIFEST).is_file():
            continue  # only the note could not be removed any more
        begin(out)
        assert (out / MANIFEST).is_file()


@pytest.mark.parametrize(
    ("error", "is_told"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "shards/x"), True),
        (cannot_write(Path("x"), OSError(errno.ENOSPC, "No space left")), True),
        (OSError(errno.EIO, "Input/output error"), False),
        (DatasetError("plan.csv was altered"), False),
    ],
)
def test_a_run_on_a_full_disk_says_how_it_goes_on(tmp_path, error, is_told):
    begin(tmp_path / "set")
    out = tmp_path / "set"
    with pytest.raises((DatasetError, OSError)) as caught, folder_kept(out):
        raise error
    line = str(caught.value)
    assert (f"then `gensig resume {out}` goes on" in line) == is_told
    assert line.count(REMEDIES[errno.ENOSPC]) == is_told
