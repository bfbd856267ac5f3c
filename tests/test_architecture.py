"""Rules of the house that no linter of ``make check`` knows: import direction, size, plainness."""

import ast
import re
import subprocess
import sys
import tokenize
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).resolve().parent.parent
MOST_MODULES = 20  # of a folder
MOST_LINES = 500  # of a file
MOST_FUNCTION_LINES = 60  # of statements; kernels excepted
# Longer for a reason: one compiled loop over pairs and lanes.
LONG_FUNCTIONS = {"gensig/dynamics/_tables.py:gather"}
MOST_CONDITIONALS = 5  # conditional expressions per 1,000 lines
# Names, numbers, operators and texts. The house may not grow past these: a change that needs more
# says so by raising a number here, and one that deletes lowers it.
MOST_TOKENS = {"gensig": 446_000, "diagnose": 155_000, "tests": 533_000}
COUNTED = (tokenize.NAME, tokenize.NUMBER, tokenize.OP, tokenize.STRING)
# Private modules that modules of other folders know; none may be added.
BORROWED: dict[str, set[str]] = {}


def run(*command: str, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import gensig", ("numpy", "h5py", "hydra", "numba", "torch", "scipy")),
        ("import gensig.cli", ("numpy", "h5py", "hydra", "numba", "torch", "scipy")),
        (
            "import gensig.production.folder",
            ("torch", "sklearn", "hydra", "matplotlib"),
        ),
        (
            "import gensig.production.streaming",
            ("torch", "sklearn", "hydra", "matplotlib"),
        ),
        # half a second each, which the first record of a session would wait for
        (
            "import gensig.record.simulate",
            ("scipy.signal", "scipy.optimize", "scipy.stats", "scipy.interpolate"),
        ),
        ("import diagnose.data", ("numba", "gensig.systems", "gensig.mesh")),
    ],
)
def test_import_is_light(statement: str, absent: tuple[str, ...]) -> None:
    code = f"{statement}; import sys; print([name for name in {absent!r} if name in sys.modules])"
    result = run(sys.executable, "-c", code)
    assert result.stdout.strip() == "[]", result.stdout + result.stderr


# Allow-list: the folders of its own package that a folder or a module of the top level imports.
GENSIG = {
    "cli": "commands compilation terminal version",
    "commands": "arrays dataset driveline dynamics errors execution faults geometry implants life "
    "measured mesh operation options papers plan production record report signals systems terminal "
    "text twin units",
    "dataset": "arrays errors signals text version",
    "driveline": (
        "arrays dynamics errors faults geometry life material mesh operation options sensing "
        "systems text units"
    ),
    "dynamics": "arrays compilation errors geometry material mesh operation units",
    "execution": "errors options text",
    "faults": "arrays errors geometry units",
    "geometry": "arrays errors units",
    "implants": "arrays dataset errors execution production signals version",
    "life": "arrays errors faults geometry material mesh options units",
    "material": "errors units",
    "measured": "errors options signals text",
    "mesh": "arrays compilation errors geometry material options units",
    "operation": "arrays errors options text units",
    "options": "errors text units",
    "papers": "arrays driveline dynamics faults life operation options sensing signals systems "
    "text units",
    "plan": (
        "arrays dataset dynamics errors faults geometry life mesh operation options record "
        "systems units"
    ),
    "production": (
        "arrays compilation dataset dynamics errors execution faults options plan record "
        "sensing systems terminal text units version"
    ),
    "record": (
        "arrays dataset driveline dynamics errors faults geometry life operation options sensing "
        "systems units version"
    ),
    "report": "arrays dataset errors signals text",
    "sensing": "arrays dynamics errors faults geometry options signals text units",
    "signals": "arrays errors text",
    "systems": (
        "arrays dynamics errors faults geometry life material mesh operation options sensing "
        "units"
    ),
    "terminal": "errors options text",
    "text": "arrays errors",
    "twin": "arrays dynamics errors options plan record sensing signals systems text units",
    "units": "errors",
}
DIAGNOSE = {
    "baselines": "data networks scoring",
    "bridge": "data detection scoring settings studies training",
    "commands": "bridge data detectability detection progress recordings report settings "
    "studies training",
    "detectability": "workers",
    "detection": "data recordings",
    "networks": "data",
    "recordings": "baselines data networks report scoring studies training",
    "report": "baselines data scoring studies training",
    "scoring": "data networks",
    "settings": "baselines",
    "studies": "baselines data networks scoring settings training workers",
    "training": "data networks scoring settings",
}
# What diagnose imports of gensig: the reading side of data sets, processes, signals and words; no
# physics.
OF_GENSIG = {
    "dataset",
    "errors",
    "execution",
    "implants",
    "measured",
    "options",
    "signals",
    "terminal",
    "text",
    "version",
}
# Names that modules of one package may share; verbs of commands/ are named as they are typed.
SHARED_NAMES = {"__init__", "_kernels", "_layout", "base", "options", "registry"}


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("gensig", "diagnose", cache_dir=None)


