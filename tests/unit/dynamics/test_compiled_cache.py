"""A change of any file of the core makes all compiled functions stale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import gensig
from gensig.driveline.time import _line_mesh_kernels, _newmark_kernels
from gensig.dynamics._vector import source_stamp

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
PROGRAM = """
from gensig.dynamics._calling import calling
print(calling(1.0), sum(calling.stats.cache_hits.values()))
"""


def test_all_functions_have_the_stamp_of_all_files() -> None:
    newmark = _newmark_kernels.advance, _newmark_kernels.rest
    for function in (*newmark, _line_mesh_kernels.gather):
        stamp = function._cache._cache_file._source_stamp
        assert stamp == source_stamp(PACKAGE)


def test_a_change_of_a_called_function_is_noticed(tmp_path: Path) -> None:
    package = tmp_path / "gensig" / "dynamics"
    package.mkdir(parents=True)
    for folder in (package, package.parent):
        (folder / "__init__.py").write_text("")
    for name in ("_vector.py", "_written.py"):
        shutil.copy(PACKAGE / "dynamics" / name, package)
    (package / "_calling.py").write_text(CALLING)
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
