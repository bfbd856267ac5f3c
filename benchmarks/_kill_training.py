"""Studies of ``diagnose train`` stopped at random moments, gone on with, and compared.

Each stop is SIGKILL, SIGTERM or SIGINT, of the parent alone or of its whole process group. One run
in five is the command itself; the others are forked from this process, which has imported
everything, half of them with two workers, which import everything again.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import count, cycle
from pathlib import Path
from typing import NoReturn

import diagnose.commands.resume
import diagnose.report.page
import diagnose.studies.study
from benchmarks._process_groups import alive_in_group
from diagnose.cli import main as diagnose
from diagnose.training.study_folder import FINISHED_JOBS, STUDY, read_study
from gensig.cli import main as gensig

SET = (
    "plan.n_records=48",
    "plan.n_units=12",
    "plan.classes=[healthy,crack]",
    "operating.duration_s=0.1",
    "sensing.channels=[pinion_y]",
    "executor.n_workers=1",
)
STUDY_WORDS = (
    *("model=cnn", "model.widths=[8,16]", "model.kernels=[32,5]"),
    *("model.strides=[8,4]", "protocols=[by_unit]", "window_samples=1600", "epochs=3"),
    *("seeds=[0,1,2,3]", "n_bootstrap=50", "baselines=[indicators]"),
)
OUT = "study"
PAGES = ("report.html", "report.md", "metrics.json")  # tell the time
STOPS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
STATUS = {signal.SIGTERM: 143, signal.SIGINT: 130}
SAID = {signal.SIGTERM: "stopped by SIGTERM", signal.SIGINT: "interrupted"}
STOPS_PER_STUDY = 4
LONGEST = 600.0  # s for a run; one that takes longer hangs
ENDING = 20.0  # s in which the last process of a stopped run must be gone


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """Kind of a run: the command or a fork, and its number of workers."""

    name: str
    is_command: bool
    n_threads: int


FORK = Mode(name="fork", is_command=False, n_threads=1)
FORK_WITH_WORKERS = Mode(name="fork with workers", is_command=False, n_threads=2)
COMMAND = Mode(name="command with workers", is_command=True, n_threads=2)
MODES = (FORK_WITH_WORKERS, FORK, COMMAND, FORK, FORK_WITH_WORKERS)


class Study:
    """A run of ``diagnose`` in a process group of its own, with a folder that is its own."""

    def __init__(self, folder: Path, data: Path, mode: Mode) -> None:
        self.out, self.told = folder / OUT, folder / "told"
        folder.mkdir(exist_ok=True)
        words = ["train", f"data={data}", f"out={OUT}", *STUDY_WORDS]
        words.append(f"n_threads={mode.n_threads}")
        self.told.unlink(missing_ok=True)
        self._status: int | None = None
        self.group = os.fork()
        if self.group == 0:
            _run(words, folder, self.told, mode.is_command)
        while self.wait(0.001) is None and not self.told.exists():
            pass

    def wait(self, seconds: float) -> int | None:
        """Exit status, negative for a signal; None where it still runs after that time."""
        deadline = time.monotonic() + seconds
        while self._status is None:
            ended, status = os.waitpid(self.group, os.WNOHANG)
            if ended:
                self._status = os.waitstatus_to_exitcode(status)
            elif time.monotonic() >= deadline:
                break
            else:
                time.sleep(min(seconds, 0.005))
        return self._status

    def stop(self, number: signal.Signals, *, of_group: bool) -> int | None:
        """Send a signal; returns the exit status, None for a run that does not end."""
        send = os.killpg if of_group else os.kill
        with suppress(ProcessLookupError):
            send(self.group, number)
        return self.wait(LONGEST)


def _run(words: list[str], folder: Path, told: Path, is_command: bool) -> NoReturn:
    """Run in a child of this process, which ends here."""
    os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(folder)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    if is_command:
        os.execv(sys.executable, [sys.executable, "-m", "diagnose.cli", *words])
    sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
    status = 70
    try:
        status = diagnose(words)
        sys.stderr.flush()
    finally:
        os._exit(status)


def contents(out: Path) -> dict[str, bytes]:
    """Every file of a study, hidden ones included; of ``metrics.json`` without its times."""
    files = [path for path in out.rglob("*") if path.is_file()]
    result = {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in files
        if path.name not in PAGES
    }
    metrics = json.loads((out / "metrics.json").read_text())
    del metrics["duration_s"], metrics["environment"]["finished"]
    metrics["settings"]["n_threads"] = None
    result["metrics.json"] = json.dumps(metrics).encode()
    result[STUDY] = b"complete" if read_study(out).is_complete else b"begun"
    return result


def kill_trainings(
    n_kills: int, seed: int, folder: Path
) -> Iterator[tuple[str, list[str]]]:
    """Kind of each stop, and the faults found after it or after a finished study."""
    rng, data = random.Random(seed), folder / "data"
    if gensig(["generate", "--quiet", *SET, f"out={data}"]):
        raise SystemExit("the data set could not be made")
    seconds: dict[Mode, float] = {}
    wanted: dict[str, bytes] = {}
    for mode in (FORK, FORK_WITH_WORKERS, COMMAND):
        begin = time.monotonic()
        run = Study(folder / mode.name, data, mode)
        if run.wait(LONGEST) != 0:
            raise SystemExit(f"an undisturbed study failed: {run.told.read_text()}")
        seconds[mode] = time.monotonic() - begin
        made = contents(run.out)
        yield f"undisturbed: {mode.name}", differences(wanted or made, made)
        wanted = wanted or made
    stops = [(number, of_group) for number in STOPS for of_group in (False, True)]
    kinds, modes, n_done = cycle(rng.sample(stops, len(stops))), cycle(MODES), 0
    for number in count():
        if n_done >= n_kills:
            return
        place = folder / f"study-{number}"
        for _ in range(STOPS_PER_STUDY):
            if n_done >= n_kills or (place / OUT / "report.html").is_file():
                break
            mode, (stop, of_group) = next(modes), next(kinds)
            run = Study(place, data, mode)
            name = f"{stop.name} to {'the group' if of_group else 'the parent'}"
            if _ended_before(run, seconds[mode], rng):
                yield "ended first", []
                break
            n_done += 1
            yield f"{name}, {mode.name}", _stopped(run, stop, of_group=of_group)
        yield "studies", _finished(place, data, wanted)


def _ended_before(run: Study, seconds: float, rng: random.Random) -> bool:
    """Wait for a random moment; True for a run that ended before."""
    wait, limit = rng.uniform(0.0, 0.95 * seconds), time.monotonic() + LONGEST
    if rng.random() < 0.5:  # soon after the next job is finished
        before = _kept(run.out)
        while _kept(run.out) == before and time.monotonic() < limit:
            if run.wait(0.005) is not None:
                return True
        wait *= 0.2
    return run.wait(wait) is not None


def _kept(out: Path) -> list[str]:
    with suppress(OSError):
        return sorted(os.listdir(out / FINISHED_JOBS))
    return []


def _stopped(run: Study, number: signal.Signals, *, of_group: bool) -> list[str]:
    """Stop a run; returns what is wrong with its end."""
    status = run.stop(number, of_group=of_group)
    problems = []
    if status is None:
        problems.append(f"{number.name}: it goes on")
        run.stop(signal.SIGKILL, of_group=True)
    deadline = time.monotonic() + ENDING
    while left := alive_in_group(run.group):
        if time.monotonic() > deadline:
            problems.append(f"{number.name}: left running: {left}")
            run.stop(signal.SIGKILL, of_group=True)
            break
        time.sleep(0.02)
    if number == signal.SIGKILL or status == 0:
        return problems
    lines = run.told.read_text().splitlines()
    is_early = status in (-number, 1) and not run.out.exists()  # while Python starts
    if not is_early and (status != STATUS[number] or not is_one_line(lines, number)):
        problems.append(f"{number.name}: status {status}, said {lines[-3:]}")
    return problems


def is_one_line(lines: list[str], number: signal.Signals) -> bool:
    """True where progress is followed by one line on the signal, and by nothing else."""
    said = [line for line in lines if not line.startswith("[")]
    return len(said) == 1 and said[0].startswith(f"diagnose: {SAID[number]}; ")


def _finished(place: Path, data: Path, wanted: dict[str, bytes]) -> list[str]:
    """Go on to the end; returns what is not as in an undisturbed study."""
    run = Study(place, data, FORK)
    status = run.wait(LONGEST)
    is_complete = (run.out / STUDY).is_file() and read_study(run.out).is_complete
    if not is_complete:
        return [f"the run after the stops ended with {status}: {run.told.read_text()}"]
    here = os.getcwd()
    os.chdir(place)
    try:
        if diagnose(["resume", OUT]):
            return ["resume of a complete study fails"]
    finally:
        os.chdir(here)
    return differences(wanted, contents(run.out))


def differences(wanted: dict[str, bytes], made: dict[str, bytes]) -> list[str]:
    """Names of files that are not the same in two studies."""
    names = sorted({*wanted, *made})
    return [f"{name} differs" for name in names if wanted.get(name) != made.get(name)]
