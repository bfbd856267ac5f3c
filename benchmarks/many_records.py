"""Memory of a large data set: ``python -m benchmarks.many_records``.

Makes 100,000 records of 0.1 s and one channel on two workers, as anyone would, and prints the
largest sum of the memory of all its processes (proportional set size, Linux). It takes about an
hour on two idle cores; ``--minutes N`` stops earlier, after which ``gensig resume`` could go
on.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks._measure import machine, print_machine

WORDS = (
    "experiment=quickstart",
    "operating.duration_s=0.1",
    "sensing.channels=[pinion_y]",
    "executor.n_workers=2",
    "dataset.records_per_shard=null",
)
LIMIT_MB = 1500
EVERY_S = 2.0


def family(process: int) -> list[int]:
    """A process and all that it started."""
    result = [process]
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        try:
            result += [
                one for child in task.read_text().split() for one in family(int(child))
            ]
        except OSError:
            continue
    return result


def memory(process: int) -> int:
    """Bytes of a process, what it shares counted in parts; 0 when it is gone."""
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) * 1024 for line in lines if line.startswith("Pss:"))


def main() -> int:
    """Measure and print; 1 where the limit is passed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.many_records", description=__doc__.split("\n")[0]
    )
    parser.add_argument(
        "--records", type=int, default=100_000, help="(default 100,000)"
    )
    parser.add_argument(
        "--minutes", type=float, default=240.0, help="stop after so many (default 240)"
    )
    arguments = parser.parse_args()
    print_machine(machine())
    with tempfile.TemporaryDirectory() as folder:
        out, begun, peak = Path(folder) / "set", time.monotonic(), 0
        code = "import sys; from gensig.cli import main; sys.exit(main(sys.argv[1:]))"
        command = [
            sys.executable,
            "-c",
            code,
            "generate",
            "--quiet",
            *WORDS,
            f"plan.n_records={arguments.records}",
        ]
        with subprocess.Popen([*command, f"out={out}"]) as run:
            while (
                run.poll() is None
                and time.monotonic() - begun < 60.0 * arguments.minutes
            ):
                peak = max(peak, sum(memory(one) for one in family(run.pid)))
                time.sleep(EVERY_S)
            if run.poll() is None:
                run.send_signal(signal.SIGINT)
                try:
                    run.wait(timeout=30.0)
                except (
                    subprocess.TimeoutExpired
                ):  # a shell that starts jobs in the background lets them ignore it
                    run.terminate()
        n_shards = len(list((out / "shards").glob("shard-*.h5")))
    told = "within" if peak < LIMIT_MB * 1e6 else "beyond"
    print(
        f"{arguments.records} records, {n_shards} shards whole after "
        f"{time.monotonic() - begun:.0f} s: at most "
        f"{peak / 1e6:.0f} MB in all processes, {told} {LIMIT_MB}"
    )
    return int(told == "beyond")


if __name__ == "__main__":
    sys.exit(main())
