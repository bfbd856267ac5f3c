"""A disk that refuses to write: each cause has a remedy of its own."""

import errno
import os

import pytest

from gensig.dataset.storage.atomic import REMEDIES, cannot_write, write_text
from gensig.errors import DatasetError

HINTS = {
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "quota",
    errno.EACCES: "get the right to write",
    errno.EPERM: "lsattr",
    errno.EROFS: "mounted read-only",
}


def test_every_remedy_is_looked_at():
    assert HINTS.keys() == REMEDIES.keys()


@pytest.mark.parametrize("number", [*HINTS, errno.EIO])
def test_each_cause_has_its_own_remedy_and_no_other(tmp_path, monkeypatch, number):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(DatasetError) as caught:
        write_text(tmp_path / "a.txt", "x")
    line = str(caught.value)
    assert [known for known, hint in HINTS.items() if hint in line] == (
        [number] * (number in HINTS)
    )
    assert os.strerror(number) in line
    assert "choose another out=DIR" in line
    assert list(tmp_path.iterdir()) == []


def test_another_way_out_can_be_named(tmp_path):
    error = OSError(errno.ENOSPC, "full")
    line = str(cannot_write(tmp_path, error, instead="choose another --out PATH"))
    assert line.endswith("free some space there, or choose another --out PATH")


def test_a_folder_that_was_deleted_is_named_as_that(tmp_path):
    with pytest.raises(DatasetError, match="its folder is missing"):
        write_text(tmp_path / "gone" / "a.txt", "x")
