"""The Python of the pages compiles, and runs as it stands.

A block below ``<!-- not run: REASON -->`` or ``<!-- run by tests/... -->`` is not run.
README.md has its own tests. The blocks of a page run in order, in one namespace, with a small
data set under the names that pages use.
"""

import re

import pytest
from docs_pages import NAMES, PAGES, ROOT, blocks
from small_sets import make

FOLDERS = ("runs/quick", "runs/first", "runs/traced", "runs/measured", "DIR")
SMALL = (
    "plan.n_records=20",
    "plan.n_units=10",
    "plan.machines=separate",
    "sensing.channels=[pinion_x,pinion_y]",
    "operating.duration_s=0.15",
    "dataset.store_tacho=true",
    "dataset.store_mesh_state=true",
)


def _python(page):
    return [
        block
        for block in blocks(page.read_text(encoding="utf-8"))
        if block.language == "python"
    ]


def _runs(block):
    return not block.mark.startswith(("not run: ", "run by "))


RUN = [
    page
    for page in PAGES
    if page.parent != ROOT and any(_runs(block) for block in _python(page))
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder whose data sets have the names that pages use; all are the same one."""
    folder = tmp_path_factory.mktemp("docs")
    (folder / "runs").mkdir()
    make(folder / FOLDERS[0], *SMALL)
    for name in FOLDERS[1:]:
        (folder / name).symlink_to(folder / FOLDERS[0], target_is_directory=True)
    return folder


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_python_compiles_and_says_who_runs_it(page):
    for block in _python(page):
        compile(block.code, f"{page.name}:{block.line}", "exec")
        if result := re.fullmatch(r"run by (\S+)", block.mark):
            text = (ROOT / result[1]).read_text(encoding="utf-8")
            assert page.name in text


@pytest.mark.parametrize("page", RUN, ids=lambda page: page.name)
def test_python_runs_as_it_stands(page, folder, monkeypatch):
    monkeypatch.chdir(folder)
    names = {}
    for block in filter(_runs, _python(page)):
        exec(compile(block.code, f"{page.name}:{block.line}", "exec"), names)
