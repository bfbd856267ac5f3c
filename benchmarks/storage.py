"""Cost of each way to store a data set: ``python -m benchmarks.storage``.

Records of the quickstart machines with 10 % noise (20 dB) are written as shards with every
compression and sample type, and read back as users read them. They are compared with plain h5py:
one contiguous float32 data set, no checks, no labels. MB count the samples as float32, whatever
is stored. Times are the least of several runs, in CPU time of one core, from a warm cache;
``--folder`` chooses the disk, whose own speed is not in them. ``--json FILE`` writes the
figures.
"""

from __future__ import annotations

import argparse
import json
import platform
import tempfile
import time
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.manifest import record_shard
from gensig.dataset.reader import open_dataset
from gensig.dataset.schema import SAMPLE_TYPES
from gensig.dataset.storage.compression import COMPRESSIONS
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.production.folder import begin_folder
from gensig.production.shard_writing import open_shard
from gensig.record.inputs import InputReader
from gensig.record.simulate import Record, simulate_records

N_SIMULATED = 16
MEGABYTE = 1e6


def least(work: Callable[[], Any], runs: int) -> float:
    """Least CPU time of several runs, s."""
    return min(timeit.repeat(work, number=1, repeat=runs, timer=time.process_time))


def simulated(config: Configuration) -> list[Record]:
    """As many records as the plan has: simulated ones, repeated with another noise each time."""
    plan = make_plan(config)
    rows = [plan.record(place) for place in range(plan.n_records)]
    made = simulate_records(InputReader(config), rows[:N_SIMULATED])
    rng = np.random.default_rng(0)
    records = []
    for place, row in enumerate(rows):
        record = made[place % N_SIMULATED]
        clean = record.signals["acceleration"]
        rms = np.sqrt(np.mean(np.square(clean), axis=1, keepdims=True))
        noisy = clean + 0.1 * rms * rng.standard_normal(clean.shape, np.float32)
        values = {
            **record.values,
            **{
                name: value
                for name, value in row.items()
                if name not in ("shard", "row")
            },
        }
        records.append(
            Record(
                signals={**record.signals, "acceleration": noisy.astype(np.float32)},
                values=values,
            )
        )
    return records


def shard(
    config: Configuration, records: list[Record], out: Path, runs: int
) -> dict[str, float]:
    """Figures of one way to store."""
    begin_folder(config, [], out)
    params = [
        name.removeprefix("params/")
        for name in records[0].values
        if name.startswith("params/")
    ]
    path, digests = shard_path(out, 0), []

    def write() -> None:
        with open_shard(path, InputReader(config), len(records), params) as writer:
            for row, record in enumerate(records):
                writer.write(row, record.signals, record.values)
        digests.append(writer.sha256)

    writing = least(write, runs)
    if len(set(digests)) != 1:
        raise AssertionError(f"{path}: the same records gave different bytes")
    record_shard(out, 0, digests[0], path.stat().st_size, 0)
    finalize(out)
    with open_dataset(out) as data:
        return _figures(records, writing, path, runs, data.signals)


def plain(records: list[Record], path: Path, runs: int) -> dict[str, float]:
    """Figures of h5py alone."""
    shape = (len(records), *records[0].signals["acceleration"].shape)

    def write() -> None:
        with h5py.File(path, "w") as file:
            data = file.create_dataset("acceleration", shape=shape, dtype="<f4")
            for row, record in enumerate(records):
                data[row] = record.signals["acceleration"]

    writing = least(write, runs)
    with h5py.File(path) as file:
        return _figures(records, writing, path, runs, file["acceleration"].__getitem__)


def _figures(
    records: list[Record], writing: float, path: Path, runs: int, read: Any
) -> dict[str, float]:
    n_bytes = sum(record.signals["acceleration"].nbytes for record in records)
    order = np.random.default_rng(1).permutation(len(records)).tolist()
    reading = least(lambda: [read(place) for place in order], runs)
    worst = max(
        float(np.max(np.abs(read(row) - record.signals["acceleration"]), initial=0.0))
        / float(np.max(np.abs(record.signals["acceleration"])))
        for row, record in enumerate(records)
    )
    return {
        "write_mb_per_s": n_bytes / writing / MEGABYTE,
        "ratio": n_bytes / path.stat().st_size,
        "read_record_ms": reading / len(records) * 1e3,
        "error_db": 20.0 * float(np.log10(worst)) if worst else -np.inf,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--records",
        type=int,
        default=64,
        help="records of 1 s with 4 channels (default 64)",
    )
    parser.add_argument(
        "--runs", type=int, default=3, help="the least of so many (default 3)"
    )
    parser.add_argument(
        "--folder", help="where to write (default: the folder for temporary files)"
    )
    parser.add_argument("--json", help="also write the figures to this file")
    arguments = parser.parse_args()
    words = [
        "experiment=quickstart",
        f"plan.n_records={arguments.records}",
        "sensing.snr_db=null",
        "plan.vary={}",
        "plan.n_reference=0",  # all records in one shard
    ]
    config = read_request(
        [*words, f"dataset.records_per_shard={arguments.records}"]
    ).config
    records = simulated(config)
    result: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory(dir=arguments.folder) as name:
        result["h5py alone, contiguous float32"] = plain(
            records, Path(name) / "plain.h5", arguments.runs
        )
        for sample_type in SAMPLE_TYPES:
            for compression in COMPRESSIONS:
                stored = config.with_keys(
                    "dataset", compression=compression, sample_type=sample_type
                )
                out = Path(name) / f"{sample_type}-{compression}"
                result[f"{sample_type}, {compression}"] = shard(
                    stored, records, out, arguments.runs
                )
    header = ("stored as", "write MB/s", "ratio", "read 1 record ms", "error dB")
    print("{:<32}{:>12}{:>8}{:>18}{:>10}".format(*header))
    for way, (write, ratio, read, error) in (
        (way, values.values()) for way, values in result.items()
    ):
        shown_error = f"{error:.1f}" if error > -np.inf else "none"
        print(f"{way:<32}{write:>12.0f}{ratio:>8.2f}{read:>18.2f}{shown_error:>10}")
    if arguments.json:
        machine = {
            "machine": platform.processor() or platform.machine(),
            "records": arguments.records,
        }
        exact = {
            way: {k: v if np.isfinite(v) else None for k, v in values.items()}
            for way, values in result.items()
        }
        Path(arguments.json).write_text(
            json.dumps({**machine, "ways": exact}, indent=1) + "\n", encoding="utf-8"
        )


if __name__ == "__main__":
    main()
