"""Tests that should notice a change of a module, and their verdict in a copy of the tree.

The copy holds the files that git knows. Its folder stays between calls, so that Numba compiles
once. The files of the project itself are never written.
"""

from __future__ import annotations

import ast
import difflib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PACKAGES = ("gensig", "diagnose")
ORDER = "_given_order"  # the plugin beside this module
HELPERS = (ORDER, "_stale_cache")  # modules that tests in a copy can import
# Tests of the tree, of the pages and of the campaigns themselves.
LEFT_OUT = (
    "tests/test_architecture.py",
    "tests/unit/options/test_configuration_readers.py",
    "tests/unit/docs/",
    "tests/unit/test_benchmark_stages.py",
    "tests/unit/test_mutants.py",
    "tests/unit/dataset/test_fuzz.py",
    "tests/unit/dynamics/test_compiled_cache.py",
    "tests/pipeline/tools/test_bridge_tool.py",
    "tests/pipeline/test_crash_safety.py",
    "tests/pipeline/test_docs_python.py",
    "tests/pipeline/test_packaging.py",
    "tests/pipeline/test_readme.py",
    "tests/pipeline/tools/test_realism_tool.py",
    "tests/pipeline/test_tour.py",
)
COMMANDS = "tests/pipeline"
# begin of a package -> folder of its tests, which are not below tests/unit
FOLDERS = {
    "gensig/production": COMMANDS,
    "gensig/commands": f"{COMMANDS}/commands",
    "diagnose/detectability": f"{COMMANDS}/commands",
}
MOST_FILES = 20  # of tests for one mutant, the nearest first
FARTHEST = 3  # imports between a test and the mutated module, if a test is that near
MOST_IMPORTS = 7  # such as from a command to the module that draws its picture
ALIKE = (
    0.8  # likeness from which a test counts without imports, as its fixtures have them
)
SECONDS_A_TEST = 240  # a longer test hangs; the first may compile the kernels
SECONDS_A_MUTANT = 900  # for all its tests
KILLER = re.compile(r"^(?:FAILED|ERROR) (tests/\S+?\.py(?:::\w+)*)", re.MULTILINE)
NAMED = re.compile(rf"\b(?:{'|'.join(PACKAGES)})(?:\.\w+)+")  # a module in a text
ANY = "*"  # after a folder: any of its modules
PASSED, NO_TESTS, WRONG_USE = 0, 5, 4  # exit statuses of pytest


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Verdict of tests.

    Attributes
    ----------
    status : ``passed``, ``failed``, ``hung`` (one test took too long, or the process died) or
        ``unfinished`` (all passed until the time of the mutant was over)
    test : the first that failed; '' if none did
    seconds : wall time
    """

    status: str
    test: str
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """Copy of the tree of a project, in ``folder``; ``root`` is the project's own folder.

    ``seconds_a_test`` and ``seconds`` are the limits of one test and of one call of pytest.
    """

    root: Path
    folder: Path
    seconds_a_test: float = SECONDS_A_TEST
    seconds: float = SECONDS_A_MUTANT

    @property
    def tree(self) -> Path:
        """Folder of the copied files."""
        return self.folder / "tree"

    @property
    def _plugins(self) -> Path:
        """Folder of what this folder lends to the tests."""
        return self.folder / "plugins"

    def refresh(self) -> None:
        """Copy what has changed and remove what is gone; unchanged files keep their time."""
        self._plugins.mkdir(parents=True, exist_ok=True)
        for helper in HELPERS:
            shutil.copy(Path(__file__).with_name(f"{helper}.py"), self._plugins)
        names = files_of(self.root)
        for name in names:
            source, target = self.root / name, self.tree / name
            if target.exists() and target.read_bytes() == source.read_bytes():
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
            _forget(target)
        for path in self.tree.rglob("*.py"):
            if path.relative_to(self.tree).as_posix() not in names:
                path.unlink()
        where = self._python("-c", "import gensig, diagnose; print(gensig, diagnose)")
        if where.stdout.count(str(self.tree)) != len(PACKAGES):
            raise RuntimeError(f"the copy is not what is imported: {where.stdout}")

    @contextmanager
    def changed(self, name: str, text: str) -> Iterator[None]:
        """Another text of one file within the block."""
        path = self.tree / name
        original, times = path.read_bytes(), path.stat()
        try:
            path.write_text(text, encoding="utf-8")
            _forget(path)
            yield
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            _forget(path)

    def judge(self, tests: Sequence[str], *, all_of_them: bool = False) -> Outcome:
        """Verdict of test files or tests; ends at the first failure unless ``all_of_them``."""
        begin = time.monotonic()
        options = ["-q", "-rfE", "--no-header", "--tb=no", "-p", ORDER]
        options += ["-p", "no:cacheprovider"]
        if not all_of_them:
            options.append("-x")
        options += ["-o", f"faulthandler_timeout={self.seconds_a_test}"]
        options += ["-o", "faulthandler_exit_on_timeout=true"]
        done = self._python("-m", "pytest", *options, *tests)
        seconds = time.monotonic() - begin
        if done.returncode in (NO_TESTS, WRONG_USE):
            raise RuntimeError(f"pytest found no tests:\n{done.stdout}{done.stderr}")
        killer = KILLER.search(done.stdout)
        if done.returncode == PASSED:
            return Outcome(status="passed", test="", seconds=seconds)
        if killer is not None:
            return Outcome(status="failed", test=killer[1], seconds=seconds)
        status = "hung"
        if seconds > self.seconds:
            status = "unfinished"
        return Outcome(status=status, test="", seconds=seconds)

    def _python(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """An interpreter in the copy; it and its children end with the time of a mutant."""
        process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=self.tree,
            env=self._environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            out, error = process.communicate(timeout=self.seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, error = process.communicate()
        return subprocess.CompletedProcess(process.args, process.returncode, out, error)

    def _environment(self) -> dict[str, str]:
        """Variables under which the packages of the copy are imported, and compiled apart."""
        given = os.environ.get("PYTHONPATH", "").split(os.pathsep)
        others = [path for path in given if path and Path(path) != self.root]
        return {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(
                [str(self.tree), str(self._plugins), *others]
            ),
            "NUMBA_CACHE_DIR": str(self.folder / "numba"),
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }


def files_of(root: Path) -> set[str]:
    """Files of a project that git knows or would add, relative paths."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(
        command, cwd=root, capture_output=True, text=True, check=True
    )
    return {name for name in listed.stdout.split("\n") if (root / name).is_file()}


