"""Every verb that writes, killed before one of its file operations and then typed again."""

from __future__ import annotations

import errno
import random
import re
import shlex
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks._file_operations import Ended, kill_at, refuse_from, run_command
from gensig.cli import main as gensig
from gensig.dataset.exports.export import FORMATS
from gensig.dataset.folder.layout import MANIFEST, read_manifest
from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.implants import implant_plan

OF_SENSOR = ("sensing.channels=[pinion_y]", "executor.n_workers=1")
SET = (
    *OF_SENSOR,
    "plan.n_records=8",
    "plan.classes=[healthy,crack]",
    "dataset.records_per_shard=4",
    "operating.duration_s=0.02",
)
RATE = "sensing.sampling_rate_hz=12800"
FAULTS = (
    *OF_SENSOR,
    RATE,
    "plan.classes=[healthy,missing_tooth,wear]",
    "plan.n_records=18",
    "plan.n_units=6",
    "plan.machines=separate",
    "operating.duration_s=0.4",
    "sensing.snr_db=null",
    "dataset.store_healthy_twin=true",
)
TEETH, SPEED = ("20", "33"), "1500"
MACHINE = (
    *OF_SENSOR,
    RATE,
    f"gear.pinion.n_teeth={TEETH[0]}",
    f"gear.wheel.n_teeth={TEETH[1]}",
    f"operating.speed_rpm={SPEED}",
    "operating.torque_nm=20",
    "plan.classes=[healthy]",
    "plan.n_records=1",
    "operating.duration_s=6",
)
NEW = "new gearbox mine --teeth 20 45 --module 3 --speed 1500 --torque 60 --no-level"
STAGED = "new gearbox two --teeth 20 45 23 61 --module 2 3 --speed 1500 --torque 60 --no-level"
# files of a data set that tell of time and place, and its closing
NOT_COMPARED = {
    MANIFEST,
    "README.md",
    "croissant.json",
    "SHA256SUMS",
    "run.log",
    ".beginning",
}
IMPLANT_SHARD = 2**19  # bytes, so that a small set of implants has several shards
SHARE = {"generate": 4, "implant": 4, "resume": 3, "resume implants": 3, "finalize": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A command, in a folder where it finds what it goes on with.

    Attributes
    ----------
    words : of the command; what it writes is named from its folder
    target : file or folder that it writes
    begun : folder of which the target is a copy at first; None: there is none
    """

    words: tuple[str, ...]
    target: str
    begun: Path | None = None

    def folder(self, path: Path) -> Path:
        """Make a folder in which the command can run."""
        path.mkdir()
        if self.begun is not None:
            shutil.copytree(self.begun, path / self.target)
        return path


class Kit:
    """Inputs of all cases, each made when it is first asked for.

    Folders of cases lie beside ``folder``, which places of implants count on.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()

    @cached_property
    def whole(self) -> Path:
        """A data set that is complete."""
        out = self.folder / "whole"
        _make("generate", "--quiet", *SET, f"out={out}")
        return out

    @cached_property
    def begun(self) -> Path:
        """The same without a shard."""
        out = self.folder / "begun"
        _make("plan", "--freeze", *SET, f"out={out}")
        return out

    @cached_property
    def made(self) -> Path:
        """The same with all shards, by a task of an array job."""
        out = self.folder / "made"
        shutil.copytree(self.begun, out)
        task = ("executor=slurm", "executor.shard_index=0", "executor.shard_count=1")
        words = [word for word in SET if not word.startswith("executor")]
        _make("generate", "--quiet", *words, *task, f"out={out}")
        return out

    @cached_property
    def implant(self) -> tuple[str, ...]:
        """A small ``gensig implant``, with its simulated set and its recording."""
        faults, machine = self.folder / "faults", self.folder / "machine"
        _make("generate", "--quiet", *FAULTS, f"out={faults}")
        _make("generate", "--quiet", *MACHINE, f"out={machine}")
        file = self.folder / "healthy.npz"
        with open_dataset(machine) as data:
            rate = data.sampling_rate
            np.savez(file, acceleration=data.signals(0), sampling_rate_hz=rate)
        words = ("implant", str(faults), "out=data", "--teeth", *TEETH)
        return (*words, "--speed-rpm", SPEED, "--records", "48", "--healthy", str(file))

    @cached_property
    def begun_implants(self) -> Path:
        """A set of implants without a shard."""
        out = self.folder.parent / "implants" / "data"
        for number in count(40, 4):
            out.parent.mkdir()
            ended = run_command(self.implant, out.parent, kill_at(number))
            if (out / MANIFEST).is_file() or not ended.status:
                break
            shutil.rmtree(out.parent)
        return out


def _make(*words: str) -> None:
    if gensig(words):
        raise SystemExit(f"gensig {' '.join(words)} failed")


RESUME = ("resume", "data", "-j", "1")


def _export(name: str) -> Callable[[Kit], Case]:
    def case(kit: Kit) -> Case:
        words = ("export", str(kit.whole), "--to", name, "--out", "there")
        return Case(words=words, target="there")

    return case


CASES: dict[str, Callable[[Kit], Case]] = {
    "generate": lambda _: Case(words=("generate", *SET, "out=data"), target="data"),
    "plan --freeze": lambda _: Case(
        words=("plan", "--freeze", *SET, "out=data"), target="data"
    ),
    "resume": lambda kit: Case(words=RESUME, target="data", begun=kit.begun),
    "finalize": lambda kit: Case(
        words=("finalize", "data"), target="data", begun=kit.made
    ),
    "implant": lambda kit: Case(words=kit.implant, target="data"),
    "resume implants": lambda kit: Case(
        words=RESUME, target="data", begun=kit.begun_implants
    ),
    "report": lambda kit: Case(
        words=("report", str(kit.whole), "--out", "page.html"), target="page.html"
    ),
    "reproduce": lambda kit: Case(
        words=("reproduce", "data", "--records", "2"), target="data", begun=kit.whole
    ),
    "new": lambda _: Case(words=(*NEW.split(), "--dir", "options"), target="options"),
    "new, stages": lambda _: Case(
        words=(*STAGED.split(), "--dir", "options"), target="options"
    ),
    **{f"export {name}": _export(name) for name in FORMATS},
}


def contents(path: Path) -> dict[str, bytes]:
    """Bytes of a file, or of all files of a folder that must be equal; no hidden ones."""
    if path.is_file():
        return {"": path.read_bytes()}
    files = [each for each in path.rglob("*") if each.is_file()]
    return {
        each.relative_to(path).as_posix(): each.read_bytes()
        for each in files
        if each.name not in NOT_COMPARED and not each.name.startswith(".")
    }


def hidden(path: Path) -> list[str]:
    """Hidden files in a folder: those of writers that were killed."""
    return sorted(each.name for each in path.rglob(".*"))


def kill_verbs(
    n_kills: int,
    seed: int,
    folder: Path,
    names: Sequence[str] = tuple(CASES),
    *,
    full: bool = False,
) -> Iterator[tuple[str, list[str]]]:
    """Name of a case and its problems, a kill at a time; every case has at least one.

    The kills of a case are spread over its operations, at random within each stretch.

    Parameters
    ----------
    names : cases of `CASES` that are killed
    full : the disk is full from an operation on, in place of the kill
    """
    kit, rng = Kit(folder / "kit"), random.Random(seed)
    shares = [name for name in names for _ in range(SHARE.get(name, 1))]
    taken = Counter(names)
    while taken.total() < n_kills:
        wanted = n_kills - taken.total()
        taken.update(rng.sample(shares, min(len(shares), wanted)))
    with patch.object(implant_plan, "SHARD_BYTES", IMPLANT_SHARD):
        for name in names:
            case = CASES[name](kit)
            wanted, n_operations = _undisturbed(case, folder / "undisturbed")
            for number in range(taken[name]):
                share = (number + rng.random()) / taken[name]
                at = 1 + int(share * max(n_operations, 1))
                problems = stopped_case(case, at, wanted, folder / "stopped", full=full)
                where = f"{name}, operation {at} of {n_operations}"
                yield name, [f"{where}: {line}" for line in problems]


def _undisturbed(case: Case, folder: Path) -> tuple[dict[str, bytes], int]:
    ended = run_command(case.words, case.folder(folder))
    if ended.status:
        raise SystemExit(f"undisturbed {case.words[0]} failed: {ended.said}")
    wanted = contents(folder / case.target)
    shutil.rmtree(folder)
    return wanted, ended.n_operations


def stopped_case(
    case: Case, at: int, wanted: dict[str, bytes], folder: Path, *, full: bool
) -> list[str]:
    """Stop a command before an operation, type it again, do as it says; returns what is wrong."""
    target = case.folder(folder) / case.target
    if full:
        before = contents(target)
        ended = run_command(case.words, folder, refuse_from(at, errno.ENOSPC))
        problems = _not_told(ended, before, contents(target), wanted)
    else:
        run_command(case.words, folder, kill_at(at))
        problems = []
    problems += _not_whole(target, wanted)
    again = run_command(case.words, folder)
    problems += _followed(again, folder, contents(target) == wanted)
    made = contents(target)
    if case.words[0] == "plan" and (target / MANIFEST).is_file():
        made = {name: made[name] for name in made if name in wanted}  # no shards
    problems += sorted(
        f"{name or 'the file'} differs in the end"
        for name in {*wanted, *made}
        if wanted.get(name) != made.get(name)
    )
    if (target / MANIFEST).is_file() and read_manifest(target).is_complete:
        problems += verify(target).problems + hidden(target)
    shutil.rmtree(folder)
    return problems


def _not_told(
    ended: Ended,
    before: dict[str, bytes],
    after: dict[str, bytes],
    wanted: dict[str, bytes],
) -> list[str]:
    """Faults of the end of a command on a full disk, which may refuse its log alone."""
    if ended.status == 0:
        return [] if after == wanted else ["ends with 0 and is not whole"]
    if ended.status not in (1, 2) or "free some space" not in ended.said:
        return [f"ends with {ended.status}: {ended.said[-300:]}"]
    if after != before and after != wanted and "gensig resume" not in ended.said:
        return [f"leaves {sorted(after)} and does not say how it goes on"]
    return []


def _not_whole(target: Path, wanted: dict[str, bytes]) -> list[str]:
    """Files after the kill that are neither whole nor absent; a set that looks whole and is not."""
    lines = [
        f"{name} is not whole"
        for name, content in contents(target).items()
        if name in wanted and content != wanted[name]
    ]
    if (target / MANIFEST).is_file():
        is_whole = read_manifest(target).is_complete
        if is_whole != verify(target).complete:
            lines.append("looks whole and is not")
    return lines


def _followed(again: Ended, folder: Path, is_there: bool) -> list[str]:
    """Do what the command says when it is typed again; returns what is wrong with that."""
    lines = again.said.splitlines()
    if again.status == 0:
        return []
    if again.status != 2 or len(lines) != 1:
        return [f"typed again it ends with {again.status}: {again.said[-300:]}"]
    remedy = re.search("`gensig ([^`]*)`", lines[0])
    if remedy is None:
        return [] if is_there else [f"typed again it is refused: {lines[0]}"]
    ended = run_command(shlex.split(remedy[1]), folder)
    if ended.status:
        return [f"`gensig {remedy[1]}` ends with {ended.status}: {ended.said[-300:]}"]
    return []
