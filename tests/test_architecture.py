"""The house rules that a machine can check: import direction, style, types."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def run(*command: str, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "command",
    [
        ("importlinter.cli", "lint-imports"),
        ("ruff", "check", "."),
        ("ruff", "format", "--check", "."),
        ("mypy",),
    ],
    ids=lambda command: " ".join(command),
)
def test_house_rule(command: tuple[str, ...]) -> None:
    if command[0] == "importlinter.cli":
        result = run(sys.executable, "-c", "from importlinter.cli import lint_imports_command as main; main()")
    else:
        result = run(sys.executable, "-m", *command)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import gensig", ("numpy", "h5py", "hydra", "numba", "torch", "scipy")),
        ("import gensig.cli", ("numpy", "h5py", "hydra", "numba", "torch", "scipy")),
        ("import gensig.generation", ("torch", "sklearn", "hydra", "matplotlib")),
        ("import gensig.streaming", ("torch", "sklearn", "hydra", "matplotlib")),
        # half a second each, which the first record of a session would wait for
        ("import gensig.records", ("scipy.signal", "scipy.optimize", "scipy.stats", "scipy.interpolate")),
        ("import diagnose.data", ("numba", "gensig.systems", "gensig.mesh")),
    ],
)
def test_import_is_light(statement: str, absent: tuple[str, ...]) -> None:
    code = f"{statement}; import sys; print([name for name in {absent!r} if name in sys.modules])"
    result = run(sys.executable, "-c", code)
    assert result.stdout.strip() == "[]", result.stdout + result.stderr


def test_no_file_is_too_long_to_hold() -> None:
    files = [path for folder in ("gensig", "diagnose") for path in (ROOT / folder).rglob("*.py")]
    assert len(files) > 40
    long = {str(path.relative_to(ROOT)): n for path in files if (n := len(path.read_text().splitlines())) > 400}
    assert not long
