"""Rates of making records on this machine: ``python -m benchmarks``.

Rates count CPU seconds of one core, the least of several runs; only the lines that say so count
wall time. Ratios are what compares between machines, and only those of one run. ``--json FILE``
writes all figures with the machine. What the lines mean: ``docs/howto/cluster.md``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence

from benchmarks import _end_to_end, _rates
from benchmarks._measure import begin, print_figures, write_json
from gensig.dynamics._vector import LANES, PRECISIONS, n_lanes
from gensig.dynamics.backends.nystroem.machine_lanes import group_kind
from gensig.dynamics.backends.nystroem.method import core_of

RECORD = "import gensig; gensig.load_system('solver.precision={}').simulate()"
PER_CORE = "simulated s per core-s"
TWO_STAGE = "two-stage box, compiled core {} x5"
RK45 = "solve_ivp RK45, NumPy around the compiled law"
KERNEL, RECORDS = "compiled core {} x5", "records per core-s"
# what was aimed at, as ratios in one run
GOALS = {
    "end to end over solve_ivp RK45": 2000.0,
    "share of the kernel's rate reached, float64": 0.6,
    "two workers over one, float64": 1.9,
}


def kernels(runs: int, precisions: Sequence[str] = PRECISIONS) -> dict[str, float]:
    """Rates of the integrators alone."""
    pairs = _rates.machines()
    lanes = [pair.dynamics for pair in pairs]
    eight = lanes[:LANES]
    works = {
        f"compiled core float64 x{oversampling}": _rates.kernel(eight, oversampling)
        for oversampling in (4, 5, 8)
    }
    works["compiled core float64 x5, one of the lanes in use"] = _rates.kernel(
        eight[:1], 5
    )
    if "float32" in precisions:
        works[KERNEL.format("float32")] = _rates.kernel(lanes, 5, "float32")
    boxes = _rates.two_stage_boxes()
    core = core_of(group_kind(boxes[0].equations))
    for precision in precisions:
        machines = boxes[: n_lanes(precision)]
        works[TWO_STAGE.format(precision)] = _rates.kernel(machines, 5, precision, core)
    works[RK45] = _rates.scipy_work(pairs[0])
    # they are short: many turns cost little, and one of them is undisturbed
    return _rates.rates(works, 4 * runs)


def start_up(runs: int, *, quick: bool) -> dict[str, float]:
    """Wall seconds of fresh processes; those that simulate are left out of a quick run."""

    def wall(code: str, **variables: str) -> float:
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-c", code], check=True, env={**os.environ, **variables}
        )
        return time.perf_counter() - start

    result = {
        "the interpreter alone": min(wall("pass") for _ in range(runs)),
        "import gensig": min(wall("import gensig") for _ in range(runs)),
    }
    if quick:
        return result
    result |= {
        "first record of 1 s, compiled code cached": min(
            wall(RECORD.format("float64")) for _ in range(runs)
        ),
    }
    with tempfile.TemporaryDirectory() as cache:
        result["first record of 1 s, nothing cached"] = wall(
            RECORD.format("float64"), NUMBA_CACHE_DIR=cache
        )
    return result


def ratios(
    rates: dict[str, float], ends: dict[str, dict[str, float]]
) -> dict[str, float]:
    """Ratios of rates, which compare between machines."""
    result = {}
    for precision in ends:
        pair = rates[KERNEL.format(precision)]
        box = rates[TWO_STAGE.format(precision)]
        result[f"pair over two-stage box, {precision}"] = pair / box
    end = ends["float64"][RECORDS]
    if "float32" in ends:
        result["float32 over float64, end to end"] = ends["float32"][RECORDS] / end
    result["end to end over solve_ivp RK45"] = end / rates[RK45]
    for precision, values in ends.items():
        result[f"share of the kernel's rate reached, {precision}"] = (
            values[RECORDS] / rates[KERNEL.format(precision)]
        )
        one, two = (values[_end_to_end.wall_name(workers)] for workers in (1, 2))
        result[f"two workers over one, {precision}"] = two / one
    return result


def _goal(name: str, value: float) -> str:
    goal = GOALS.get(name)
    if goal is None:
        return ""
    verdict = "reached"
    if not value >= goal:
        verdict = "missed"
    return f"{verdict}: {goal:g}"


def main() -> None:
    """Measure and print."""
    arguments, named, begun = begin("benchmarks", __doc__ or "")
    sections: dict[str, dict[str, float]] = {}

    def show(section: str, values: dict[str, float]) -> None:
        sections[section] = values
        print_figures(section, values)

    precisions, size = PRECISIONS, _end_to_end.WHOLE
    if arguments.quick:
        precisions, size = ("float64",), _end_to_end.QUICK
    show(f"integrators, {PER_CORE}", kernels(arguments.runs, precisions))
    rates, ends = sections[f"integrators, {PER_CORE}"], {}
    for precision in precisions:
        values = _end_to_end.by_stage(precision, arguments.runs, size=size)
        ends[precision] = values | _end_to_end.wall_rates(
            precision, 2, arguments.runs, size
        )
        show(
            f"gensig generate, {precision}, records of 1 s and four channels",
            ends[precision],
        )
    show("start-up, wall s", start_up(arguments.runs, quick=arguments.quick))
    sections["ratios"] = ratios(rates, ends)
    print("\nratios (goal)")
    for name, value in sections["ratios"].items():
        print(f"  {name:<64}{value:>12.4g}{_goal(name, value):>20}")
    print(f"\n{time.perf_counter() - begun:.0f} s")
    write_json(arguments.json, named, sections)


if __name__ == "__main__":
    main()
