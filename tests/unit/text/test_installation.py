"""The advice on an extra is the command for what gensig was installed from."""

import json
import re
import shutil
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from gensig.text import installation

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def pip_of_this_python(monkeypatch):
    here = str(Path(sys.executable).with_name("pip"))
    monkeypatch.setattr(shutil, "which", lambda _name: here)


@pytest.fixture
def installed(monkeypatch, tmp_path):
    """gensig as if in site-packages, with the note of pip on where it came from."""
    module = tmp_path / "site-packages" / "gensig" / "text" / "installation.py"
    monkeypatch.setattr(installation, "__file__", str(module))

    class Noted:
        def __init__(self, note):
            self.note = note

        def read_text(self, name):
            assert name == "direct_url.json"
            return self.note and json.dumps(self.note)

    def give(note):
        monkeypatch.setattr(installation, "_distribution", lambda: Noted(note))

    return give


def test_in_a_checkout_it_names_its_folder():
    expected = f"pip install --editable '.[onnx]' in {ROOT}"
    assert installation.install("onnx") == expected


def test_from_a_folder_it_names_the_folder(installed, tmp_path):
    folder = tmp_path / "my gensig"
    note = {"url": folder.as_uri(), "dir_info": {}}
    installed(note)
    lost = "pip install '.[diagnose]' in a checkout of gensig"
    assert installation.install("diagnose") == lost
    folder.mkdir()
    assert installation.install("diagnose") == f"pip install '.[diagnose]' in {folder}"


def test_from_a_wheel_it_names_the_file(installed, tmp_path):
    wheel = tmp_path / "gensig-0.17.0-py3-none-any.whl"
    installed({"url": wheel.as_uri(), "archive_info": {}})
    expected = f"pip install '{wheel.name}[parquet]' in the folder that has this file"
    assert installation.install("parquet") == expected
    wheel.touch()
    assert installation.install("parquet") == f"pip install '{wheel}[parquet]'"


@pytest.mark.parametrize(
    ("note", "what"),
    [
        (
            {
                "url": "https://example.org/g.git",
                "vcs_info": {"vcs": "git", "commit_id": "12ab"},
            },
            "gensig[dask] @ git+https://example.org/g.git@12ab",
        ),
        (
            {"url": "https://example.org/gensig.whl", "archive_info": {}},
            "gensig[dask] @ https://example.org/gensig.whl",
        ),
        (None, "gensig[dask]"),
    ],
)
def test_from_elsewhere_it_names_the_address(installed, note, what):
    installed(note)
    assert installation.install("dask") == f"pip install '{what}'"


def test_without_a_note_it_names_the_project(installed, monkeypatch):
    def missing():
        raise PackageNotFoundError

    installed(None)
    monkeypatch.setattr(installation, "_distribution", missing)
    assert installation.install("dask") == "pip install 'gensig[dask]'"


@pytest.mark.parametrize("found", [None, "/usr/bin/pip"])
def test_the_pip_of_another_python_is_not_advised(monkeypatch, found):
    monkeypatch.setattr(shutil, "which", lambda _name: found)
    monkeypatch.setattr(sys, "executable", "/home/me/my env/bin/python")
    told = installation.install("onnx")
    start = "'/home/me/my env/bin/python' -m pip install --editable '.[onnx]' in "
    assert told.startswith(start)


def test_no_advice_names_a_package_that_is_on_no_index():
    """Every advice comes from `install`; pages name the checkout that they lie in."""
    files = [
        path
        for folder in ("gensig", "diagnose", "configs", "docs")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".yaml", ".md", ".ipynb")
    ]
    by_name = re.compile(r"pip install[^\n]{0,20} '?gensig\b")
    assert by_name.search("pip install 'gensig[dask]'")
    texts = {path: path.read_text("utf-8") for path in [*files, ROOT / "README.md"]}
    assert [path for path, text in texts.items() if by_name.search(text)] == []
