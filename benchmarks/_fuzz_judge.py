"""Verdict on a mutant.

Every reader is tried, in a process whose death, delay and hunger are seen.
"""

from __future__ import annotations

import contextlib
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
PREPARE_LIMIT = (
    600.0  # s until a process has compiled what it needs, or a mutant is made
)
NOT_MADE = "not made yet"
MEMORY_LIMIT = 400 * 1024**2  # bytes a mutant may add; the sets are far below 1 MB


# What a mutant says of itself, whether anything noticed it, and whether a reader refused it.
Judged = tuple[str, bool, bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """Changes of folders by a seed, and what tries each folder then.

    Attributes
    ----------
    change : folder and seed -> what was changed
    judge : folder, mutant, meaning of the unchanged folder, and a function that tells the
        watching process what is tried now -> fault, noticed, refused
    meaning : of an unchanged folder, what an accepted mutant must still say
    prepare : called once in each process with the unchanged folder
    """

    change: Callable[[Path, int], Mutant]
    judge: Callable[[Path, Mutant, dict[str, Any], Callable[[str], None]], Judged]
    meaning: Callable[[Path], dict[str, Any]]
    prepare: Callable[[Path], None] | None = None


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
    folder: Path,
    mutant: Mutant,
    whole: dict[str, Any],
    _tell: Callable[[str], None] = print,
) -> Judged:
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
    read = attempt("read", lambda: read_all(folder))
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
    if not noticed and not mutant.forged and meaning(folder) != whole:
        faults.append("accepted in silence")
    return "; ".join(faults), noticed, not read


def read_all(folder: Path) -> None:
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


def meaning(folder: Path) -> dict[str, Any]:
    """Keys of a manifest that decide what is read, with their values."""
    content = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    known = set(read_manifest(folder).__slots__) - {"environment", "configuration"}
    return {name: value for name, value in content.items() if name in known}


def peak_bytes() -> int:
    """Largest memory of this process since `forget_peak`, or since it began."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024


def forget_peak() -> None:
    """Let the peak begin anew, where the system can."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _work(
    template: Path, scratch: Path, seeds: range, pipe: Connection, campaign: Campaign
) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    whole = campaign.meaning(template)
    if campaign.prepare is not None:
        campaign.prepare(template)
    for seed in seeds:
        folder = scratch / f"mutant-{seed}" / "set"
        shutil.copytree(template, folder)
        pipe.send((seed, NOT_MADE, None, False, False))
        mutant = campaign.change(folder, seed)

        def tell(doing: str, seed: int = seed, kind: str = mutant.kind) -> None:
            pipe.send((seed, f"{kind}{doing}", None, False, False))

        tell("")
        forget_peak()
        before = peak_bytes()
        fault, noticed, refused = campaign.judge(folder, mutant, whole, tell)
        if (grown := peak_bytes() - before) > MEMORY_LIMIT:
            fault += f"; took {grown} bytes of memory"
        pipe.send((seed, mutant.kind, fault, noticed, refused))
        shutil.rmtree(folder.parent)


def verdicts(
    template: Path, scratch: Path, seeds: range, campaign: Campaign | None = None
) -> Iterator[Verdict]:
    """A verdict a seed; the campaign is that of accidents where none is given.

    A process that dies or hangs is one too, and another takes over behind it.
    """
    context = multiprocessing.get_context(METHOD)
    campaign = campaign or Campaign(change=mutate, judge=judge, meaning=meaning)
    while len(seeds):
        here, there = context.Pipe(duplex=False)
        worker = context.Process(
            target=_work, args=(template, scratch, seeds, there, campaign)
        )
        worker.start()
        there.close()
        seed, kind, fault = seeds[0], "not begun", "died"
        limit = PREPARE_LIMIT
        while True:
            try:
                if not here.poll(limit):
                    fault = f"hung for {limit:g} s"
                    break
                seed, kind, outcome, noticed, refused = here.recv()
                limit = PREPARE_LIMIT if kind == NOT_MADE else TIME_LIMIT
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
                seeds = seeds[seeds.index(seed) + 1 :]
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
