"""How fast records are made on this machine: ``python -m benchmarks``.

Ratios are what compares between machines; every figure is the least of several runs in CPU seconds of one core.
``--json FILE`` writes them for comparison.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from gensig import records
from gensig.config import read_request
from gensig.dynamics import _kernels
from gensig.dynamics._kernels import law_at
from gensig.dynamics._mesh_kernels import N_LAW
from gensig.dynamics._vector import LANES
from gensig.dynamics.lanes import pack
from gensig.dynamics.pair import PairDynamics
from gensig.generation import open_shard
from gensig.planning import make_plan
from gensig.sensing.decimation import decimator
from gensig.systems import spur_pair
from gensig.systems.spur_pair import Run

SAMPLING_RATE = 51200.0
N_RECORDS = 16


def least(work: Callable[[], Any], runs: int) -> float:
    """Least CPU time of several runs, s."""
    found = []
    for _ in range(runs):
        start = time.process_time()
        work()
        found.append(time.process_time() - start)
    return min(found)


def kernel_rate(machines: list[PairDynamics], oversampling: int, runs: int) -> float:
    """Simulated seconds of all lanes per CPU second."""
    step, seconds = 1.0 / (SAMPLING_RATE * oversampling), 0.1
    group, n_steps = pack(machines, step), round(0.1 * SAMPLING_RATE * oversampling)
    state = np.zeros((2, 6, LANES))
    for lane, dynamics in enumerate(machines):
        state[0, :, lane] = dynamics.static_start(0.0)
    out, channels, work = np.empty(4 * n_steps * LANES), np.arange(4), _kernels.scratch(6, 4)
    flat, lost = state.ravel(), np.zeros(LANES)
    _kernels.integrate(group, flat, lost, np.ones(LANES), step, 0, 0, channels, out, *work)  # compiles
    return (
        len(machines)
        * seconds
        / least(
            lambda: _kernels.integrate(group, flat, lost, np.ones(LANES), step, 0, n_steps, channels, out, *work), runs
        )
    )


def scipy_rate(dynamics: PairDynamics, method: str, seconds: float) -> float:
    """Simulated seconds per CPU second of ``solve_ivp`` at rtol 1e-6 on the same equations and compiled law."""
    step = 1.0 / (SAMPLING_RATE * 5)
    group, system, direction = pack([dynamics], step), dynamics.system(), dynamics.approach_direction()
    work, near = _kernels.scratch(6, 1)
    motion, found = np.zeros(4 * LANES), np.zeros(N_LAW * LANES)
    radius, speed = dynamics.table.pair.pinion.base_radius, dynamics.operating.speed

    def slope(time_now: float, state: np.ndarray) -> np.ndarray:
        q, v = state[:6], state[6:]
        values = (dynamics.start_roll + radius * (speed * time_now + q[2]), direction @ q, direction @ v)
        motion.reshape(4, LANES)[:] = np.array([*values, radius * (speed + v[2])])[:, None]
        law_at(group, motion, work, near, found)
        normal, friction, moment_p, moment_w, along = found.reshape(N_LAW, LANES)[:5, 0]
        force = system.force - system.stiffness @ q - system.damping @ v - normal * direction
        force += np.array([friction, 0.0, moment_p + radius * along, -friction, 0.0, moment_w])
        return np.concatenate([v, force / system.mass])

    start = np.concatenate([dynamics.static_start(0.0), np.zeros(6)])
    slope(0.0, start)
    spent = least(
        lambda: solve_ivp(slope, (0.0, seconds), start, method=method, rtol=1e-6, atol=1e-12, max_step=2e-5), 1
    )
    return seconds / spent


def stages(config: dict[str, Any], rows: list[dict[str, Any]], runs: int) -> dict[str, float]:
    """CPU milliseconds of one record by stage, and in all; the twins of the noise included."""

    def machines() -> list[Run]:
        return [records._row_run(config, records.record_system(config, records._row_values(row)), row) for row in rows]

    def tables() -> None:
        spur_pair._mesh_table.cache_clear()
        for run in machines():
            run.dynamics()

    def everything() -> list[records.Record]:
        spur_pair._mesh_table.cache_clear()
        records.forget_twins()
        return records.simulate_records(config, rows)

    made = everything()
    params = [name.removeprefix("params/") for name in rows[0] if name.startswith("params/")]

    def writing() -> None:
        with (
            tempfile.TemporaryDirectory() as folder,
            open_shard(Path(folder) / "shard.h5", config, len(made), params) as writer,
        ):
            for place, record in enumerate(made):
                writer.write(place, record.signals, record.values)

    system = machines()[0].system
    low_pass = decimator(system.solver.oversampling)
    n_steps = (round(SAMPLING_RATE * system.operating.duration) + 2 * low_pass.margin) * system.solver.oversampling + 1
    means = np.zeros((4, n_steps, LANES))
    scale = 1e3 / len(rows)
    return {
        "tables": least(tables, runs) * scale,
        "low_pass": least(lambda: low_pass.apply(means), runs) * 1e3 / LANES,
        "writing": least(writing, runs) * scale,
        "all": least(everything, runs) * scale + least(writing, 1) * scale,
    }


def start_up() -> dict[str, float]:
    """Wall seconds of ``import gensig`` and of a first short record in a fresh process with a warm cache."""
    record = "import gensig; gensig.load_system('operating.duration_s=0.05').simulate()"
    found = {}
    for name, code in (("import", "import gensig"), ("first record", record)):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        found[name] = time.perf_counter() - start
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="the least of so many (default 3)")
    parser.add_argument("--json", help="also write the figures to this file")
    arguments = parser.parse_args()
    config = read_request(["experiment=quickstart", f"plan.n_records={N_RECORDS}"]).config
    plan = make_plan(config)
    rows = [plan.record(place) for place in range(N_RECORDS)]
    machines = [
        records._row_run(config, records.record_system(config, records._row_values(row)), row).dynamics()
        for row in rows[:LANES]
    ]
    found: dict[str, Any] = {"machine": platform.processor() or platform.machine(), "python": platform.python_version()}
    for oversampling in (4, 5, 8):
        found[f"kernel x{oversampling}, simulated s per core-s"] = kernel_rate(machines, oversampling, arguments.runs)
    found["kernel x5, one lane in use"] = kernel_rate(machines[:1], 5, arguments.runs)
    for method in ("RK45", "DOP853"):
        found[f"solve_ivp {method}, simulated s per core-s"] = scipy_rate(machines[0], method, 0.01)
    spent = stages(config, rows, arguments.runs)
    found.update({f"record of 1 s x 4 channels, CPU ms: {name}": value for name, value in spent.items()})
    found["records per core-s, end to end"] = 1e3 / spent["all"]
    found.update({f"start-up, s: {name}": value for name, value in start_up().items()})
    for name, value in found.items():
        print(f"{name:<56}{value:>12.4g}" if isinstance(value, float) else f"{name:<56}{value:>12}")
    if arguments.json:
        Path(arguments.json).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
