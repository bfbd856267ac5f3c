"""A wheel carries configuration and data, and runs from any folder."""

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


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
    venv.create(folder / "env", with_pip=True)
    own = folder / "env" / "bin" / "python"
    wheel = next(folder.glob("gensig-*.whl"))
    subprocess.run([own, "-m", "pip", "install", "--quiet", "--no-deps", str(wheel)], check=True, capture_output=True)
    code = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    site = subprocess.run([own, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    # a path line appends the folder without reading its own .pth files, so the editable gensig there stays unseen
    (Path(site) / "test_environment.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return own


def test_wheel_runs_from_another_folder(python: Path, tmp_path: Path) -> None:
    code = "import gensig, gensig.configs, diagnose; print(gensig.__file__, gensig.configs.__file__, diagnose.__file__)"
    found = subprocess.run(
        [python, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout.split()
    assert all(str(python.parents[1]) in path for path in found)
    gensig = python.parent / "gensig"
    done = subprocess.run(
        [gensig, "stiffness", "fault=crack"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "1.71178" in done.stdout
    tables = subprocess.run(
        [gensig, "modes", "system=engine_gear_train"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "215.97" in tables.stdout
    words = ["generate", "--quiet", "plan.n_records=1", "operating.duration_s=0.02", "out=data"]
    subprocess.run([gensig, *words], cwd=tmp_path, check=True, capture_output=True)
    assert subprocess.run([gensig, "verify", "data"], cwd=tmp_path, check=False, capture_output=True).returncode == 0
    helped = subprocess.run([python.parent / "diagnose", "--help"], cwd=tmp_path, capture_output=True, check=False)
    assert helped.returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data"]


def test_this_environment_finds_its_configuration(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "gensig.cli", "stiffness", "gear=xiamen_23_84"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "1.71178" in done.stdout
    assert list(tmp_path.iterdir()) == []
