"""Kill commands, go on as they say, compare: ``python -m benchmarks.kill_campaign [--kills 200]
[--verbs 100] [--full 50] [--train 50]``.

With ``--verbs`` every verb that writes is killed before one of its file operations, typed again,
and followed where it names a command (``benchmarks/_kill_verbs.py``). Files must be whole or absent
after the kill, and have the bytes of an undisturbed run in the end. ``--full`` does the same with a
disk that is full from an operation on; there the command must leave nothing, or say how it goes on.

With ``--kills`` each data set is begun with ``gensig generate`` and killed (SIGKILL) up to five
times; then it is resumed, verified, and every file that counts as the data set is compared with an
uninterrupted run byte by byte. After each kill the folder must not look whole unless it is; one
that was killed before it had a manifest is begun again by the same command.

With ``--train`` studies of ``diagnose train`` are stopped (SIGKILL, SIGTERM, SIGINT, of the parent
alone or of its group), gone on with, and compared (``benchmarks/_kill_training.py``). A stop must
leave no process, and SIGTERM and SIGINT say one line.

Most runs of data sets are forked from this process, which has imported and compiled everything, so
that kills fall into planning, writing and closing; one in ``COMMAND_EVERY`` is the command itself
with two workers, imports included, of which the parent or a worker is killed. Needs Linux
(/proc). The exit status is 1 for any difference, and where too few kills fell before the end of
a run.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from benchmarks._kill_verbs import kill_verbs
from gensig.cli import main as gensig
from gensig.dataset.folder.layout import read_manifest
from gensig.dataset.folder.verify import verify

SET = (
    "plan.n_records=8",
    "plan.classes=[healthy,crack]",
    "dataset.records_per_shard=1",
    "operating.duration_s=0.02",
    "sensing.channels=[pinion_y]",
)
COMPARED = ("plan.csv", "index.h5", "shards/*", "splits/*", "figures/*")
KILLS_PER_SET = 5
COMMAND_EVERY = 5
LONGEST = 300.0  # s for any run; one that takes longer hangs
KILLED = ("parent", "worker", "forked run")


class Run(ABC):
    """A run of gensig in another process."""

    @property
    @abstractmethod
    def pid(self) -> int:
        """Number of the process."""

    @abstractmethod
    def wait(self, seconds: float) -> int | None:
        """Exit status, negative for a signal; None where it still runs after that time."""

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        self.wait(LONGEST)


class Command(Run):
    """The command as a user gives it."""

    def __init__(self, *words: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "gensig.cli", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    def wait(self, seconds: float) -> int | None:
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None


class Fork(Run):
    """The same in a copy of this process, which has imported everything."""

    def __init__(self, *words: str) -> None:
        self._process = multiprocessing.get_context("fork").Process(
            target=_quiet, args=(words,)
        )
        self._process.start()

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    def wait(self, seconds: float) -> int | None:
        self._process.join(seconds)
        return self._process.exitcode


def _quiet(words: tuple[str, ...]) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    sys.exit(gensig(words))


def start(out: Path, *, command: bool) -> Run:
    """Begin the folder, or go on with it where it has begun."""
    workers = 2 if command else 1
    begun = (out / "manifest.json").is_file()
    words = (
        ("resume", str(out), "--workers", str(workers))
        if begun
        else ("generate", *SET, f"executor.n_workers={workers}", f"out={out}")
    )
    return Command(*words) if command else Fork(*words)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file that must be byte-equal, hidden ones included."""
    paths = [path for pattern in COMPARED for path in sorted(folder.glob(pattern))]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def workers_of(run: Run) -> list[int]:
    """Worker processes of a running command; not the helper that cleans up after them."""
    with suppress(OSError):
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
        return [
            pid
            for pid in map(int, children)
            if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
        ]
    return []


def kill_once(run: Run, out: Path, seconds: float, rng: random.Random) -> str:
    """Kill a run at a random moment; says who was killed, or 'ended first'."""
    before, limit = signature(out), time.monotonic() + LONGEST
    # Half the kills come after the next shard, in the thick of writing; the others at any
    # moment, imports included.
    if rng.random() < 0.5:
        while (
            signature(out) == before
            and run.wait(0.002) is None
            and time.monotonic() < limit
        ):
            pass
        wait = rng.uniform(0.0, 0.2 * seconds)
    else:
        wait = rng.uniform(0.0, seconds)
    if run.wait(wait) is not None:
        return "ended first"
    if isinstance(run, Fork):
        run.kill()
        return "forked run"
    workers = workers_of(run)
    if not workers or rng.random() < 0.5:
        run.kill()
        return "parent"
    with suppress(ProcessLookupError):
        os.kill(rng.choice(workers), signal.SIGKILL)
    if (
        rng.random() < 0.5 or run.wait(LONGEST) is None
    ):  # else the run goes on with another worker
        run.kill()
    return "worker"


def signature(out: Path) -> list[str]:
    """Names in the folder of shards, unfinished ones included."""
    with suppress(OSError):
        return sorted(os.listdir(out / "shards"))
    return []