def folder_imports(
    graph: grimp.ImportGraph, package: str, imported: str
) -> dict[str, set[str]]:
    """Folder of ``package`` -> folders of ``imported`` that its modules import, type-only imports
    included.
    """
    arrows: dict[str, set[str]] = {}
    for module in sorted(graph.modules):
        for other in graph.find_modules_directly_imported_by(module):
            source, target = module.split("."), other.split(".")
            if (
                source[0] == package
                and target[0] == imported
                and len(source) > 1
                and len(target) > 1
            ):
                arrows.setdefault(source[1], set()).add(target[1])
    return arrows


@pytest.mark.parametrize(
    ("package", "allowed"), [("gensig", GENSIG), ("diagnose", DIAGNOSE)]
)
def test_folders_import_what_they_may(graph, package, allowed) -> None:
    arrows = folder_imports(graph, package, package)
    result = {
        folder: others - {folder}
        for folder, others in arrows.items()
        if others - {folder}
    }
    assert result == {folder: set(names.split()) for folder, names in allowed.items()}


def test_diagnose_imports_no_physics(graph) -> None:
    assert (
        set().union(*folder_imports(graph, "diagnose", "gensig").values()) == OF_GENSIG
    )


def test_hydra_is_imported_by_the_options_alone(graph) -> None:
    source = re.compile(r"^\s*(?:from|import) (?:hydra|omegaconf)\b", re.MULTILINE)
    files = {
        path.relative_to(ROOT).parent.as_posix()
        for path in python_files()
        if source.search(path.read_text())
    }
    assert files == {"gensig/options"}


# modules of the standard library that some systems do not have
NOT_EVERYWHERE = {
    "curses",
    "fcntl",
    "grp",
    "posix",
    "pty",
    "pwd",
    "readline",
    "resource",
    "syslog",
    "termios",
    "tty",
}


def imports_at_once(text: str) -> set[str]:
    """Modules that a module imports when it is imported itself, so outside of its functions."""
    result: set[str] = set()
    waiting: list[ast.AST] = [ast.parse(text)]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            result |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            result.add((node.module or "").split(".")[0])
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            waiting.extend(ast.iter_child_nodes(node))
    return result


def test_every_module_can_be_imported_on_every_system() -> None:
    result = {
        path.relative_to(ROOT).as_posix(): names
        for path in python_files()
        if (names := imports_at_once(path.read_text()) & NOT_EVERYWHERE)
    }
    assert result == {}


@pytest.mark.parametrize(
    "text",
    [
        "import fcntl",
        "from resource import getrlimit",
        "import os, pwd",
        "try:\n    import termios\nexcept ImportError:\n    pass",
        "class A:\n    import grp",
    ],
)
def test_an_import_of_some_systems_only_is_seen(text: str) -> None:
    assert imports_at_once(text) & NOT_EVERYWHERE
    late = "def f():\n    " + text.replace("\n", "\n    ")
    assert not imports_at_once(late) & NOT_EVERYWHERE


def test_no_import_runs_in_a_circle(graph) -> None:
    arrows = {
        module: graph.find_modules_directly_imported_by(module)
        for module in graph.modules
    }
    assert len(list(TopologicalSorter(arrows).static_order())) == len(
        graph.modules
    )  # raises for a circle


def python_files() -> list[Path]:
    return [
        path
        for folder in ("gensig", "diagnose")
        for path in sorted((ROOT / folder).rglob("*.py"))
    ]


def test_no_file_is_too_long_to_hold() -> None:
    files = python_files()
    assert len(files) > 40
    lines = {path.relative_to(ROOT): path.read_text().count("\n") for path in files}
    assert {str(path): n for path, n in lines.items() if n > MOST_LINES} == {}


def is_kernel(path: Path) -> bool:
    """True for a module of compiled code, which is long where its formulas are."""
    return path.stem.startswith("_") and "kernel" in path.stem


def test_no_function_is_too_long_to_hold() -> None:
    long = {}
    for path in python_files():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef) and not is_kernel(path):
                length = node.end_lineno - body_start(node)
                if length > MOST_FUNCTION_LINES:
                    long[f"{path.relative_to(ROOT)}:{node.name}"] = length
    assert long.keys() == LONG_FUNCTIONS


def body_start(function: ast.FunctionDef) -> int:
    """Line where the statements of a function begin, after its docstring."""
    if ast.get_docstring(function) is None:
        return function.lineno
    return function.body[0].end_lineno


def test_conditional_expressions_are_few_and_never_nested() -> None:
    n_lines = n_conditionals = 0
    nested = []
    for path in python_files():
        text = path.read_text()
        n_lines += text.count("\n")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.IfExp):
                n_conditionals += 1
                inner = [child for child in ast.walk(node) if child is not node]
                if any(isinstance(child, ast.IfExp) for child in inner):
                    nested.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert nested == []
    assert 1000 * n_conditionals / n_lines <= MOST_CONDITIONALS