def _forget(path: Path) -> None:
    """Remove the bytecode of a file, which Python knows by whole seconds and size only."""
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink()


def nearest_tests(root: Path, name: str, function: str = "") -> list[str]:
    """Test files for a module, the most likely to notice a change first.

    Parameters
    ----------
    root : folder of the project
    name : path of the module, relative to it
    function : qualified name of what changes in it

    A file ranks by the imports between it and the module, by their names and folders, by its
    mention of the function or its class, and higher among the tests of the module's package.
    Tests of whole commands come last, unless they import the module themselves or have its name.
    Where no test is near, the nearest of the far ones count.
    """
    module, folder = _dotted(name), _folder_of_tests(name)
    package = "/".join(folder.split("/")[:3])  # such as tests/unit/dataset
    ranks = {}
    distances = {
        test: _distance(root, imported, module)
        for test, imported in _imports_of_tests(root).items()
        if not test.startswith(LEFT_OUT)
    }
    if "commands" in Path(name).parts:
        function = Path(name).stem  # a test of a command has the verb, not its function
    # a command is reached through the program of all commands, some of whose tests skip a step
    step = int(folder.startswith(COMMANDS))
    farthest = max(FARTHEST, min(distances.values(), default=FARTHEST) + step)
    for test, distance in distances.items():
        likeness = _likeness(test, name)
        is_far = distance > min(farthest, MOST_IMPORTS) and likeness < ALIKE
        # a figure or table of a command is drawn by many of its tests, however far
        if is_far and not (step and test.startswith(folder)):
            continue
        is_late = test.startswith(COMMANDS) and distance > 1
        is_late = is_late and not folder.startswith(COMMANDS) and likeness < ALIKE
        nearness = likeness + 1.0 / distance
        nearness += 1.0 * _mentions(root / test, function)
        nearness += 0.5 * Path(test).is_relative_to(package)
        ranks[test] = is_late, -nearness, test
    return sorted(ranks, key=lambda test: ranks[test])[:MOST_FILES]