def is_whole(out: Path) -> bool:
    return (out / "manifest.json").is_file() and read_manifest(out).is_complete


def durations(folder: Path) -> dict[bool, float]:
    """Time of an undisturbed run.

    Of the command (True) and of a fork (False), everything being compiled.
    """
    (folder / "reference").parent.mkdir(exist_ok=True)
    if gensig(
        [
            "generate",
            "--quiet",
            *SET,
            "executor.n_workers=1",
            f"out={folder / 'reference'}",
        ]
    ):
        raise SystemExit("an undisturbed run failed")
    result = {}
    for command in (True, False):
        begin = time.monotonic()
        if start(folder / f"undisturbed-{command}", command=command).wait(LONGEST) != 0:
            raise SystemExit("an undisturbed run failed")
        result[command] = time.monotonic() - begin
    return result


def n_kills_of(outcome: Counter[str]) -> int:
    return sum(outcome[name] for name in KILLED)


def campaign(n_kills: int, seed: int, folder: Path) -> tuple[Counter[str], list[str]]:
    """Spend the kills on one data set after the other.

    What was killed, and every way in which one was not equal.
    """
    rng = random.Random(seed)
    seconds = durations(folder)
    wanted = contents(folder / "reference")
    outcome: Counter[str] = Counter()
    problems: list[str] = []
    for number in range(10 * n_kills):
        if n_kills_of(outcome) >= n_kills:
            break
        out = folder / f"set-{number}"
        for _ in range(KILLS_PER_SET):
            if is_whole(out) or n_kills_of(outcome) >= n_kills:
                break
            command = (
                n_kills_of(outcome) + outcome["ended first"]
            ) % COMMAND_EVERY == 0
            outcome[
                kill_once(start(out, command=command), out, seconds[command], rng)
            ] += 1
            if (out / "manifest.json").is_file():
                result = verify(out)
                if result.complete != is_whole(out):
                    problems.append(
                        f"set {number}: looks whole and is not: {result.problems[0]}"
                    )
            elif out.exists():
                outcome["of these before the manifest"] += 1
        for attempt in (
            "first",
            "second",
        ):  # a folder without a manifest is begun first
            if not is_whole(out) and (
                status := start(out, command=False).wait(LONGEST)
            ):
                problems.append(
                    f"set {number}: the {attempt} run after the kills ended with {status}"
                )
        outcome["sets"] += 1
        if outcome["sets"] % 10 == 0:
            print(
                f"{n_kills_of(outcome)} of {n_kills} kills, {len(problems)} problem(s)",
                file=sys.stderr,
                flush=True,
            )
        if not is_whole(out) or verify(out).problems:
            problems += [f"set {number}: {line}" for line in verify(out).problems[:3]]
            continue
        made = contents(out)
        different = sorted(
            name for name in {*wanted, *made} if wanted.get(name) != made.get(name)
        )
        problems += [f"set {number}: {name} differs" for name in different]
    return outcome, problems


def verbs_campaign(
    n_kills: int, seed: int, folder: Path, *, full: bool = False
) -> tuple[Counter[str], list[str]]:
    """Kills by verb, and every way in which one was not as it should be; see `kill_verbs`."""
    return _counted(kill_verbs(n_kills, seed, folder, full=full))


def train_campaign(
    n_kills: int, seed: int, folder: Path
) -> tuple[Counter[str], list[str]]:
    """Stops by kind, and every way in which one was not as it should be; see `kill_trainings`."""
    from benchmarks._kill_training import kill_trainings

    return _counted(kill_trainings(n_kills, seed, folder))


def _counted(
    stopped: Iterable[tuple[str, list[str]]],
) -> tuple[Counter[str], list[str]]:
    outcome: Counter[str] = Counter()
    problems: list[str] = []
    for name, lines in stopped:
        outcome[name] += 1
        problems += lines
        print(f"{outcome.total()}: {name}", *lines, sep="\n  ", file=sys.stderr)
    return outcome, problems


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=200, help="at random moments")
    parser.add_argument("--verbs", type=int, default=0, help="of all verbs that write")
    parser.add_argument("--full", type=int, default=0, help="full disks, of all verbs")
    parser.add_argument("--train", type=int, default=0, help="of studies")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    begin, status = time.monotonic(), 0
    parts = (
        (campaign, arguments.kills),
        (verbs_campaign, arguments.verbs),
        (functools.partial(verbs_campaign, full=True), arguments.full),
        (train_campaign, arguments.train),
    )
    for run, n_kills in parts:
        if not n_kills:
            continue
        with tempfile.TemporaryDirectory() as folder:
            outcome, problems = run(n_kills, arguments.seed, Path(folder))
        facts = ", ".join(f"{name} {count}" for name, count in sorted(outcome.items()))
        print(f"{facts}; {len(problems)} problem(s), {time.monotonic() - begin:.0f} s")
        for problem in problems:
            print(problem)
        too_few = run is campaign and n_kills_of(outcome) < n_kills
        status = max(status, int(bool(problems) or too_few))
    return status


if __name__ == "__main__":
    sys.exit(main())
