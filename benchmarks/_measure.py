"""Parts that all benchmarks share.

Name of the machine, least of several runs, file for the figures.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from llvmlite.binding import get_host_cpu_name

from gensig.dataset.folder.environment import environment

Figures = Mapping[str, Mapping[str, float]]  # section: name: value


def machine() -> dict[str, Any]:
    """Processor, cores, how busy they are already, and the versions of what runs."""
    usable = (
        len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count()
    )
    load = round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None
    return {
        **environment(),
        "cpu_target": get_host_cpu_name(),
        "cores": usable,
        "load_at_start": load,
    }


def print_machine(found: Mapping[str, Any]) -> None:
    """One line of the machine, one of the versions, and a warning where others keep it busy."""
    print(
        f"{found['cpu_model']} ({found['cpu_target']}), {found['cores']} cores, load "
        f"{found['load_at_start']} at start"
    )
    print(
        ", ".join(
            f"{name} {found[name]}"
            for name in ("python", "numpy", "numba", "scipy", "h5py", "gensig")
        )
    )
    if (found["load_at_start"] or 0.0) > 0.5:
        print(
            "This machine is busy with something else: all rates are too low, ratios are rough."
        )


def least(work: Callable[[], Any], runs: int) -> float:
    """Least CPU time of several runs, s."""
    return in_turn({"": work}, runs)[""]


def begin(program: str, about: str) -> tuple[argparse.Namespace, dict[str, Any], float]:
    """``--runs``, ``--json`` and ``--quick``, the machine, which is printed, and when it began."""
    parser = argparse.ArgumentParser(
        prog=f"python -m {program}", description=about.split("\n")[0]
    )
    parser.add_argument(
        "--runs", type=int, default=3, help="the least of so many (default 3)"
    )
    parser.add_argument("--json", help="also write the figures to this file")
    add_quick(parser)
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.runs = 1
    named, begun = machine(), time.perf_counter()
    print_machine(named)
    return arguments, named, begun


def add_quick(parser: argparse.ArgumentParser) -> None:
    """The flag ``--quick``: the least work that passes through all that a benchmark does."""
    parser.add_argument(
        "--quick",
        action="store_true",
        help="one run of the least work: shows that all of it runs, figures mean nothing",
    )


def in_turn(works: Mapping[str, Callable[[], Any]], runs: int) -> dict[str, float]:
    """Least CPU time of each work, s.

    They take turns, so that what disturbs the machine for a while disturbs all.
    """
    result = dict.fromkeys(works, math.inf)
    for _ in range(runs):
        for name, work in works.items():
            start = time.process_time()
            work()
            result[name] = min(result[name], time.process_time() - start)
    return result


def print_figures(
    section: str, values: Mapping[str, float], *columns: Callable[[float], str]
) -> None:
    """One section of a table; further columns are functions of the value."""
    print(f"\n{section}")
    for name, value in values.items():
        cells = "".join(f"{column(value):>20}" for column in columns)
        print(f"  {name:<64}{value:>12.4g}{cells}", flush=True)


def write_json(path: str | None, named: Mapping[str, Any], figures: Figures) -> None:
    """The machine and the figures, to compare runs by; no file without a path."""
    if path:
        Path(path).write_text(
            json.dumps({"machine": named, **figures}, indent=1) + "\n", encoding="utf-8"
        )
