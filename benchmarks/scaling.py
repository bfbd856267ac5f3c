"""Growth of cost and memory: ``python -m benchmarks.scaling``.

CPU seconds of one core, the least of several runs, against the duration of records, their
number, the number of distinct teeth, and the degrees of freedom; peak memory of the processes
that make a data set, against its size. ``--json FILE`` writes the figures.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks._measure import begin, in_turn, print_figures, write_json
from gensig.dynamics._vector import LANES
from gensig.errors import SimulationError
from gensig.execution.local import LocalExecutor
from gensig.faults.registry import read_faults
from gensig.mesh.load_distribution import sound_load
from gensig.plan.request import read_request
from gensig.production.folder import begin_folder, run_folder
from gensig.production.shard_writing import write_shard
from gensig.systems import pair_machine
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import running_pair
from gensig.systems.registry import read_system
from gensig.systems.run import Run, Start


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """Durations in s, records of short sets and of long ones, and teeth that are gone through."""

    durations: tuple[float, ...]
    counts: tuple[int, ...]
    long_counts: tuple[int, ...]
    teeth: tuple[int, ...]


WHOLE = Sizes(
    durations=(0.05, 0.16, 0.5, 1.6, 5.0, 16.0, 50.0),
    counts=(8, 80, 800, 8000),
    long_counts=(80, 800, 8000),
    teeth=(1, 2, 4, 8, 16, 23),
)
QUICK = Sizes(durations=(0.05, 0.1), counts=(8,), long_counts=(8,), teeth=(1, 2))
QUICKSTART = ("experiment=quickstart", "dataset.records_per_shard=null")
# without twins, whose number depends on how records fall into shards, and with little settling
SHORT = (
    "operating.duration_s=0.02",
    "operating.drive_frequency_hz=50",
    "sensing.channels=[pinion_y]",
    "sensing.snr_reference=record",
    "plan.n_units=4",
)
LONG = ("operating.duration_s=1",)
ROTORS = {6: (), 7: ("system.motor.inertia_kg_m2=1e-3",)}
ROTORS[8] = (*ROTORS[7], "system.load.inertia_kg_m2=1e-2")
# a process of its own makes a data set, or of a planned one the first shard, as a worker does
ALONE = "import sys; from benchmarks import scaling; scaling.{}(*sys.argv[1:])"


def peak_memory() -> int:
    """Most bytes of memory that this process ever held."""
    status = Path("/proc/self/status")
    # what getrusage tells is that of the process that started this one, if it held more
    if status.exists():
        lines = status.read_text(encoding="utf-8").splitlines()
        return next(
            int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:")
        )
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (
        1 if sys.platform == "darwin" else 1024
    )


def make_set(n_records: str, *words: str) -> None:
    """Print the CPU seconds of a data set, from its plan to its last byte, and the peak memory.

    For a process alone.
    """
    with tempfile.TemporaryDirectory() as folder:
        _begin(Path(folder) / "warm", "8", *words)
        _finish(Path(folder) / "warm")
        begun = time.process_time()
        _begin(Path(folder) / "set", n_records, *words)
        _finish(Path(folder) / "set")
        print(json.dumps([time.process_time() - begun, peak_memory()]))


def make_plan(n_records: str, out: str, *words: str) -> None:
    """Begin a data set and print the CPU seconds and the peak memory; for a process alone."""
    begun = time.process_time()
    _begin(Path(out), n_records, *words)
    print(json.dumps([time.process_time() - begun, peak_memory()]))


def make_shard(out: str) -> None:
    """Make the first shard of a data set and print the CPU seconds and the peak memory.

    For a process alone.
    """
    begun = time.process_time()
    write_shard(Path(out), 0)
    print(json.dumps([time.process_time() - begun, peak_memory()]))


def _begin(out: Path, n_records: str, *words: str) -> None:
    request = read_request([*words, f"plan.n_records={n_records}"])
    begin_folder(request.config, request.overrides, out)


def _finish(out: Path) -> None:
    n_failed, problems = run_folder(
        out, executor=LocalExecutor(n_workers=1), on_shard=lambda _: None
    )
    if n_failed or problems:
        raise SimulationError(f"{n_failed} records failed, problems: {problems}")


def alone(what: Callable[..., None], *given: str) -> tuple[float, float]:
    """CPU seconds and peak bytes that a function of this module prints in a process of its own."""
    command = [sys.executable, "-c", ALONE.format(what.__name__), *given]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    seconds, peak = json.loads(told.splitlines()[-1])
    return seconds, peak


def side_by_side(*words: str, channels: str = "[pinion_y]") -> list[Run]:
    """A group's records of one machine, each from a start of its own."""
    config = read_request([f"sensing.channels={channels}", *words]).config
    system, faults = read_system(config), tuple(read_faults(config["fault"]))
    starts = [
        Start(tooth_pinion=lane, tooth_wheel=lane, phase=0.0) for lane in range(LANES)
    ]
    return [Run(system=system, faults=faults, start=start) for start in starts]


def simulate(runs: Sequence[Run]) -> None:
    """Simulate, and refuse what failed."""
    for record in simulate_together(runs):
        if isinstance(record, SimulationError):
            raise record


