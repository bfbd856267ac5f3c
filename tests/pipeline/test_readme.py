"""README.md: its ten lines of shell and of Python run as they stand, its links lead somewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
PROGRAMS = {"gensig": "gensig.cli", "diagnose": "diagnose.cli"}


def block(title):
    """The code of the section with this title."""
    (code,) = re.findall(
        rf"^## {title}\n.*?^```\w+\n(.*?)^```", TEXT, flags=re.DOTALL | re.MULTILINE
    )
    return code


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An empty folder, and beside it the two programs of this checkout."""
    folder = tmp_path_factory.mktemp("stranger")
    (folder / "bin").mkdir()
    for name, module in PROGRAMS.items():
        program = folder / "bin" / name
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m {module} "$@"\n')
        program.chmod(0o755)
    (folder / "empty").mkdir()
    return folder


def ran(words, folder):
    """What a command prints; fails where it fails."""
    paths = {
        "PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        words,
        cwd=folder / "empty",
        env=os.environ | paths,
        capture_output=True,
        text=True,
        timeout=3600,
    )
    assert done.returncode == 0, f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def test_ten_lines_of_shell(folder):
    code = block("Ten lines of shell")
    assert len(code.strip().splitlines()) == 10
    said = ran(["sh", "-e", "-c", code], folder)
    assert "is whole and unaltered" in said
    for name in (
        "crack.png",
        "crack.json",
        "missing.png",
        "missing.csv",
        "twin.png",
        "runs/report/report.html",
    ):
        assert (folder / "empty" / name).stat().st_size > 1000, name


def test_ten_lines_of_python_as_a_script(folder):
    code = block("Ten lines of Python")
    assert len(code.strip().splitlines()) <= 11  # and the empty one
    script = folder / "mine.py"
    script.write_text(
        code + "print(signal.shape, len(train), softer.min() < softer.max())\n"
    )
    said = ran([sys.executable, str(script)], folder).splitlines()
    assert said[0].startswith("['healthy', 'crack', 'pitting', 'missing_tooth']")
    assert re.fullmatch(r"\(4, 12800\) [1-9]\d* True", said[-1])


def test_the_two_commands_are_those_of_the_makefile():
    commands = [
        line.split("#")[0].split() for line in block("Two commands").splitlines()
    ]
    assert commands == [["make", "demo"], ["make", "test"]]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for _, target in commands:
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)


@pytest.mark.parametrize(
    "page",
    ["README.md", "docs/index.md", "docs/alternatives.md", "docs/tour.ipynb"],
)
def test_links_lead_somewhere(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    links = [
        link
        for link in re.findall(r"\]\(([^)\s]+)\)", text)
        if not link.startswith(("http", "attachment"))
    ]
    assert links
    missing = [
        link
        for link in links
        if not ((ROOT / page).parent / link.split("#")[0]).exists()
    ]
    assert not missing