def test_docstrings_say_what_a_thing_is() -> None:
    asking = re.compile(r"(What|How|Where|Which|When|Whether)\b")
    result = []
    for path in python_files():
        for node in ast.walk(ast.parse(path.read_text())):
            has_docstring = isinstance(
                node, ast.FunctionDef | ast.ClassDef | ast.Module
            )
            if has_docstring and asking.match(ast.get_docstring(node) or ""):
                line = getattr(node, "lineno", 1)
                result.append(f"{path.relative_to(ROOT)}:{line}")
    assert result == []


@pytest.mark.parametrize("package", MOST_TOKENS)
def test_the_house_does_not_grow_unnoticed(package: str) -> None:
    tokens = 0
    for path in sorted((ROOT / package).rglob("*.py")):
        with path.open(encoding="utf-8") as file:
            kinds = [token.type for token in tokenize.generate_tokens(file.readline)]
        tokens += sum(kind in COUNTED for kind in kinds)
    assert 0.98 * MOST_TOKENS[package] < tokens <= MOST_TOKENS[package]


def test_private_modules_are_known_below_their_folder_alone(
    graph: grimp.ImportGraph,
) -> None:
    borrowed: dict[str, set[str]] = {}
    for module in sorted(graph.modules):
        for other in graph.find_modules_directly_imported_by(module):
            folder, _, name = other.rpartition(".")
            if name.startswith("_") and not module.startswith(f"{folder}."):
                borrowed.setdefault(module, set()).add(other)
    compiled = {module for module in borrowed if module.split(".")[-1].startswith("_")}
    assert {
        module: borrowed[module] for module in borrowed.keys() - compiled
    } == BORROWED


@pytest.mark.parametrize("package", ["gensig", "diagnose", "tests"])
def test_folders_are_small(package: str) -> None:
    folders = Counter(
        path.parent.relative_to(ROOT) for path in (ROOT / package).rglob("*.py")
    )
    assert folders
    assert {str(folder): n for folder, n in folders.items() if n > MOST_MODULES} == {}


@pytest.mark.parametrize("package", ["gensig", "diagnose"])
def test_module_names_are_unique(package: str) -> None:
    files = [
        path for path in (ROOT / package).rglob("*.py") if "commands" not in path.parts
    ]
    names = Counter(path.stem for path in files)
    assert {name for name, n in names.items() if n > 1} <= SHARED_NAMES


# the doors: what reaches a terminal is escaped, and no cell of a table is a formula
DOORS = {
    "gensig/terminal/printing.py": {"print"},
    "gensig/commands/new/asking.py": {"input"},  # questions of its own
    "gensig/text/csv_tables.py": {"csv.reader", "csv.writer"},
}
PRINTING = {"print", "input", "pprint.pprint", "rich.print", "sys.excepthook"}
STREAMS = {"sys.stdout", "sys.stderr", "sys.__stdout__", "sys.__stderr__"}
TABLES = {"csv.reader", "csv.writer", "csv.DictReader", "csv.DictWriter"}
ON_STREAMS = {"isatty", "flush"}


def past_the_doors(text: str) -> set[str]:
    """Names by which a module prints, or reads or writes CSV, by itself."""
    result = set()
    parents = {
        child: node
        for node in ast.walk(ast.parse(text))
        for child in ast.iter_child_nodes(node)
    }
    for node, parent in parents.items():
        name = ast.unparse(node) if isinstance(node, ast.Name | ast.Attribute) else ""
        called = isinstance(parent, ast.Call) and parent.func is node
        if called and name in PRINTING | TABLES:
            result.add(name)
        handled = isinstance(parent, ast.Attribute) and parent.attr in ON_STREAMS
        if name in STREAMS and not handled:
            result.add(name)
        if (
            called
            and name.endswith("to_csv")
            and not ast.unparse(parent).endswith("()")
        ):
            result.add(name)
    return result


def test_nothing_is_printed_and_no_table_written_past_the_doors() -> None:
    result = {}
    for path in python_files():
        name = path.relative_to(ROOT).as_posix()
        names = past_the_doors(path.read_text())
        if name == "gensig/terminal/printing.py":
            names -= STREAMS
        if names:
            result[name] = names
    assert result == DOORS


@pytest.mark.parametrize(
    "line",
    [
        "print('a')",
        "print('a', file=sys.stderr)",
        "sys.stdout.write('a')",
        "write = sys.stderr.write",
        "out = sys.stdout",
        "rows = csv.writer(file)",
        "csv.DictReader(file)",
        "frame.to_csv(path)",
    ],
)
def test_what_passes_a_door_is_seen(line: str) -> None:
    assert past_the_doors(line)
    assert not past_the_doors("sys.stdout.flush(); sys.stderr.isatty(); show('a')")
