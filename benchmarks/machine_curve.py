"""Score by the number of machines to learn from: ``python -m benchmarks.machine_curve FOLDER``.

``FOLDER`` gets a data set of 850 machines with the plan of `experiment=quickstart`. Of these 200
are tested and 50 calibrate. The default network is trained on more and more of the others, without
and with a sound record of each machine, and on records of half the length. An hour on two cores.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import gensig
from benchmarks.general_model import say
from diagnose.data.windows import (
    FloatArray,
    IntArray,
    Segments,
    Task,
    WindowSet,
    all_segments,
)
from diagnose.networks.registry import input_of
from diagnose.scoring.metrics import (
    confusion_by_unit,
    over_records,
    recall,
    score_with_interval,
)
from diagnose.settings import TrainSettings, settings_from
from diagnose.studies.class_jobs import with_reference
from diagnose.studies.study import task_from
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.train import train_network
from diagnose.workers import call_all
from gensig.execution.base import read_n_workers
from gensig.options.compose import compose

SEED = 11
RECORDS_A_MACHINE = 4
N_TEST, N_VALIDATION = 200, 50  # machines
MACHINES = (5, 10, 30, 70, 140, 275, 600)
N_BOOTSTRAP = 2000
REFERENCE = "other_condition"


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One training: what its network sees, and the machines that it learns from."""

    title: str
    share: float  # of a record, from its begin
    with_sound_record: bool
    n_machines: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Result of a case.

    Attributes
    ----------
    score : balanced accuracy, as of `diagnose.scoring.metrics.score_with_interval`
    recalls : class -> share found
    seconds : of the training, with other work on the second core
    """

    case: Case
    score: tuple[float, float | None, float | None]
    recalls: Mapping[str, float]
    seconds: float

    def text(self) -> str:
        """The row in Markdown."""
        mean, low, high = self.score
        recalls = " | ".join(f"{share:.2f}" for share in self.recalls.values())
        return (
            f"| {self.case.title} | {self.case.n_machines} | "
            f"{self.case.n_machines * RECORDS_A_MACHINE} | "
            f"{mean:.3f} [{low:.3f}, {high:.3f}] | {recalls} | {self.seconds:.0f} |"
        )


INPUTS = {"whole": (1.0, False), "half": (0.5, False), "sound_record": (1.0, True)}


def cases(inputs: Sequence[str], machines: Sequence[int]) -> list[Case]:
    """Trainings of some inputs on some numbers of machines, the longest first."""
    return [
        Case(
            title=name,
            share=INPUTS[name][0],
            with_sound_record=INPUTS[name][1],
            n_machines=number,
        )
        for name in inputs
        for number in sorted(machines, reverse=True)
    ]


def begins(task: Task, share: float) -> Segments:
    """The first part of every record that is an example."""
    whole = all_segments(task)
    stop = np.ceil(share * whole.stop).astype(np.int64)
    return Segments(record=whole.record, start=whole.start, stop=stop)


_loaded: dict[tuple[float, bool], WindowSet] = {}  # of a process


def windows_of(task: Task, settings: TrainSettings, case: Case) -> WindowSet:
    """Inputs of all records; the last ones made stay in the process."""
    key = (case.share, case.with_sound_record)
    if key not in _loaded:
        _loaded.clear()
        inputs = input_of(settings.model)
        _loaded[key] = inputs.load(task, begins(task, case.share))
    return _loaded[key]


def run_case(folder: str, case: Case) -> Row:
    """Train on some machines and judge on the test machines."""
    words = [f"data={folder}", "out=.", f"reference={REFERENCE}"]
    settings = settings_from(compose("train", words))
    dataset = gensig.open_dataset(folder)
    task = task_from(dataset, settings)
    if case.with_sound_record:
        settings = with_reference(settings)
    windows = windows_of(task, settings, case)
    unit = np.unique(dataset.column("unit_id"), return_inverse=True)[1][windows.record]
    last = int(unit.max()) + 1
    test = np.flatnonzero(unit >= last - N_TEST)
    held_out = np.flatnonzero(
        (unit >= last - N_TEST - N_VALIDATION) & (unit < last - N_TEST)
    )
    learnt = np.flatnonzero(unit < case.n_machines)
    begin = time.perf_counter()
    training = train_network(
        windows.subset(learnt),
        windows.subset(held_out),
        target=Classes(n_classes=len(task.class_names)),
        settings=replace(settings, device="cpu"),
        seed=0,
    )
    seconds = time.perf_counter() - begin
    judged = windows.subset(test)
    record, answers = over_records(
        predict_windows(training.model, judged), judged.record
    )
    return _row(case, task, record, answers, seconds)


def _row(
    case: Case, task: Task, record: IntArray, answers: FloatArray, seconds: float
) -> Row:
    """Scores of the answers (record, class) of a case."""
    label, names = task.labels()[record], task.class_names
    unit = np.asarray(task.dataset.column("unit_id"))[record]
    counts = confusion_by_unit(label, answers.argmax(axis=1), unit, len(names))
    score = score_with_interval(
        "balanced_accuracy",
        counts[None],
        n_bootstrap=N_BOOTSTRAP,
        rng=np.random.default_rng(0),
    )
    return Row(
        case=case,
        score=(score["mean"], score["low"], score["high"]),
        recalls=dict(zip(names, recall(counts.sum(axis=0)).tolist(), strict=True)),
        seconds=seconds,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the data set where it is missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="gets the data set")
    parser.add_argument("--workers", type=int, default=read_n_workers(None))
    parser.add_argument(
        "--inputs",
        nargs="+",
        default=list(INPUTS),
        choices=list(INPUTS),
        metavar="NAME",
    )
    parser.add_argument("--machines", nargs="+", type=int, default=list(MACHINES))
    given = parser.parse_args(arguments)
    n_units = max(MACHINES) + N_VALIDATION + N_TEST
    if not given.folder.exists():
        gensig.generate(
            "experiment=quickstart",
            f"plan.n_units={n_units}",
            f"plan.n_records={n_units * RECORDS_A_MACHINE}",
            f"seed={SEED}",
            out=str(given.folder),
        )
    say("| input | machines | records | balanced accuracy | recalls | seconds |")
    call_all(
        run_case,
        (str(given.folder),),
        cases(given.inputs, given.machines),
        n_workers=given.workers,
        on_done=lambda case, row: say(row.text()),
        remedy="use fewer workers",
    )


if __name__ == "__main__":
    # worker processes import what they run by the name of its module
    from benchmarks import machine_curve

    machine_curve.main()
