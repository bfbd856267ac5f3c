"""What is compiled is forgotten when any file of the core changes, not only a function's own."""

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
ASK = "from gensig.dynamics._calling import calling; print(calling(1.0), sum(calling.stats.cache_hits.values()))"


def test_all_functions_know_all_files() -> None:
    stamps = {
        function._cache._cache_file._source_stamp
        for function in (
            _newmark_kernels.advance,
            _newmark_kernels.rest,
            _line_mesh_kernels.gather,
        )
    }
    assert stamps == {source_stamp(PACKAGE)}


def test_a_change_of_what_is_called_is_noticed(tmp_path: Path) -> None:
    package = tmp_path / "gensig" / "dynamics"
    package.mkdir(parents=True)
    for place in (package, package.parent):
        (place / "__init__.py").write_text("")
    shutil.copy(PACKAGE / "dynamics" / "_vector.py", package)
    (package / "_calling.py").write_text(CALLING)

    def asked(called: str) -> list[str]:
        (package / "_called.py").write_text(called)
        told = {
            **os.environ,
            "PYTHONPATH": str(tmp_path),
            "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        }
        done = subprocess.run(
            [sys.executable, "-c", ASK],
            env=told,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.split()

    assert asked(CALLED) == ["4.0", "0"]
    assert asked(CALLED) == ["4.0", "1"]
    assert asked(CALLED.replace("1.0", "2.0")) == ["6.0", "0"]
