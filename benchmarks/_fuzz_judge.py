"""Verdict on a mutant.

Every reader is tried, in a process whose death, delay and hunger are seen.
"""

from __future__ import annotations

import json
import multiprocessing
import resource
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._damaged_folders import Mutant, mutate
from gensig.dataset.folder.inspection import inspect
from gensig.dataset.folder.layout import read_manifest
from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.errors import DatasetError

METHOD = "spawn"
TIME_LIMIT = 60.0  # s a mutant, on a machine that does other things too
MEMORY_LIMIT = 400 * 1024**2  # bytes a mutant may add; the sets are far below 1 MB


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """One mutant: ``fault`` is empty where gensig behaved, else what it did.

    ``noticed``: something refused or named the change; ``refused``: a reader did, before verify.
    """

    seed: int
    kind: str
    fault: str
    noticed: bool
    refused: bool


def judge(
    folder: Path, mutant: Mutant, whole: dict[str, Any]
) -> tuple[str, bool, bool]:
    """The fault ('' for none), whether anything noticed the change, whether a reader refused."""
    lines: list[str] = []
    faults: list[str] = []

    def attempt(name: str, work: Callable[[], Any]) -> bool:
        try:
            work()
        except DatasetError as error:
            lines.append(str(error))
            return False
        except Exception as error:
            faults.append(f"{name}: {type(error).__name__}: {str(error)[:200]}")
        return True

    checked = attempt("verify", lambda: lines.extend(verify(folder).problems))
    attempt("verify --quick", lambda: verify(folder, quick=True))
    attempt("inspect", lambda: inspect(folder))
    read = attempt("read", lambda: _read_all(folder))
    for path in sorted((folder / "shards").iterdir()):
        attempt("inspect a shard", lambda path=path: inspect(path))
    if any("\n" in line for line in lines):
        faults.append("a message of more than one line")
    if mutant.refused and read:
        faults.append("read without complaint what must be refused")
    if any(
        (folder / name).exists() or (folder.parent / name).exists()
        for name in ("evil", "evil.wav")
    ):
        faults.append("wrote a file")
    noticed = bool(lines) or not checked
    if not noticed and not mutant.forged and _meaning(folder) != whole:
        faults.append("accepted in silence")
    return "; ".join(faults), noticed, not read


def _read_all(folder: Path) -> None:
    with open_dataset(folder, allow_incomplete=True) as data:
        for name in data.column_names:
            values = data.column(name)
            if len(values) != data.n_records or values.dtype.kind not in "Uif":
                raise TypeError(
                    f"column {name} has type {values.dtype} and {len(values)} rows"
                )
        for index in range(data.n_records):
            for name in data.signal_names:
                block = data.signals(index, name=name)
                if block.dtype != np.float32 or block.shape != (
                    len(data.channel_names),
                    data.n_samples,
                ):
                    raise TypeError(
                        f"{name} has type {block.dtype} and shape {block.shape}"
                    )
        len(data.where(speed_rpm=(0, 1e4)))
        if len(data.plan_table) != data.n_records:
            raise TypeError("the plan has another length")
        for protocol in data.protocols:
            data.split(protocol)


def _meaning(folder: Path) -> dict[str, Any]:
    """Keys of a manifest that decide what is read, with their values."""
    content = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    known = set(read_manifest(folder).__slots__) - {"environment", "configuration"}
    return {name: value for name, value in content.items() if name in known}


Work = Callable[[Path, Path, range, Connection], None]


def _work(template: Path, scratch: Path, seeds: range, pipe: Connection) -> None:
    whole = _meaning(template)
    try_mutants(
        (template, scratch, seeds, pipe),
        lambda folder, seed: mutate(folder, seed),
        lambda folder, mutant: judge(folder, mutant, whole),
    )


def try_mutants(
    given: tuple[Path, Path, range, Connection],
    mutated: Callable[[Path, int], Mutant],
    judged: Callable[[Path, Mutant], tuple[str, bool, bool]],
) -> None:
    """Judge a mutant a seed, and send what came of it through the pipe."""
    template, scratch, seeds, pipe = given
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for seed in seeds:
        folder = scratch / f"mutant-{seed}" / "set"
        shutil.copytree(template, folder)
        mutant = mutated(folder, seed)
        pipe.send((seed, mutant.kind, None, False, False))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        fault, noticed, refused = judged(folder, mutant)
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        if grown > MEMORY_LIMIT:
            fault += f"; took {grown} bytes of memory"
        pipe.send((seed, mutant.kind, fault, noticed, refused))
        shutil.rmtree(folder.parent)


def verdicts(
    template: Path,
    scratch: Path,
    seeds: range,
    work: Work = _work,
    limit: float | None = None,
) -> Iterator[Verdict]:
    """A verdict a seed; ``work`` tries the mutants of some seeds in a process of its own.

    A mutant may take ``limit`` seconds, the first one with the start of the process; None takes
    `TIME_LIMIT`. A process that dies or hangs is one too, and another takes over behind it.
    """
    context = multiprocessing.get_context(METHOD)
    limit = limit or TIME_LIMIT
    while len(seeds):
        here, there = context.Pipe(duplex=False)
        worker = context.Process(target=work, args=(template, scratch, seeds, there))
        worker.start()
        there.close()
        seed, kind, fault = seeds[0], "not begun", "died"
        while True:
            try:
                if not here.poll(limit):
                    fault = f"hung for {limit:g} s"
                    break
                seed, kind, outcome, noticed, refused = here.recv()
            except EOFError:
                break
            if outcome is not None:
                yield Verdict(
                    seed=seed,
                    kind=kind,
                    fault=outcome,
                    noticed=noticed,
                    refused=refused,
                )
                seeds = range(seed + seeds.step, seeds.stop, seeds.step)
                if not len(seeds):
                    worker.join()
                    return
        worker.kill()
        worker.join()
        fault = fault if fault != "died" else f"died, exit status {worker.exitcode}"
        yield Verdict(
            seed=seeds[0], kind=kind, fault=fault, noticed=False, refused=False
        )
        seeds = seeds[1:]
