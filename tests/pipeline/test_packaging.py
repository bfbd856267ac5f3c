"""A wheel carries configuration and data, and runs from any folder."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

import gensig.dynamics._kernels
import gensig.mesh._kernels
from gensig.cli import main

ROOT = Path(__file__).resolve().parents[2]
RECORD = ["generate", "--quiet", "plan.n_records=1", "operating.duration_s=0.02"]
# gensig is that of the wheel, and the cache of Numba lies beside its files, wherever those of this run lie
ENVIRONMENT = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "NUMBA_CACHE_DIR")}


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Interpreter of a fresh environment: our wheel, everything else from the test environment."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    source = folder / "source"
    source.mkdir()
    tracked = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("\n")
    for name in filter(None, tracked):
        if (ROOT / name).is_file() and not name.startswith("docs/figures"):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    subprocess.run([*build, str(source)], check=True, capture_output=True)
    venv.create(folder / "env")
    own = folder / "env" / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(own), "install", "--quiet", "--no-deps"]
    subprocess.run([*install, str(next(folder.glob("gensig-*.whl")))], check=True, capture_output=True)
    code = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    site = subprocess.run([own, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    # a path line appends the folder without reading its own .pth files, so the editable gensig there stays unseen
    (Path(site) / "test_environment.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    lend_compiled(Path(site), folder / "compiled")
    return own


def lend_compiled(site: Path, out: Path) -> None:
    """What this environment has compiled serves the wheel, whose files are the same: compiling anew takes a minute."""
    assert main([*RECORD, "executor.n_workers=1", f"out={out}"]) == 0
    for part, one in (("dynamics", gensig.dynamics._kernels.integrate), ("mesh", gensig.mesh._kernels.lower_envelope)):
        package = site / "gensig" / part
        for source in (ROOT / "gensig" / part).glob("*.py"):
            assert (package / source.name).read_bytes() == source.read_bytes()
            shutil.copystat(source, package / source.name)  # the cache knows a file by its time and size
        (package / "__pycache__").mkdir(exist_ok=True)
        for compiled in Path(one.stats.cache_path).glob("*.nb[ci]"):
            shutil.copy(compiled, package / "__pycache__")


def test_wheel_runs_from_another_folder(python: Path, tmp_path: Path) -> None:
    def run(*command: str | Path) -> str:
        done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    code = "import gensig, gensig.configs, diagnose; print(gensig.__file__, gensig.configs.__file__, diagnose.__file__)"
    assert all(str(python.parents[1]) in path for path in run(python, "-c", code).split())
    gensig = python.parent / "gensig"
    assert "1.71178" in run(gensig, "stiffness", "fault=crack")
    assert "215.97" in run(gensig, "modes", "system=engine_gear_train")
    run(gensig, *RECORD, "out=data")
    run(gensig, "verify", "data")
    run(python.parent / "diagnose", "--help")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data"]


def test_this_environment_finds_its_configuration(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "gensig.cli", "stiffness", "gear=xiamen_23_84"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "1.71178" in done.stdout
    assert list(tmp_path.iterdir()) == []
