"""``python -m benchmarks.ross``: gensig's mesh beside ROSS's, quantity by quantity.

Makes ROSS its own virtual environment (about 1.5 GB, kept for the next run), asks it for its
values, stores them with its version in ``tests/reference/data/ross.csv``, and prints both
programs' values as Markdown tables. What the differences come from: ``docs/validation.md``.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks import _gensig_values as ours
from gensig.execution.base import THREAD_VARIABLES

ROOT = Path(__file__).resolve().parent.parent
VALUES = ROOT / "tests" / "reference" / "data" / "ross.csv"
DISTRIBUTION, VERSION = "ross-rotordynamics", "2.3.0"
BESIDE = "plotly<6"  # ROSS asks for any plotly and breaks with 6
SHOWN = ("", "A", "C", "E", "cycle 0.025", "cycle 0.375", "cycle 0.875")
STEPS = (
    "mesh.elasticity=plane_strain",
    "mesh.tooth=to_centreline",
    "mesh.body=ring",
    "mesh.contact=weber",
    "mesh.pair_coupling=coupled",
    "mesh.law=one_sided",
)
SCALES = {
    "m/N": (1e12, "1e-12 m/N"),
    "N/m": (1e-8, "1e8 N/m"),
    "rad": (1.0, "rad"),
    "1": (1.0, ""),
}

StoredValues = dict[
    str, dict[tuple[str, str], tuple[float, str]]
]  # pair: (quantity, point): value, unit


class PeerError(Exception):
    """The peer could not be installed or run; said in one line."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; 0 when both programs gave their values."""
    options = _parser().parse_args(arguments)
    try:
        if not options.stored:
            python = make_environment(
                options.env, options.ross_version, shlex.split(options.pip_args)
            )
            run_ross(python, options.output)
        stored, version = read_values(options.output)
    except (PeerError, OSError) as error:
        print(f"benchmarks.ross: {error}", file=sys.stderr)
        return 1
    print(f"\nROSS {version}; ratios are gensig over ROSS\n")
    for pair, values in stored.items():
        print(
            "\n".join(
                [f"### {pair}", "", *comparison(pair, values, every=options.all), ""]
            )
        )
        print(
            "\n".join(
                [
                    "Body term with one of ROSS's choices at a time, ratio:",
                    "",
                    *body_evidence(pair, values),
                    "",
                ]
            )
        )
        print(
            "\n".join(
                [
                    "From the paper's terms to the default, one choice after the other:",
                    "",
                    *steps(pair),
                    "",
                ]
            )
        )
        print(
            "\n".join(
                [
                    "Where ROSS's mesh puts its contacts, curvature radii:",
                    "",
                    *path_evidence(pair),
                    "",
                ]
            )
        )
    return 0


def make_environment(folder: Path, version: str, pip_args: Sequence[str]) -> Path:
    """Interpreter of an environment that holds ROSS, made or completed where needed."""
    python = folder / (
        "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    )
    if (
        folder.exists()
        and any(folder.iterdir())
        and not (folder / "pyvenv.cfg").exists()
    ):
        raise PeerError(
            f"{folder} is not empty and no virtual environment; choose another folder with --env"
        )
    if not python.exists():
        _run(
            [sys.executable, "-m", "venv", str(folder)],
            f"no virtual environment could be made in {folder}",
        )
    asked = f"{DISTRIBUTION}=={version}"
    check = f"import importlib.metadata as m; assert m.version('{DISTRIBUTION}') == '{version}'"
    if (
        subprocess.run(
            [python, "-I", "-c", check], capture_output=True, check=False
        ).returncode
        != 0
    ):
        pip = [
            str(python),
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
        ]
        _run(
            [*pip, *pip_args, asked, BESIDE],
            f"pip could not install {asked}; see --pip-args, --ross-version",
        )
    return python


def run_ross(python: Path, output: Path) -> None:
    """Ask ROSS for its values of every pair and store them."""
    job = {pair: ours.job(ours.machine(pair, ours.PAPER)) for pair in ours.PAIRS}
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder) / "job.json", Path(folder) / "values.csv"
        asked.write_text(json.dumps(job))
        script = Path(__file__).with_name("_ross_values.py")
        _run(
            [str(python), "-I", str(script), str(asked), str(answered)],
            "ROSS gave no values",
        )
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_bytes(answered.read_bytes())


