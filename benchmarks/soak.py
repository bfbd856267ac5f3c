"""Endurance and rivals: ``python -m benchmarks.soak [PART ...] [--records 100000]``.

Parts, all by default:

- ``endurance``: a data set of many short records is made by two workers, then read record by
  record. Memory and open files of every process are sampled; they must not grow.
- ``loaders``: four loader workers of torch, forked and spawned, read a set. Each must yield every
  window once, with the bits of a reader in one process.
- ``readers``: processes read a set while it is made, and simulate what they read anew.
- ``rivals``: two ``gensig generate`` begin in one folder, and two ``gensig resume`` finish it. One
  wins, the other says so, and the set is whole.

Needs Linux (/proc). The exit status is 1 where a part fails.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.errors import GensigError
from gensig.production.reproduction import recorded_row
from gensig.record.simulate import simulate_record

SHORT = (
    "plan.classes=[healthy,crack]",
    "plan.n_units=4",
    "operating.duration_s=0.01",
    "sensing.channels=[pinion_y]",
)
SECONDS = 1.0  # between samples
MOST_GROWTH = 0.10  # of the memory, from the first third of a run to the last


@dataclass(slots=True)
class Samples:
    """Memory in bytes and open files of a process and its children, over time."""

    memory: list[int] = field(default_factory=list)
    files: list[int] = field(default_factory=list)

    def growth(self) -> tuple[float, float]:
        """Relative growth of memory and files, medians of the last third over the second one."""
        third = max(1, len(self.memory) // 3)
        ratios = []
        for values in (self.memory, self.files):
            middle, last = values[third : 2 * third], values[-third:]
            ratios.append(float(np.median(last) / max(np.median(middle), 1.0)) - 1.0)
        return ratios[0], ratios[1]


def family(pid: int) -> list[int]:
    """A process and all its descendants."""
    parents: dict[int, list[int]] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            fields = path.read_text().rpartition(")")[2].split()
            parents.setdefault(int(fields[1]), []).append(int(path.parent.name))
    found, waiting = [], [pid]
    while waiting:
        one = waiting.pop()
        found.append(one)
        waiting += parents.get(one, [])
    return found


def usage(pid: int) -> tuple[int, int]:
    """Memory of a process alone (private and shared pages, bytes) and its open files."""
    with suppress(OSError):
        pages = int((Path("/proc") / str(pid) / "statm").read_text().split()[1])
        n_files = len(os.listdir(f"/proc/{pid}/fd"))
        return pages * os.sysconf("SC_PAGE_SIZE"), n_files
    return 0, 0


@contextmanager
def sampled(pid: int) -> Iterator[Samples]:
    """Sample a process and its descendants until the block ends."""
    samples, ended = Samples(), threading.Event()

    def sample() -> None:
        while not ended.wait(SECONDS):
            uses = [usage(one) for one in family(pid)]
            samples.memory.append(sum(memory for memory, _ in uses))
            samples.files.append(sum(n_files for _, n_files in uses))

    ticker = threading.Thread(target=sample, daemon=True)
    ticker.start()
    try:
        yield samples
    finally:
        ended.set()
        ticker.join()


def command(*words: str) -> list[str]:
    """A command of gensig in this environment."""
    return [sys.executable, "-m", "gensig.cli", *words]


def make(out: Path, n_records: int, *words: str) -> None:
    """A data set, made by this process."""
    from gensig.cli import main

    given = [*SHORT, f"plan.n_records={n_records}", *words, f"out={out}"]
    if main(["generate", "--quiet", *given]):
        raise SystemExit(f"{out} was not made")


def told(samples: Samples) -> str:
    """Peak and growth in words."""
    memory, files = samples.growth()
    peak = max(samples.memory) / 1e6
    return (
        f"peak {peak:.0f} MB in all processes, growth {memory:+.1%}; "
        f"at most {max(samples.files)} open files, growth {files:+.1%}"
    )


def endurance(folder: Path, n_records: int) -> bool:
    """Many short records: made, then read."""
    out = folder / "many"
    words = [*SHORT, f"plan.n_records={n_records}", f"out={out}"]
    begin = time.monotonic()
    process = subprocess.Popen(command("generate", "--quiet", *words, "-j", "2"))
    with sampled(process.pid) as made:
        status = process.wait()
    minutes = (time.monotonic() - begin) / 60.0
    print(f"  {n_records} records made in {minutes:.1f} min: {told(made)}", flush=True)
    begin = time.monotonic()
    with sampled(os.getpid()) as seen, open_dataset(out) as data:
        for index in range(data.n_records):
            data.signals(index)
    seconds = time.monotonic() - begin
    print(f"  read in {seconds:.0f} s: {told(seen)}", flush=True)
    grown = [*made.growth(), *seen.growth()]
    return status == 0 and verify(out).complete and max(grown) <= MOST_GROWTH


def digest(window: np.ndarray) -> bytes:
    """Hash of one window."""
    return hashlib.sha256(np.ascontiguousarray(window).tobytes()).digest()


def loaders(folder: Path, _n_records: int) -> bool:
    """Loader workers of torch, forked and spawned."""
    from torch.utils.data import DataLoader

    from diagnose.data import VibrationDataset

    out = folder / "loaded"
    make(out, 240, "operating.duration_s=0.1", "dataset.records_per_shard=20")
    good = True
    with open_dataset(out) as data:
        windows = VibrationDataset(
            data, "by_unit", "train", window_samples=1024, stride_samples=512
        )
        expected = sorted(
            digest(windows[index][0].numpy()) for index in range(len(windows))
        )
        for start in ("fork", "spawn"):
            begin = time.monotonic()
            loader = DataLoader(
                windows, batch_size=16, num_workers=4, multiprocessing_context=start
            )
            seen = sorted(
                digest(window.numpy()) for batch, _ in loader for window in batch
            )
            same = seen == expected
            good &= same
            rate = len(seen) / (time.monotonic() - begin)
            print(
                f"  4 workers by {start}: {len(seen)} windows, "
                f"{'the same bits' if same else 'OTHER BITS'}, {rate:.0f} a second",
                flush=True,
            )
    return good


READER = """
import sys, time
from benchmarks.soak import read_while_made
print(read_while_made(sys.argv[1]))
"""


def read_while_made(out: str) -> int:
    """Read records of an unfinished set until it is whole; returns how many were checked.

    Every record that is there has the bits of one that is simulated anew.
    """
    checked: set[int] = set()
    while True:
        try:
            with open_dataset(out, allow_incomplete=True) as data:
                whole = data.manifest.is_complete
                there = np.flatnonzero(data.usable)
                for index in there[:: max(1, len(there) // 5)].tolist():
                    stored = data.signals(index)
                    if index not in checked:
                        again = simulate_record(*recorded_row_of(out, index))
                        if again.signals["acceleration"].tobytes() != stored.tobytes():
                            raise SystemExit(f"record {index} has other bits")
                    checked.add(index)
        except GensigError:  # no shard yet
            whole = False
        if whole:
            return len(checked)
        time.sleep(0.05)


def recorded_row_of(out: str, index: int):  # type: ignore[no-untyped-def]
    """Reader and row of a record of an unfinished set."""
    from gensig.dataset.folder.joining import joined_folder
    from gensig.dataset.folder.layout import PLAN
    from gensig.dataset.plan import PlanRows
    from gensig.options.configuration import Configuration
    from gensig.record.inputs import InputReader

    with suppress(GensigError):
        return recorded_row(Path(out), str(index))
    _, config = joined_folder(Path(out))
    (row,) = PlanRows(Path(out) / PLAN).records(index, 1)
    return InputReader(Configuration(config)), row


def readers(folder: Path, _n_records: int) -> bool:
    """Three readers beside a run."""
    out = folder / "read"
    words = [*SHORT, "plan.n_records=2000", "operating.duration_s=0.05"]
    words += ["dataset.records_per_shard=20", f"out={out}"]
    made = subprocess.Popen(command("generate", "--quiet", *words, "-j", "1"))
    watching = [
        subprocess.Popen(
            [sys.executable, "-c", READER, str(out)], stdout=subprocess.PIPE, text=True
        )
        for _ in range(3)
    ]
    status = made.wait()
    counts = [process.communicate()[0].strip() for process in watching]
    good = not any(process.returncode for process in watching)
    text = ", ".join(counts)
    print(
        f"  3 readers checked {text} records of 2000 while they were made", flush=True
    )
    return good and status == 0 and verify(out).complete


def rivals(folder: Path, _n_records: int) -> bool:
    """Two runs in one folder."""
    out, good = folder / "rivals", True
    words = [*SHORT, "plan.n_records=400", "dataset.records_per_shard=10"]
    first = command("generate", "--quiet", *words, f"out={out}", "-j", "1")
    good &= both(first, first, allowed={0, 2})
    good &= verify(out).complete
    other = folder / "halves"
    subprocess.run(command("plan", "--freeze", *words, f"out={other}"), check=True)
    again = command("resume", "--quiet", str(other), "-j", "1")
    good &= both(again, again, allowed={0, 2})
    return good and verify(other).complete


def both(one: Sequence[str], two: Sequence[str], *, allowed: set[int]) -> bool:
    """Run two commands at once; the one that loses says why in one line."""
    running = [
        subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        for words in (one, two)
    ]
    said = [process.communicate()[1] for process in running]
    statuses = [process.returncode for process in running]
    for status, text in zip(statuses, said, strict=True):
        print(f"  {one[3]}: exit status {status} {text.strip()[:160]}", flush=True)
    lines = [text.count("\n") for text in said]
    return 0 in statuses and set(statuses) <= allowed and max(lines) <= 1


PARTS: dict[str, Callable[[Path, int], bool]] = {
    "endurance": endurance,
    "loaders": loaders,
    "readers": readers,
    "rivals": rivals,
}


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], default=[])
    parser.add_argument("--records", type=int, default=100_000)
    arguments = parser.parse_args(argv)
    good = True
    for name in arguments.parts or PARTS:
        print(name, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            passed = PARTS[name](Path(folder), arguments.records)
        print("  held" if passed else "  FAILED", flush=True)
        good &= passed
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