def _likeness(test: str, name: str) -> float:
    """Likeness of the names and folders of a test file and a module, 0 to 1.5."""
    stem = Path(test).stem.removeprefix("test_")
    names = Path(name).stem, Path(name).parent.name
    alike = max(difflib.SequenceMatcher(None, stem, other).ratio() for other in names)
    return alike + 0.5 * Path(test).is_relative_to(_folder_of_tests(name))


def _folder_of_tests(name: str) -> str:
    """Folder of the tests of a module."""
    package = Path(name).parent
    for begin, folder in FOLDERS.items():
        if package.is_relative_to(begin):
            return folder
    return f"tests/unit/{package.as_posix().removeprefix('gensig/')}"


def _mentions(path: Path, function: str) -> bool:
    """True if a file has a part of a qualified name as a word."""
    words = set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    return not words.isdisjoint(part for part in function.split(".") if part)


@cache
def _imports_of_tests(root: Path) -> dict[str, frozenset[str]]:
    """Test file -> modules of the project that it imports, by itself or through its helpers."""
    folder = root / "tests"
    helpers = {path.stem: path for path in folder.rglob("*.py")}

    def reached(path: Path, seen: set[Path]) -> set[str]:
        names = set()
        for imported in _imports(path):
            if imported.split(".")[0] in PACKAGES:
                names.add(imported)
                continue
            helper = helpers.get(imported.rpartition(".")[2])
            if helper is not None and helper not in seen:
                seen.add(helper)
                names |= reached(helper, seen)
        return names

    result = {}
    for path in sorted(folder.rglob("test_*.py")):
        imported = reached(path, {path})
        # the one of all tests says nothing about the subject of a test
        of_folders = [each for each in path.parents if each.is_relative_to(folder)][:-1]
        for conftest in (each / "conftest.py" for each in of_folders):
            if conftest.exists():
                imported |= reached(conftest, {path})
        result[path.relative_to(root).as_posix()] = frozenset(imported)
    return result


@cache
def _imports_of_modules(root: Path) -> dict[str, frozenset[str]]:
    """Module of the project -> modules that it imports."""
    paths = {
        _dotted(path.relative_to(root).as_posix()): path
        for package in PACKAGES
        for path in (root / package).rglob("*.py")
    }
    imports = {}
    for module, path in paths.items():
        names = _imports(path)
        folders = tuple(name.removesuffix(ANY) for name in names if name.endswith(ANY))
        ends = frozenset(other for other in paths if other.startswith(folders))
        imports[module] = names | ends
    return imports


def _distance(root: Path, imported: frozenset[str], module: str) -> int:
    """Imports from a test to a module; 1 if it imports the module itself."""
    modules = _imports_of_modules(root)
    front, seen = set(imported), set(imported)
    for distance in range(1, MOST_IMPORTS + 1):
        if module in front:
            return distance
        front = {
            other
            for name in front
            for other in modules.get(name, ())
            if other not in seen
        }
        seen |= front
    return MOST_IMPORTS + 1


@cache
def _imports(path: Path) -> frozenset[str]:
    """Dotted names that a file imports, and those that may be modules of what it imports.

    Names in its texts count too: a child process, or a table of commands, imports by them.
    """
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            names |= set(NAMED.findall(node.value))
            if node.value.endswith(".") and NAMED.fullmatch(node.value[:-1]):
                names.add(node.value + ANY)  # begin of a name that is completed later
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


def _dotted(name: str) -> str:
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
