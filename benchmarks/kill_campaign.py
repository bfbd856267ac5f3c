"""Kill a run at random moments, resume it, compare: ``python -m benchmarks.kill_campaign [--kills 200]``.

Each data set is begun with ``gensig generate`` and killed (SIGKILL, the parent or one of its workers, in turn drawn at
random) until the asked number of kills is spent; then it is resumed, verified, and every file that counts as the data
set is compared with an uninterrupted run byte by byte. After each kill the folder must not look whole unless it is.
Needs Linux (/proc). The exit status is 1 for any difference.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from gensig.dataset.manifest import read_manifest
from gensig.dataset.verify import verify

SET = (
    "plan.n_records=8",
    "plan.classes=[healthy,crack]",
    "dataset.records_per_shard=1",
    "operating.duration_s=0.02",
    "sensing.channels=[pinion_y]",
    "executor.n_workers=2",
)
COMPARED = ("plan.csv", "index.h5", "shards/*", "splits/*")
KILLS_PER_SET = 5


def gensig(*words: str) -> list[str]:
    return [sys.executable, "-m", "gensig.cli", *words]


def contents(folder: Path) -> dict[str, bytes]:
    """Every file that must be byte-equal, hidden ones among the shards included."""
    paths = [path for pattern in COMPARED for path in sorted(folder.glob(pattern))]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def workers_of(process: subprocess.Popen[bytes]) -> list[int]:
    """Worker processes of a running command; not the helper that cleans up after them."""
    with suppress(OSError):
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        return [pid for pid in map(int, children) if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    return []


def kill_once(command: list[str], out: Path, seconds: float, rng: random.Random) -> str:
    """Start the command, wait until the folder is there and some more, kill; says who was killed, or 'ended first'."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    before = signature(out)
    # Half the kills come after the next shard, in the thick of writing; the others at any moment, imports included.
    if rng.random() < 0.5:
        while signature(out) == before and process.poll() is None:
            time.sleep(0.005)
        wait = rng.uniform(0.0, 0.1 * seconds)
    else:
        wait = rng.uniform(0.0, seconds)
    with suppress(subprocess.TimeoutExpired):
        process.wait(wait)
    victim, pid = "parent", process.pid
    workers = workers_of(process)
    if workers and rng.random() < 0.5:
        victim, pid = "worker", rng.choice(workers)
    if process.poll() is not None:
        return "ended first"
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    if victim == "worker" and rng.random() < 0.5:
        process.wait()  # the run goes on with another worker
    elif victim == "worker":
        process.kill()
    process.wait()
    return victim


def signature(out: Path) -> list[str]:
    """Names in the folder of shards, unfinished ones included."""
    with suppress(OSError):
        return sorted(os.listdir(out / "shards"))
    return []


def is_whole(out: Path) -> bool:
    return (out / "manifest.json").is_file() and read_manifest(out).is_complete


def campaign(n_kills: int, seed: int, folder: Path) -> tuple[Counter[str], list[str]]:
    """Spend the kills on one data set after the other; what was killed, and every way in which one was not equal."""
    rng = random.Random(seed)
    begin = time.monotonic()
    subprocess.run(gensig("generate", "--quiet", *SET, f"out={folder / 'reference'}"), check=True)
    seconds = time.monotonic() - begin
    wanted = contents(folder / "reference")
    outcome: Counter[str] = Counter()
    problems: list[str] = []
    for number in range(10 * n_kills):
        if outcome["parent"] + outcome["worker"] >= n_kills:
            break
        out = folder / f"set-{number}"
        for _ in range(KILLS_PER_SET):
            if is_whole(out) or outcome["parent"] + outcome["worker"] >= n_kills:
                break
            begun = (out / "manifest.json").is_file()
            if out.exists() and not begun:
                outcome["folder half made: refused or removed"] += 1
                break
            command = gensig("resume", str(out), "--workers", "2") if begun else gensig("generate", *SET, f"out={out}")
            outcome[kill_once(command, out, seconds, rng)] += 1
            if (out / "manifest.json").is_file():
                found = verify(out)
                if found.complete != is_whole(out):
                    problems.append(f"set {number}: looks whole and is not: {found.problems[0]}")
        if not (out / "manifest.json").is_file():
            continue
        done = subprocess.run(gensig("resume", "--quiet", str(out)), capture_output=True, text=True, check=False)
        outcome["sets"] += 1
        if done.returncode:
            problems.append(f"set {number}: resume ended with {done.returncode}: {done.stderr[-300:]}")
        elif not verify(out).complete:
            problems.append(f"set {number}: {verify(out).problems[0]}")
        else:
            made = contents(out)
            different = sorted(name for name in {*wanted, *made} if wanted.get(name) != made.get(name))
            problems += [f"set {number}: {name} differs" for name in different]
    return outcome, problems


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        outcome, problems = campaign(arguments.kills, arguments.seed, Path(folder))
    facts = ", ".join(f"{name} {count}" for name, count in sorted(outcome.items()))
    print(f"{facts}; {len(problems)} problem(s), {time.monotonic() - begin:.0f} s")
    for problem in problems:
        print(problem)
    return 1 if problems or outcome["parent"] + outcome["worker"] < arguments.kills else 0


if __name__ == "__main__":
    sys.exit(main())
