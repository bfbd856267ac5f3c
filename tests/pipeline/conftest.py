"""Commands as they are typed; modules of this folder are importable from its subfolders."""

import json
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from small_sets import make

from gensig.cli import main


def run(line, *more):
    """Run a command of gensig that must succeed; ``more`` are words that need no quotes."""
    words = [*shlex.split(line), *map(str, more)]
    assert main(words) == 0, words


@pytest.fixture
def gensig(tmp_path, monkeypatch, capsys):
    """Run a command in an empty folder; returns what it prints, on stdout and on stderr."""
    monkeypatch.chdir(tmp_path)

    def printed(line, *more):
        capsys.readouterr()
        run(line, *more)
        return capsys.readouterr()

    return printed


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Run a command in an empty folder; returns the content of its JSON file."""
    monkeypatch.chdir(tmp_path)

    def content(line, *more):
        run(line, *more, "--json", "written.json")
        return dict(json.loads(Path("written.json").read_text()))

    return content


class Panels(dict):
    """The panels of a figure by their titles, and the title of them all, as they are saved."""

    def __init__(self, figure):
        super().__init__({panel.get_title(): panel for panel in figure.axes})
        self.title = figure.get_suptitle()


@pytest.fixture
def drawn(monkeypatch):
    """The panels of each figure; figures are not rendered."""
    figures = []

    def keep(figure, path, **_):
        path.write_text("drawn")
        figures.append(Panels(figure))

    monkeypatch.setattr(Figure, "savefig", keep)
    return figures


@dataclass(frozen=True)
class TinySet:
    """A small data set that tests share; a test that changes it works on a copy."""

    folder: Path

    def copy_to(self, folder):
        return Path(shutil.copytree(self.folder, folder))


@pytest.fixture(scope="session")
def tiny_set(tmp_path_factory):
    return TinySet(make(tmp_path_factory.mktemp("tiny") / "data"))
