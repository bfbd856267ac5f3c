"""A source distribution and a wheel of this tree, and all tests run with that wheel.

    python -m tests.wheel [options of pytest]      # or: make wheel-test

The tests run from an unpacked source distribution without its packages. Their imports and options
are those of the wheel.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import venv
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "gensig": "gensig",
    "diagnose": "diagnose",
    "configs": "gensig/configs",
}  # folder here -> folder installed
# they look at the tree, which the house rules judge and from which the wheel is made
OF_THE_TREE = (
    "tests/test_architecture.py",
    "tests/unit/options/test_configuration_readers.py",
    "tests/pipeline/test_packaging.py",
    "tests/unit/docs/test_docs_pages.py",
)
# gensig is that of the wheel, and so is the cache of Numba
ENVIRONMENT = {
    key: value
    for key, value in os.environ.items()
    if key not in ("PYTHONPATH", "NUMBA_CACHE_DIR")
}
BACKEND = (
    "import sys; from setuptools import build_meta; "
    "print(getattr(build_meta, sys.argv[1])(sys.argv[2]))"
)


def files_of_the_tree() -> list[str]:
    """Files of the project by git, or by the list of a source distribution; relative paths."""
    if (ROOT / ".git").exists():
        command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.split("\n")
    else:
        names = (
            (ROOT / "gensig.egg-info" / "SOURCES.txt")
            .read_text(encoding="utf-8")
            .split("\n")
        )
        names = [name for name in names if not name.startswith("gensig.egg-info")]
    return sorted(name for name in names if name and (ROOT / name).is_file())


def build_sdist(folder: Path) -> Path:
    """The source distribution, built from a copy of the files of the tree alone."""
    source = folder / "source"
    for name in files_of_the_tree():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_bytes((ROOT / name).read_bytes())
    return build("build_sdist", source, folder)


def unpack(sdist: Path, folder: Path) -> Path:
    """The folder in which a source distribution lies unpacked."""
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    return folder / sdist.name.removesuffix(".tar.gz")


def build_wheel(source: Path, folder: Path) -> Path:
    """The wheel of an unpacked source distribution."""
    return build("build_wheel", source, folder)


def build(kind: str, source: Path, folder: Path) -> Path:
    """Build a source tree with the setuptools of this environment and return the file."""
    command = [sys.executable, "-c", BACKEND, kind, str(folder)]
    done = subprocess.run(
        command, cwd=source, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{kind} failed:\n{done.stdout}{done.stderr}")
    return folder / done.stdout.split()[-1]


def environment_with(wheel: Path, folder: Path) -> Path:
    """Interpreter of a fresh environment: the wheel, and everything else from this environment."""
    venv.create(folder / "env")
    python = folder / "env" / "bin" / "python"
    command = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        str(python),
        "install",
        "--quiet",
        "--no-deps",
        "--no-compile",
    ]
    subprocess.run(
        [*command, str(wheel)], check=True, capture_output=True, env=ENVIRONMENT
    )
    # A path line does not read the .pth files of its folder, so the editable gensig stays unseen.
    (site_packages(python) / "test_environment.pth").write_text(
        sysconfig.get_paths()["purelib"] + "\n"
    )
    return python


def lend_compiled(python: Path) -> None:
    """Copy the compiled kernels of this environment to the wheel, whose files are the same."""
    from gensig.driveline.time._newmark_kernels import advance
    from gensig.dynamics._record_kernels import low_pass
    from gensig.dynamics.backends.nystroem._pairs import take_pairs
    from gensig.mesh._kernels import lower_envelope
    from gensig.mesh.sliced._slice_kernels import solve_slices

    for kernel in (advance, low_pass, take_pairs, lower_envelope, solve_slices):
        original = Path(kernel.__code__.co_filename).parent
        package = site_packages(python) / original.relative_to(ROOT)
        for source in original.glob("*.py"):
            # the cache knows a file by its time and size
            shutil.copystat(source, package / source.name)
        (package / "__pycache__").mkdir(exist_ok=True)
        for compiled in Path(kernel.stats.cache_path).glob("*.nb[ci]"):
            shutil.copy(compiled, package / "__pycache__")


def site_packages(python: Path) -> Path:
    """Folder of the packages of an interpreter's environment."""
    code = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    return Path(
        subprocess.run(
            [python, "-c", code], capture_output=True, text=True, check=True
        ).stdout.strip()
    )


def take_packages_out(source: Path, python: Path) -> None:
    """Remove the packages of an unpacked source distribution; its options become the wheel's."""
    for folder in PACKAGES:
        shutil.rmtree(source / folder)
    (source / "configs").symlink_to(site_packages(python) / PACKAGES["configs"])


def run_tests(
    source: Path, python: Path, arguments: Sequence[str], environment: Mapping[str, str]
) -> int:
    """Exit status of pytest in a source distribution without packages."""
    code = "import gensig, diagnose; print(gensig.__file__, diagnose.__file__)"
    command = [python, "-c", code]
    paths = subprocess.run(
        command, cwd=source, env=environment, capture_output=True, text=True, check=True
    ).stdout
    if not all(path.startswith(str(site_packages(python))) for path in paths.split()):
        raise RuntimeError(f"these are not the packages of the wheel: {paths}")
    ignored = [f"--ignore={name}" for name in OF_THE_TREE]
    return subprocess.run(
        [python, "-m", "pytest", *ignored, *arguments], cwd=source, env=environment
    ).returncode


def main(arguments: Sequence[str]) -> int:
    """Build, install and test; the exit status is that of pytest."""
    with tempfile.TemporaryDirectory(prefix="gensig-wheel-") as name:
        folder = Path(name)
        source = unpack(build_sdist(folder), folder)
        python = environment_with(build_wheel(source, folder), folder)
        lend_compiled(python)
        take_packages_out(source, python)
        return run_tests(source, python, arguments, ENVIRONMENT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
