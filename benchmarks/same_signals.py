"""Bits of signals across versions: ``python -m benchmarks.same_signals [--quick]``.

Every setting is a Python, pinned packages or a processor with fewer instructions, each in a virtual
environment of its own. It makes the same records; their digests must be equal. `--only` names the
settings that run. Pythons that the machine lacks are left out and named. `--quick` makes one set
twice in this process. The exit status is 1 where bits differ.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import gensig
from benchmarks._measure import machine, print_machine, write_json

ROOT = Path(__file__).resolve().parents[1]
CHILD = "--child"
SHORT = ("operating.duration_s=0.1", "plan.n_records=5")
SETS = {
    "quickstart": ("experiment=quickstart", *SHORT),
    "realistic": ("experiment=realistic", *SHORT),
    "helical": ("experiment=helical", *SHORT),
    "two-stage": ("system=two_stage_gearbox", *SHORT),
}
NO_AVX512 = {
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "",
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Environment that makes the records.

    Attributes
    ----------
    python : command of the interpreter; '' for the one of this process
    pins : requirements beside gensig's own, in a new environment
    variables : environment variables, which hide instructions of the processor
    """

    python: str = ""
    pins: tuple[str, ...] = ()
    variables: Mapping[str, str] = field(default_factory=dict)


SETTINGS = {
    "this environment": Setting(),
    "without AVX-512": Setting(variables=NO_AVX512),
    "newest packages, Python 3.11": Setting(python="python3.11"),
    "newest packages, Python 3.12": Setting(python="python3.12"),
    "newest packages, Python 3.13": Setting(python="python3.13"),
    "NumPy 1.26": Setting(python="python3.11", pins=("numpy==1.26.*",)),
    "NumPy 2.0": Setting(python="python3.12", pins=("numpy==2.0.*",)),
    "NumPy 2.1": Setting(python="python3.11", pins=("numpy==2.1.*",)),
    "NumPy 2.2, SciPy 1.15": Setting(
        python="python3.13", pins=("numpy==2.2.*", "scipy==1.15.*")
    ),
}


def digest(words: Sequence[str]) -> str:
    """SHA-256 of the signals of a set."""
    records = gensig.stream(*words)
    result = hashlib.sha256()
    for number in range(len(records)):
        result.update(records[number].signals["acceleration"].tobytes())
    return result.hexdigest()


def made_in(setting: Setting) -> tuple[str, dict[str, str]]:
    """Versions of a setting, as one line, and its digests; each in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        python = sys.executable
        if setting.python:
            python = new_environment(setting, Path(folder))
        variables = {
            **os.environ,
            "NUMBA_CACHE_DIR": folder,
            "PYTHONPATH": str(ROOT),
            **setting.variables,
        }
        done = subprocess.run(
            [python, "-m", "benchmarks.same_signals", CHILD],
            env=variables,
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        )
    versions, *lines = done.stdout.splitlines()
    return versions, dict(line.split(": ") for line in lines)


def new_environment(setting: Setting, folder: Path) -> str:
    """Interpreter of a new environment with gensig's own requirements and the pins."""
    subprocess.run([setting.python, "-m", "venv", folder / "env"], check=True)
    python = str(folder / "env" / "bin" / "python")
    install = [python, "-m", "pip", "install", "-qq", "--editable", str(ROOT)]
    subprocess.run([*install, *setting.pins], check=True, capture_output=True)
    return python


def child() -> None:
    """Print the versions of this process and its digests."""
    found = machine()
    names = ("python", "numpy", "scipy", "numba", "h5py", "cpu_target")
    print(", ".join(f"{name} {found[name]}" for name in names))
    for name, words in SETS.items():
        print(f"{name}: {digest(words)}")


def chosen(arguments: argparse.Namespace) -> dict[str, Setting]:
    """Settings that run; those of a Python that is not here are left out and named."""
    names: Sequence[str] = arguments.only or list(SETTINGS)
    found = {}
    for name in names:
        python = SETTINGS[name].python
        if python and not has_interpreter(python):
            print(f"{name}: left out, there is no {python}")
            continue
        found[name] = SETTINGS[name]
    return found


def has_interpreter(command: str) -> bool:
    """True if the command is a Python that starts."""
    if not shutil.which(command):
        return False
    return not subprocess.run(
        [command, "-V"], check=False, capture_output=True
    ).returncode


def main() -> int:
    """Compare all settings with the first; exit status."""
    if sys.argv[1:2] == [CHILD]:
        child()
        return 0
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.same_signals",
        description=(__doc__ or "").split("\n")[0],
    )
    parser.add_argument("--only", nargs="+", choices=SETTINGS, help="these settings")
    parser.add_argument("--quick", action="store_true", help="one set, twice, here")
    parser.add_argument("--json", help="also write the digests to this file")
    arguments = parser.parse_args()
    named = machine()
    print_machine(named)
    if arguments.quick:
        made = {digest(SETS["quickstart"]) for _ in range(2)}
        print(f"quickstart: {', '.join(made)}")
        return int(len(made) > 1)
    found: dict[str, dict[str, str]] = {}
    for name, setting in chosen(arguments).items():
        versions, found[name] = made_in(setting)
        print(f"{name} ({versions})")
        for which, made in found[name].items():
            first = next(iter(found.values()))[which]
            print(
                f"  {which:<12}{made[:16]} {'equal' if made == first else 'OTHER BITS'}"
            )
    write_json(arguments.json, named, found)
    return int(any(made != next(iter(found.values())) for made in found.values()))


if __name__ == "__main__":
    sys.exit(main())
