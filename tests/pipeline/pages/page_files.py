"""Files that the commands of pages name and do not make: recordings, tables and options."""

import contextlib
import csv
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from docs_pages import ROOT, blocks
from least_runs import values_behind
from scipy import io

import gensig.cli

sys.path.append(str(ROOT / "tests" / "unit" / "measured"))
sys.path.append(str(ROOT / "tests" / "unit" / "diagnose" / "bridge"))
sys.path.append(str(ROOT / "tests" / "unit" / "diagnose" / "detection"))
from fake_gearbox import Box
from made_rig import write_rig
from made_sets import write_mcc5_thu

from diagnose.detection.gear_stages import stages_of

TABLES = ROOT / "configs" / "tables"
LIVES = ("runs/hours/", "runs/remaining/")  # networks that read windows of time


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """The recordings that a command reads, as its words state them.

    Attributes
    ----------
    teeth : of the driving and the driven gear of each stage
    speed : of the driving shaft, r/min
    rate, seconds : samples a second, and duration
    channels : names
    with_pulses : True if a channel has a pulse at every turn of the driving shaft
    """

    teeth: tuple[int, ...] = (23, 84)
    speed: float = 1500.0
    rate: float = 12800.0
    seconds: float = 4.0
    channels: tuple[str, ...] = ("pinion_x", "pinion_y", "wheel_x", "wheel_y")
    with_pulses: bool = False


def recorded(words: Sequence[str]) -> Recorded:
    """The recordings of a command, read from its words."""
    said = {}
    teeth = values_behind(words, "--teeth")
    if teeth:
        said["teeth"] = tuple(map(int, teeth))
    for flag in ("--speed-rpm", "--speed"):
        for value in values_behind(words, flag):
            said["speed"] = float(value)
    for value in values_behind(words, "--sampling-rate"):
        said["rate"] = float(value)
    if any(word.startswith(LIVES) for word in words):
        said |= {"rate": 51200.0, "seconds": 1.0}
    if words[1] != "predict" or "--held-out" in words:
        said["channels"] = ("case",)
    if "left" in words:
        said["channels"] = ("left", "right")
    if any(word.startswith("runs/bridge_report/") for word in words):
        said["channels"] = ("housing_input", "housing_output", "housing_top")
    if words[1] == "implant" or "--held-out" in words:
        said["seconds"] = 18.0
    if "--tacho" in words:
        said["with_pulses"] = True
    return Recorded(**said)


def write_files_of(page: str) -> None:
    """Write the blocks of a page that are files below ``<!-- file NAME -->``."""
    for block in blocks(page):
        if block.mark.startswith("file "):
            path = Path(block.mark.removeprefix("file "))
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.code + "\n", encoding="utf-8")


def _signals(path: Path, of: Recorded) -> np.ndarray:
    """(channel, sample) of a healthy machine; files of other names are other sessions."""
    box = Box(stages=stages_of(of.teeth))
    first = sum(path.name.encode())
    return np.concatenate(
        [
            box.record(
                first + k, seconds=of.seconds, speed_rpm=of.speed, rate=of.rate
            ).acceleration
            for k in range(len(of.channels))
        ]
    )


def _write_csv(path: Path, of: Recorded) -> None:
    """Columns of time, of the channels and of the pulses."""
    signals = _signals(path, of)
    time = np.arange(signals.shape[1]) / of.rate
    table = {"time_s": time}
    for name, signal in zip(of.channels, signals, strict=True):
        table[name] = signal
    if of.with_pulses:
        table["pulses"] = np.mod(time * of.speed / 60.0, 1.0) < 0.05
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        writer.writerows(np.round(list(table.values()), 9).T.tolist())


def _write_wav(path: Path, of: Recorded) -> None:
    io.wavfile.write(path, round(of.rate), _signals(path, of).T.astype(np.float32))


def _write_mat(path: Path, of: Recorded) -> None:
    io.savemat(path, {"X097_DE_time": _signals(path, of)})


def _write_npy(path: Path, of: Recorded) -> None:
    np.save(path, _signals(path, of))


def _write_set(path: Path, of: Recorded) -> None:
    path.mkdir(parents=True)
    write_mcc5_thu(path)


def _write_rig(path: Path, of: Recorded) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_rig(path.parent, n_repeats=1)


def _table(name: str) -> Callable[[Path, Recorded], None]:
    def write(path: Path, of: Recorded) -> None:
        shutil.copyfile(TABLES / name, path)

    return write


def _speed_course(path: Path, of: Recorded) -> None:
    path.write_text("time_s,speed_rpm\n0,900\n0.5,1500\n1,1200\n")


def _configuration(path: Path, of: Recorded) -> None:
    words = ["plan", "experiment=quickstart", "plan.n_records=24", "--show-config"]
    with path.open("w") as file, contextlib.redirect_stdout(file):
        gensig.cli.main([*words, "operating.duration_s=0.5"])


Write = Callable[[Path, Recorded], None]
BY_SUFFIX: dict[str, Write] = {
    ".csv": _write_csv,
    ".wav": _write_wav,
    ".mat": _write_mat,
    ".npy": _write_npy,
}
OTHERS: dict[str, Write] = {
    "my.csv": _speed_course,
    "downloads/mcc5_thu": _write_set,
    "rig/measured.yaml": _write_rig,
    "mine.yaml": _configuration,
    "my_gears.csv": _table("two_stage_gears.csv"),
}


def write_named(name: str, words: Sequence[str]) -> None:
    """Write the file of a name as a command needs it; nothing for a name that is no such file."""
    path, of = Path(name), recorded(words)
    if name in OTHERS:
        if not path.exists():
            OTHERS[name](path, of)
    elif name == "mine.csv" and words[1] == "modes":
        _table("two_stage_shafting.csv")(path, of)
    elif path.suffix in BY_SUFFIX and path.parent == Path():
        BY_SUFFIX[path.suffix](path, of)
