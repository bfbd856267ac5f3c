"""Verbs on data sets: generate, resume, plan, inspect, verify."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from pathlib import Path
from typing import Any

from gensig.commands.console import ShardProgress
from gensig.compose import job_folders, sweep
from gensig.config import Request, read_request
from gensig.dataset.inspection import inspect as inspect_path
from gensig.dataset.manifest import read_manifest, refuse_used
from gensig.dataset.verify import verify as verify_folder
from gensig.errors import ConfigError


def generate(arguments: Namespace) -> int:
    """Make one data set, or with -m one for each combination of values."""
    jobs = sweep(arguments.overrides) if arguments.multirun else [arguments.overrides]
    requests = [read_request(job, config_dir=arguments.config_dir) for job in jobs]
    parents = {str(request.config["out"]) for request in requests}
    if requests[0].config["out"] is None:
        raise ConfigError("out is required: give out=DIR, a folder that does not exist or is empty")
    if len(parents) > 1:
        raise ConfigError("out must be one folder; with -m each data set gets a folder below it")
    parent = Path(str(requests[0].config["out"])).expanduser()
    refuse_used(parent)
    folders = [parent / name for name in job_folders(jobs)] if arguments.multirun else [parent]
    return max(_generate_one(request, folder, arguments) for request, folder in zip(requests, folders, strict=True))


def _generate_one(request: Request, out: Path, arguments: Namespace) -> int:
    from gensig.execution.local import n_workers
    from gensig.generation import begin_folder, run_folder

    begin = time.monotonic()
    n_records = request.config["plan"]["n_records"]
    workers = n_workers(request.config["executor"]["n_workers"])
    n_shards = begin_folder(request.config, request.overrides, out)
    if not arguments.quiet:
        print(f"{out}: making {n_records} records in {n_shards} shard(s)", file=sys.stderr, flush=True)
    with ShardProgress(quiet=arguments.quiet, n_records=n_records) as progress:
        outcome = run_folder(out, workers=workers, on_shard=progress)
    return _closing_line(out, outcome, n_records, time.monotonic() - begin, arguments)


def resume(arguments: Namespace) -> int:
    """Finish an interrupted data set."""
    from gensig.execution.local import n_workers
    from gensig.generation import run_folder

    out = Path(arguments.folder)
    manifest = read_manifest(out)
    if manifest.is_complete:
        print(f"{out} is complete: {manifest.n_records} records")
        return 0
    begin = time.monotonic()
    with ShardProgress(quiet=arguments.quiet, n_records=manifest.n_records) as progress:
        outcome = run_folder(out, workers=n_workers(arguments.workers), on_shard=progress)
    return _closing_line(out, outcome, manifest.n_records, time.monotonic() - begin, arguments)


def _closing_line(
    out: Path, outcome: tuple[int, list[str]], n_records: int, seconds: float, arguments: Namespace
) -> int:
    n_failed, problems = outcome
    for problem in problems:
        print(f"gensig: {problem}", file=sys.stderr)
    if problems:
        print(f"gensig: {out} is incomplete; gensig resume {out} tries the missing shards again", file=sys.stderr)
        return 1
    if n_failed:
        print(f"gensig: {n_failed} of {n_records} records failed and are marked so in {out}", file=sys.stderr)
    if not arguments.quiet:
        print(f"{out}: {n_records} records in {seconds:.1f} s; gensig inspect {out} describes them")
    return 1 if n_failed else 0


def plan(arguments: Namespace) -> int:
    """Dry run: how many records, how many bytes, how long."""
    from gensig.execution.local import n_workers
    from gensig.generation import BLOCK
    from gensig.planning import make_plan, record_bytes
    from gensig.records import forget_twins, simulate_records

    request = read_request(arguments.overrides, config_dir=arguments.config_dir)
    config = request.config
    table = make_plan(config)
    probe = [table.record(index) for index in range(min(BLOCK, table.n_records))]
    simulate_records(config, probe[:1])  # compiles, or loads what was compiled
    forget_twins()
    begin = time.monotonic()
    simulate_records(config, probe)
    seconds = (time.monotonic() - begin) / len(probe)
    workers = min(n_workers(config["executor"]["n_workers"]), table.n_shards)
    n_bytes = table.n_records * record_bytes(config)
    counts: dict[str, int] = {}
    for name in table.columns["label_name"]:
        counts[str(name)] = counts.get(str(name), 0) + 1
    facts: dict[str, Any] = {
        "records": table.n_records,
        "classes": ", ".join(f"{name} {count}" for name, count in counts.items()),
        "units": len(set(table.columns["unit_id"])),
        "conditions": len(set(table.columns["condition_id"])),
        "shards": f"{table.n_shards} of at most {max(table.shard_sizes())} records",
        "bytes": f"{n_bytes:,} ({n_bytes / 1e6:.0f} MB)",
        "time": f"about {max(1, round(seconds * table.n_records / workers))} s on {workers} worker(s), "
        f"from {seconds:.2f} s a record measured now",
    }
    for name, value in facts.items():
        print(f"{name:<11}{value}")
    return 0


def inspect(arguments: Namespace) -> int:
    """Describe a data set or file."""
    print(inspect_path(Path(arguments.path)))
    return 0


def verify(arguments: Namespace) -> int:
    """Check a data set; the exit status is 0 only for a whole and unaltered one."""
    result = verify_folder(Path(arguments.folder), quick=arguments.quick)
    for problem in result.problems:
        print(problem)
    if result.problems:
        print(f"{arguments.folder} is NOT whole: {len(result.problems)} problem(s)")
        return 1
    depth = "sizes and manifest" if arguments.quick else "every byte"
    failed = f", {result.n_failed} marked failed" if result.n_failed else ""
    print(f"{arguments.folder} is whole and unaltered ({depth} checked): {result.n_records} records{failed}")
    return 0