def against_duration(runs: int, sizes: Sizes) -> dict[str, float]:
    """CPU seconds of a group by duration, and how far from a straight line with a constant for the
    settling.
    """
    group, works = side_by_side(), {}
    for duration in sizes.durations:
        operating = replace(group[0].system.operating, duration=duration)
        timed = [
            replace(run, system=replace(run.system, operating=operating))
            for run in group
        ]
        works[f"{duration:g} s"] = partial(simulate, timed)
    simulate(group)
    result = in_turn(works, runs)
    return {
        **result,
        **straight("second", sizes.durations, list(result.values()), LANES),
    }


def straight(
    unit: str, sizes: Sequence[float], found: Sequence[float], per: int = 1
) -> dict[str, float]:
    """Constant and slope of the line through measured costs, and the largest relative distance
    from it.
    """
    x, y = np.asarray(sizes, dtype=np.float64), np.asarray(found)
    (constant, slope), *_ = np.linalg.lstsq(
        np.stack([1.0 / y, x / y], axis=1), np.ones_like(y), rcond=None
    )
    return {
        f"straight line through all: for no {unit}, ms": constant / per * 1e3,
        f"straight line through all: for each {unit} more, ms": slope / per * 1e3,
        "largest distance from that line, %": 100.0
        * float(np.abs((constant + slope * x) / y - 1.0).max()),
    }


def against_number(runs: int, sizes: Sizes) -> dict[str, float]:
    """CPU milliseconds a record by the number of records of a data set, made by one process from
    plan to index.
    """
    result = []
    for n_records in sizes.counts:
        told = [
            alone(make_set, str(n_records), *QUICKSTART, *SHORT)
            for _ in range(runs if n_records < 1000 else 1)
        ]
        result.append(min(spent for spent, _ in told))
    values = {
        f"{n} short records": spent / n * 1e3
        for n, spent in zip(sizes.counts, result, strict=True)
    }
    return {**values, **straight("record", sizes.counts, result)}


def memory(_runs: int, sizes: Sizes) -> dict[str, float]:
    """Peak memory in MB of the process that plans, and of a worker that makes one whole shard, by
    number of records.
    """
    result = {}
    for n_records in sizes.long_counts:
        with tempfile.TemporaryDirectory() as folder:
            out = str(Path(folder) / "set")
            planning, working = (
                alone(make_plan, str(n_records), out, *QUICKSTART, *LONG),
                alone(make_shard, out),
            )
        name = f"{n_records} records of 1 s and four channels"
        result |= {
            f"{name}: planning": planning[1] / 1e6,
            f"{name}: worker": working[1] / 1e6,
        }
    return result


def against_teeth(runs: int, sizes: Sizes) -> tuple[dict[str, float], dict[str, float]]:
    """CPU milliseconds of a table, and of a record without it, by the number of pitted pinion
    teeth.
    """
    tables, motions = {}, {}

    def table(run: Run) -> None:
        pair_machine._mesh_table.cache_clear()
        sound_load.cache_clear()
        running_pair(run)

    for n_teeth in sizes.teeth:
        teeth = list(range(n_teeth))
        group = side_by_side(
            "operating.duration_s=0.2",
            "fault=distributed_pitting",
            f"fault.tooth={teeth}",
        )
        name = f"{n_teeth} distinct pitted {'tooth' if n_teeth == 1 else 'teeth'}"
        tables[name], motions[name] = partial(table, group[0]), partial(simulate, group)
        table(group[0])
    spent = in_turn(tables, runs)
    for motion in motions.values():
        motion()
    result = {
        name: value / LANES * 1e3 for name, value in in_turn(motions, runs).items()
    }
    line = straight("tooth", sizes.teeth, list(spent.values()))
    return {**{name: value * 1e3 for name, value in spent.items()}, **line}, result


def against_freedom(runs: int, _sizes: Sizes) -> dict[str, float]:
    """CPU milliseconds a record of 1 s by degrees of freedom: with a motor, and with a load too."""
    works = {}
    for n_dof, words in ROTORS.items():
        group = side_by_side(
            "operating.duration_s=1",
            *words,
            channels="[pinion_x,pinion_y,wheel_x,wheel_y]",
        )
        simulate(group[:1])
        works[f"{n_dof} degrees of freedom"] = partial(simulate, group)
    return {name: value / LANES * 1e3 for name, value in in_turn(works, runs).items()}


def main() -> None:
    """Measure and print."""
    arguments, named, begun = begin("benchmarks.scaling", __doc__ or "")
    sections: dict[str, dict[str, float]] = {}
    sizes = WHOLE
    if arguments.quick:
        sizes = QUICK

    def show(
        measure: Callable[
            [int, Sizes], dict[str, float] | tuple[dict[str, float], ...]
        ],
        *titles: str,
    ) -> None:
        result = measure(arguments.runs, sizes)
        for title, values in zip(
            titles, result if isinstance(result, tuple) else (result,), strict=True
        ):
            sections[title] = values
            print_figures(title, values)

    show(against_number, "number of records: CPU ms a record")
    show(memory, "peak memory, MB")
    show(against_duration, f"duration of {LANES} records, one channel: CPU s")
    show(against_freedom, "degrees of freedom, 1 s and four channels: CPU ms a record")
    show(
        against_teeth,
        "distinct teeth: CPU ms of a table",
        "distinct teeth: CPU ms a record of 0.2 s, table known",
    )
    print(f"\n{time.perf_counter() - begun:.0f} s")
    write_json(arguments.json, named, sections)


if __name__ == "__main__":
    main()