def read_values(path: Path) -> tuple[StoredValues, str]:
    """Stored values by pair, quantity and point, and ROSS's version."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    values: StoredValues = {}
    for row in rows:
        values.setdefault(row["pair"], {})[row["quantity"], row["point"]] = (
            float(row["value"]),
            row["unit"],
        )
    return values, rows[0]["ross_version"]


def comparison(
    pair: str, ross: dict[tuple[str, str], tuple[float, str]], *, every: bool
) -> Iterator[str]:
    """ROSS's value, gensig's by the paper's terms, the same with ROSS's choices put in, and
    gensig's default.
    """
    paper = ours.machine(pair, ours.PAPER)
    columns = (
        ours.gensig_values(paper),
        ours.ross_choices(paper),
        ours.gensig_values(ours.machine(pair)),
    )
    names = (
        "paper's terms",
        "ratio",
        "with ROSS's choices",
        "ratio",
        "default",
        "ratio",
    )
    yield from _head("quantity", "at", "unit", "ROSS", *names)
    for (quantity, point), (value, unit) in ross.items():
        if not every and point not in SHOWN:
            continue
        scale, unit_name = SCALES[unit]
        cells = [quantity, point, unit_name, f"{value * scale:.5g}"]
        for column in columns:
            result = column.get((quantity, point))
            cells += (
                ["", ""]
                if result is None
                else [f"{result * scale:.5g}", f"{result / value:.4f}"]
            )
        yield _line(cells)
    for quantity in ("mesh_stiffness", "mesh_stiffness_own_path"):
        keys = [(quantity, point) for point, _ in ours.phases()]
        value = float(np.mean([ross[key][0] for key in keys]))
        cells = [quantity, "mean", SCALES["N/m"][1], f"{value * 1e-8:.5g}"]
        for column in columns:
            result = float(np.mean([column[key] for key in keys]))
            cells += [f"{result * 1e-8:.5g}", f"{result / value:.4f}"]
        yield _line(cells)


def body_evidence(
    pair: str, ross: dict[tuple[str, str], tuple[float, str]]
) -> Iterator[str]:
    """Body term of the paper over ROSS's.

    As it stands, with ROSS's theta_f, with ROSS's u_f, with both.
    """
    system = ours.machine(pair, ours.PAPER)
    points = ours.positions(system.pair)
    choices = ("as it stands", "theta_f without c*", "u_f to the contact", "both")
    yield from _head("gear", "at", *choices)
    for gear, curvature in ours.sides(system.pair, np.array(list(points.values()))):
        result = [
            ours.foundation(
                gear, curvature, system, half_angle=half_angle, height=height
            )
            for height in (ours.centerline_height, ours.contact_height)
            for half_angle in (gear.root_half_angle, ours.ross_half_angle(gear))
        ]
        for index, point in enumerate(points):
            if point in SHOWN:
                value = ross[f"{gear.name}_foundation_compliance", point][0]
                yield _line(
                    [
                        gear.name,
                        point,
                        *(f"{values[index] / value:.4f}" for values in result),
                    ]
                )


def path_evidence(pair: str) -> Iterator[str]:
    """Curvature radii at the named shares of the path, and what their sum lacks to the length of
    the line of action.
    """
    gears = ours.machine(pair, ours.PAPER).pair
    points = ours.positions(gears)
    position = np.array(list(points.values()))
    (_, pinion), (_, wheel) = ours.sides(gears, position)
    own_pinion, own_wheel = ours.ross_path(
        ours.ross_rounding(gears), position / gears.path_of_contact
    )
    yield from _head(
        "at",
        "pinion, mm",
        "ROSS's pinion, mm",
        "wheel, mm",
        "ROSS's wheel, mm",
        "sum off by, mm",
    )
    for index, point in enumerate(points):
        radii = (pinion[index], own_pinion[index], wheel[index], own_wheel[index])
        off = own_pinion[index] + own_wheel[index] - gears.tangent_length
        yield _line(
            [point, *(f"{radius * 1e3:.3f}" for radius in radii), f"{off * 1e3:+.3f}"]
        )


def steps(pair: str) -> Iterator[str]:
    """Stiffness at C and mid in the double zone while the paper's choices give way to the
    default's.
    """
    yield from _head(
        "choice",
        "pair_stiffness at C, 1e8 N/m",
        "mesh_stiffness at cycle 0.375, 1e8 N/m",
    )
    chosen = list(ours.PAPER)
    for change in ("", *STEPS):
        key = change.partition("=")[0]
        chosen = [word for word in chosen if not word.startswith(f"{key}=")] + [
            change
        ] * bool(change)
        values = ours.gensig_values(ours.machine(pair, chosen))
        result = (
            values["pair_stiffness", "C"],
            values["mesh_stiffness", "cycle 0.375"],
        )
        yield _line(
            [change or "the paper's", *(f"{value * 1e-8:.4f}" for value in result)]
        )


def _head(*names: str) -> Iterator[str]:
    yield _line(names)
    yield "|" + "---|" * len(names)


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _run(command: Sequence[str], complaint: str) -> None:
    one_thread = {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1")}
    result = subprocess.run(
        command, capture_output=True, text=True, check=False, env=one_thread
    )
    if result.returncode != 0:
        lines = [
            line.strip() for line in result.stderr.splitlines() if line.strip()
        ] or ["no message"]
        said = next(
            (line for line in reversed(lines) if line.startswith("ERROR")), lines[-1]
        )
        raise PeerError(f"{complaint} ({said})")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.ross", description=__doc__.split("\n")[0]
    )
    parser.add_argument(
        "--env",
        type=Path,
        default=Path(tempfile.gettempdir()) / "gensig-peers" / ".venv-ross",
        help="folder of ROSS's virtual environment, about 1.5 GB (default: %(default)s)",
    )
    parser.add_argument(
        "--pip-args",
        default="",
        help='options for pip, for instance --pip-args="--no-cache-dir"',
    )
    parser.add_argument(
        "--ross-version",
        default=VERSION,
        help="release to install (default: %(default)s)",
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=VALUES,
        help="where ROSS's values are stored and read",
    )
    parser.add_argument(
        "--stored",
        action="store_true",
        help="compare with the stored values, without ROSS",
    )
    parser.add_argument(
        "--all",
        action="store_true",
        help="print every point, not only A, C, E and three of a cycle",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
