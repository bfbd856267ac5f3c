"""Data sets as ``gensig generate`` makes them, timed.

CPU time of one process by stage, wall time of several.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks._rates import quickstart
from benchmarks._stages import (
    CLOSING,
    EQUATIONS,
    INTEGRATION,
    LOW_PASS,
    NOISE,
    RECORDING,
    STAGES,
    TABLES,
    WRITING,
    Stages,
)
from gensig.execution.local import LocalExecutor
from gensig.mesh.load_distribution import sound_load
from gensig.production.folder import begin_folder, run_folder
from gensig.record import simulate as records
from gensig.systems import pair_machine

# of the kernel's rate, where that would be the same
RECORDING_SHARE = "share of the records' own integration"
SHARD = 32  # records, as in the experiment


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """Records planned for one process and for several, and further options of the data set."""

    one: int
    several: int
    words: tuple[str, ...] = ()


# with a reference for every four records, they fill five and ten shards
WHOLE = Size(one=128, several=256)
QUICK = Size(one=8, several=96, words=("operating.duration_s=0.05",))


def data_set(precision: str, n_planned: int, *words: str) -> dict[str, Any]:
    """Configuration of a quickstart data set.

    1 s, four channels, a fault, speed, load and noise of its own each.
    """
    config, _ = quickstart(
        n_planned,
        f"solver.precision={precision}",
        f"dataset.records_per_shard={SHARD}",
        *words,
    )
    return config


def by_stage(
    precision: str, runs: int, *words: str, size: Size = WHOLE
) -> dict[str, float]:
    """CPU milliseconds of a record by stage and in all, and rates of one process.

    The best of several runs; ``words`` are further options of the data set.
    """
    config = data_set(precision, size.one, *size.words, *words)
    n_samples = round(
        config["operating"]["duration_s"] * config["sensing"]["sampling_rate_hz"]
    )
    result: list[Stages] = []
    wall: list[float] = []
    for _ in range(runs):
        # what would not be there for records that have not been made before
        records.forget_twins()
        pair_machine._mesh_table.cache_clear()
        sound_load.cache_clear()
        with tempfile.TemporaryDirectory() as folder:
            n_records = begin_folder(config, [], Path(folder) / "set").n_records
            stages, start = Stages(), time.perf_counter()
            with stages.watching(n_samples):
                _complete(Path(folder) / "set", workers=1)
            wall.append(time.perf_counter() - start)
            result.append(stages)
    best = min(result, key=lambda stages: sum(stages.seconds.values()))
    best.separate_low_pass(precision, len(config["sensing"]["channels"]), runs)
    spent = {name: best.seconds[name] / n_records * 1e3 for name in STAGES}
    total, integration = sum(spent.values()), sum(spent[name] for name in INTEGRATION)
    for_twins = (1.0 - n_records / best.n_runs) * (
        spent[EQUATIONS] + integration + spent[LOW_PASS]
    )
    return {
        **{f"{name}, ms a record": value for name, value in spent.items()},
        "all, ms a record": total,
        "of which for the healthy twins that noise is set by": for_twins,
        "share of integration": integration / total,
        RECORDING_SHARE: spent[RECORDING] / total,
        "share of mesh tables": spent[TABLES] / total,
        "share of low-pass": spent[LOW_PASS] / total,
        "share of noise and labels": spent[NOISE] / total,
        "share of HDF5 writing": spent[WRITING] / total,
        "runs a record: itself and its part of a healthy twin": best.n_runs / n_records,
        "runs made again at half the step, a record": best.n_repeated / n_records,
        "records per core-s": 1e3 / total,
        f"{CLOSING} with its card and pictures, s a data set": best.seconds[CLOSING],
        wall_name(1): n_records / min(wall),
    }


def wall_name(workers: int) -> str:
    """Name of the figure of so many workers."""
    return (
        f"records a second of wall time, {workers} worker{'s' if workers > 1 else ''}"
    )


def wall_rates(
    precision: str, workers: int, runs: int, size: Size = WHOLE
) -> dict[str, float]:
    """Records a second of wall time.

    Once every worker has finished its first shard, and of the whole data set.
    """
    config = data_set(precision, size.several, *size.words)
    whole, running = [], []
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as folder:
            begin_folder(config, [], Path(folder) / "set")
            start = time.perf_counter()
            ends = _complete(Path(folder) / "set", workers=workers)
        (first, n_before), (last, n_records) = ends[workers - 1], ends[-1]
        whole.append(n_records / (last - start))
        running.append((n_records - n_before) / (last - first))
    return {
        wall_name(workers): max(running),
        f"{wall_name(workers)}, with their start": max(whole),
    }


def _complete(out: Path, *, workers: int) -> list[tuple[float, int]]:
    """Make every shard; the times at which they were finished, and the records until then."""
    ends: list[tuple[float, int]] = []
    n_failed, problems = run_folder(
        out,
        executor=LocalExecutor(n_workers=workers),
        on_shard=lambda progress: ends.append((time.perf_counter(), progress.n_done)),
    )
    if n_failed or problems:
        raise AssertionError(f"{n_failed} records failed, problems: {problems}")
    return ends
