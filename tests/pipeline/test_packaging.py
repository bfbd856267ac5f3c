"""Source distribution and wheel: their files, and the wheel at work in any folder."""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile

import pytest

from tests.wheel import (
    ENVIRONMENT,
    PACKAGES,
    ROOT,
    build_sdist,
    build_wheel,
    environment_with,
    files_of_the_tree,
    lend_compiled,
    run_tests,
    take_packages_out,
    unpack,
)

RECORD = ["generate", "--quiet", "plan.n_records=1", "operating.duration_s=0.02"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]
# the places that tell whoever lacks a package which extra brings it
TELLS_EXTRA = r"""install\(["'](\w+)["']\)|'\.\[(\w+)\]'|the extra `?(\w+)[`):]"""
NOT_FOR_COMMANDS = {
    "all",
    "test",
    "docs",
    "fem",
}  # extras that serve the project itself

TYPED = """
from typing import assert_type

import gensig
from gensig.dataset.reader import Dataset
from gensig.production.streaming import RecordStream

with gensig.open_dataset("runs/quick") as data:
    assert_type(data, Dataset)
    names: list[str] = data.class_names
    n_channels: int = data.signals(0).shape[0]
    parts = data.split("by_unit")
    assert_type(parts["train"][0], tuple[int, float, float])
made: Dataset = gensig.generate("fault=crack", out="runs/own")
stream = gensig.stream("experiment=quickstart", epoch=1)
assert_type(stream, RecordStream)
labels = [record.values["label_name"] for record in stream]
system = gensig.load_system("fault=healthy", "operating.torque_nm=40")
mean: float = float(system.stiffness_curves().mesh_stiffness.mean())
ratio: float = system.pair.transverse_contact_ratio
"""
MISTYPED = """
import gensig

gensig.open_dataset(3)
gensig.load_system("fault=healthy").pear
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("packages")


@pytest.fixture(scope="module")
def source(folder):
    """An unpacked source distribution of this tree."""
    return unpack(build_sdist(folder), folder)


@pytest.fixture(scope="module")
def wheel(source, folder):
    """The wheel that the source distribution makes."""
    return build_wheel(source, folder)


@pytest.fixture(scope="module")
def python(wheel, folder):
    """Interpreter of a fresh environment: our wheel, everything else from the test environment."""
    python = environment_with(wheel, folder)
    lend_compiled(python)
    return python


def test_source_distribution_holds_the_whole_tree(source):
    assert {
        name for name in files_of_the_tree() if not (source / name).is_file()
    } == set()


def test_wheel_holds_the_packages_and_nothing_else(wheel):
    parts = [name.split("/", 1) for name in files_of_the_tree()]
    packaged = [part for part in parts if part[0] in PACKAGES]
    expected = {f"{PACKAGES[folder]}/{name}" for folder, name in packaged}
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    files = {name for name in names if ".dist-info/" not in name}
    assert files == expected
    notes = {name.split("/", 1)[1] for name in names - files}
    assert {"licenses/LICENSE", "licenses/THIRD-PARTY.md", "entry_points.txt"} < notes
    typed = {"gensig/py.typed", "diagnose/py.typed"}
    assert {*typed, "gensig/configs/generate.yaml"} < files


def test_wheel_runs_from_another_folder(python, tmp_path):
    def run(program, *words):
        command = [python.parent / program, *words]
        options = {"cwd": tmp_path, "env": ENVIRONMENT, "text": True}
        done = subprocess.run(command, capture_output=True, **options)
        assert done.returncode == 0, done.stderr
        return done.stdout

    code = (
        "import gensig, gensig.configs, diagnose; "
        "print(gensig.__file__, gensig.configs.__file__, diagnose.__file__)"
    )
    paths = run("python", "-W", "error", "-c", code).split()
    assert all(path.startswith(str(python.parents[1])) for path in paths)
    run("gensig", *RECORD, "out=data")
    run("gensig", "verify", "data")
    run("diagnose", "--help")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data"]


def interpreters():
    """Commands of the supported Pythons that this machine has."""
    found = []
    for text in PROJECT["classifiers"]:
        if match := re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", text):
            command = shutil.which(f"python{match[1]}")
            if command and not subprocess.run([command, "-V"], check=False).returncode:
                found.append(pytest.param(command, id=match[1]))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("command", interpreters())
def test_wheel_alone_makes_a_record_without_torch(command, wheel, tmp_path):
    """Installed by pip with what it asks for, and nothing else; needs a package index."""

    def run(*words, status=0):
        options = {"cwd": tmp_path, "env": ENVIRONMENT, "text": True}
        done = subprocess.run(words, capture_output=True, check=False, **options)
        assert done.returncode == status, done.stderr
        return done.stdout + done.stderr

    run(command, "-m", "venv", "env")
    programs = tmp_path / "env" / "bin"
    run(programs / "python", "-m", "pip", "install", "--quiet", wheel)
    run(programs / "gensig", *RECORD, "out=data")
    run(programs / "gensig", "verify", "data")
    listed = run(programs / "python", "-m", "pip", "list", "--format=freeze").lower()
    assert not re.search(r"^(torch|nvidia|scikit.learn|safetensors)", listed, re.M)
    told = run(programs / "diagnose", "train", "data=data", "out=report", status=2)
    assert told.count("\n") == 1
    assert f"install '{wheel}[diagnose]'" in told


def test_tests_run_from_the_wheel(source, python):
    """A file of them; `make wheel-test` runs all."""
    take_packages_out(source, python)
    assert (
        run_tests(
            source,
            python,
            ["-q", "-p", "no:cacheprovider", "tests/unit/test_units.py"],
            ENVIRONMENT,
        )
        == 0
    )


def test_types_reach_those_who_use_the_wheel(python, tmp_path):
    (tmp_path / "typed.py").write_text(TYPED)
    (tmp_path / "mistyped.py").write_text(MISTYPED)
    options = "--follow-imports=silent --cache-dir cache typed.py mistyped.py"
    command = [sys.executable, "-m", "mypy", "--python-executable", str(python)]
    shown = subprocess.run(
        [*command, *options.split()],
        cwd=tmp_path,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    ).stdout
    errors = re.findall(r"^(\S+) error: ", shown, flags=re.MULTILINE)
    assert errors == ["mistyped.py:4:", "mistyped.py:5:"], shown


def test_all_is_every_extra_that_a_command_asks_for():
    extras = PROJECT["optional-dependencies"]
    of_commands = [name for name in extras if name not in NOT_FOR_COMMANDS]
    needed = {line for name in of_commands for line in extras[name]}
    # tests try them
    assert needed <= {*extras["test"], *extras["diagnose"], "torch>=2.6"}
    assert extras["all"] == [f"gensig[{','.join(of_commands)}]"]
    named = set()
    for name in ("gensig", "diagnose", "configs", "docs"):
        for path in (ROOT / name).rglob("*"):
            if path.suffix in (".py", ".yaml", ".md"):
                text = path.read_text(encoding="utf-8")
                named |= {"".join(found) for found in re.findall(TELLS_EXTRA, text)}
    # whoever lacks a package is told the extra that brings it
    assert set(of_commands) <= named <= set(extras)
