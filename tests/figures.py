"""Pictures of the documentation, drawn anew by the commands of ``docs/figures/commands.txt``.

python -m tests.figures [NAME ...]      # or: make figures
"""

import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "figures"
COMMANDS = FOLDER / "commands.txt"


def commands() -> dict[str, list[str]]:
    """Words of the command that draws each picture, by its path below ``docs/figures``."""
    lines = COMMANDS.read_text(encoding="utf-8").splitlines()
    pairs = [line.partition(": ") for line in lines if not line.startswith("#")]
    return {name: shlex.split(command) for name, _, command in pairs}


def draw(name: str, words: Sequence[str]) -> None:
    """Run one command in a folder of its own and keep its picture."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(sys.executable).with_name(words[0])
        subprocess.run([program, *words[1:]], cwd=folder, check=True)
        shutil.copyfile(Path(folder) / Path(name).name, FOLDER / name)


def main(wanted: Sequence[str]) -> int:
    """Draw the wanted pictures, all where none is named."""
    known = commands()
    unknown = [name for name in wanted if name not in known]
    if unknown:
        print(f"no picture {', '.join(unknown)}; there are {', '.join(known)}")
        return 2
    for name in wanted or known:
        print(name, flush=True)
        draw(name, known[name])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
