"""A disk that is really full or read-only: nothing is left, or what is left goes on with space."""

import shutil
import subprocess
from contextlib import contextmanager

import pytest
from small_sets import TINY, contents, make

from gensig.cli import main
from gensig.dataset.folder.verify import verify


def mount(*words):
    return subprocess.run(["mount", *map(str, words)], capture_output=True).returncode


@contextmanager
def disk(path, size):
    """A disk of so many bytes; the test is skipped where none can be mounted."""
    path.mkdir()
    if not shutil.which("mount"):
        pytest.skip("no mount")
    if mount("-t", "tmpfs", "-o", f"size={size}", "tmpfs", path):
        pytest.skip("no disk can be mounted here")
    try:
        yield path
    finally:
        subprocess.run(["umount", str(path)], check=True)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return make(tmp_path_factory.mktemp("reference") / "data")


@pytest.mark.parametrize(
    ("size", "is_begun"), [(8192, False), (24576, False), (131072, True)]
)
def test_a_full_disk_leaves_nothing_or_what_resume_finishes(
    reference, tmp_path, capsys, size, is_begun
):
    with disk(tmp_path / "disk", size) as full:
        out = full / "runs" / "data"
        words = ["generate", "--quiet", *TINY, "executor.n_workers=1", f"out={out}"]
        assert main(words) in (1, 2)
        said = capsys.readouterr().err
        assert "free some space there" in said
        assert "Traceback" not in said
        assert out.exists() == is_begun
        assert (f"gensig resume {out}" in said) == is_begun
        if not is_begun:
            assert list(full.iterdir()) == []
        assert mount("-o", "remount,size=8m", full) == 0
        if is_begun:
            words = ["resume", "--quiet", str(out), "-j", "1"]
        assert main(words) == 0
        assert contents(out) == contents(reference)
        assert verify(out).complete


def test_a_read_only_disk_keeps_its_remedy(reference, tmp_path, capsys):
    with disk(tmp_path / "disk", 8_000_000) as closed:
        shutil.copytree(reference, closed / "whole")
        assert main(["plan", "--freeze", *TINY, f"out={closed / 'begun'}"]) == 0
        (closed / "empty").mkdir()
        assert mount("-o", "remount,ro", closed) == 0
        capsys.readouterr()
        new = "new gearbox mine --teeth 20 45 --module 3 --speed 1500 --torque 60"
        writing = [
            ["generate", *TINY, f"out={closed / 'new'}"],
            ["generate", *TINY, f"out={closed / 'empty'}"],
            ["resume", str(closed / "begun"), "-j", "1", "--quiet"],
            ["report", str(closed / "whole")],
            ["export", str(reference), "--to", "wav", "--out", f"{closed / 'wav'}"],
            [*new.split(), "--dir", str(closed)],
        ]
        for words in writing:
            assert main(words) == 2
            lines = capsys.readouterr().err.splitlines()
            told = [line for line in lines if "mounted read-only" in line]
            assert len(told) == 1, (words, lines)
            assert told[0].count("mount it for writing") == 1
