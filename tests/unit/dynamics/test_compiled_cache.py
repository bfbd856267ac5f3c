"""A change of any file of the core makes all compiled functions stale."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import gensig
from gensig.compilation import readable
from gensig.driveline.time import _line_mesh_kernels, _newmark_kernels
from gensig.dynamics._caching import source_stamp

PACKAGE = Path(gensig.__file__).parent
CALLED = """
from gensig.dynamics._vector import compiled
@compiled
def called(x):
    return x + 1.0
"""
CALLING = """
from gensig.dynamics._called import called
from gensig.dynamics._vector import compiled
@compiled
def calling(x):
    return 2.0 * called(x)
"""
ENCLOSING = """
from gensig.dynamics._called import called
from gensig.dynamics._vector import compiled
def enclosing(called):
    @compiled
    def calling(x):
        return 2.0 * called(x)
    return calling
calling = enclosing(called)
"""
PROGRAM = """
from gensig.dynamics._calling import calling
print(calling(1.0), sum(calling.stats.cache_hits.values()))
"""


def test_all_functions_have_the_stamp_of_all_files() -> None:
    for function in (_newmark_kernels.advance, _line_mesh_kernels.gather):
        stamp = function._cache._cache_file._source_stamp
        assert stamp == source_stamp(PACKAGE)


@pytest.mark.parametrize("calling", [CALLING, ENCLOSING], ids=["global", "enclosed"])
def test_a_change_of_a_called_function_is_noticed(tmp_path: Path, calling: str) -> None:
    package = tmp_path / "gensig" / "dynamics"
    package.mkdir(parents=True)
    for folder in (package, package.parent):
        (folder / "__init__.py").write_text("")
    for name in ("_caching.py", "_vector.py", "_written.py"):
        shutil.copy(PACKAGE / "dynamics" / name, package)
    (package / "_calling.py").write_text(calling)
    paths = {
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }

    def output(called: str) -> list[str]:
        (package / "_called.py").write_text(called)
        command = [sys.executable, "-c", PROGRAM]
        options = {
            "env": {**os.environ, **paths},
            "cwd": tmp_path,
            "text": True,
        }
        return subprocess.check_output(command, **options).split()

    assert output(CALLED) == ["4.0", "0"]
    assert output(CALLED) == ["4.0", "1"]
    assert output(CALLED.replace("1.0", "2.0")) == ["6.0", "0"]


class Gone:
    """A type that a later version does not have."""


def test_a_cache_of_types_that_are_gone_is_empty(monkeypatch) -> None:
    """As after an upgrade into the same environment, which leaves the caches of Numba there."""
    written = pickle.dumps(("stamp", {Gone: "overload"}))
    assert readable(lambda: dict([pickle.loads(written)])) != {}
    monkeypatch.delattr(sys.modules[__name__], "Gone")
    assert readable(lambda: dict([pickle.loads(written)])) == {}
