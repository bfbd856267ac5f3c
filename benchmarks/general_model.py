"""A network for any pair of gears: ``python -m benchmarks.general_model FOLDER``.

It is trained on streamed records of `experiment=many_machines`: every machine has teeth, module,
accuracy, housing, speeds, loads and noise of its own. It is judged on machines that it has not
seen, inside and outside the ranges of its training. ``FOLDER`` gets the network and its card, for
``diagnose predict --model FOLDER``.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._streamed_turns import Words, stream_of, teeth_of, windows_of
from diagnose.data.turns import Turns
from diagnose.data.windows import IntArray, WindowSet
from diagnose.networks.calibration import calibration_scores
from diagnose.networks.domain import distances, fit_domain
from diagnose.networks.registry import input_of
from diagnose.scoring.intervals import interval_text
from diagnose.scoring.metrics import (
    confusion_by_unit,
    over_records,
    recall,
    score_with_interval,
)
from diagnose.settings import TrainSettings, settings_from
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.model_files import MODEL_SCHEMA_VERSION
from diagnose.training.store import (
    ModelDescription,
    save_model,
)
from diagnose.training.train import Training, train_network
from gensig.options.compose import compose

EXPERIMENT = "experiment=many_machines"
N_RECORDS, N_VALIDATION, N_TEST = 20_000, 400, 400
RECORDS_A_UNIT = 4
SEED, VALIDATION_SEED, TEST_SEED = 1, 2, 3
TORQUE = "operating.torque_nm"
FAST = ("solver.precision=float32", "operating.duration_s=0.8")
N_BOOTSTRAP = 2000
# Each epoch draws a third of the inputs: about one of the three sensors of a record.
TRAINING = (
    "model=tooth",
    "model.each_channel=true",
    "model.whitened=true",
    "model.kernels=[17,9]",
    "model.strides=[2,2]",
    "model.level_samples=5",
    "epochs=9",
    "epoch_fraction=0.34",
    "batch_size=32",
    "reference=none",
    "data=.",
    "out=.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TestSet:
    """Machines that the network is judged on: what is special, and the overrides that make them."""

    title: str
    words: Words


def _varied(
    key: str, distribution: str, low: float, high: float, of: str | None = None
) -> str:
    """The override that draws a key from another range."""
    spec = f"distribution: {distribution}, low: {low}, high: {high}"
    if of is not None:
        spec += f", of: {of}"
    return f"plan.vary={{{key}: {{{spec}}}}}"


TEST_SETS = (
    TestSet(title="new machines inside the ranges of the training", words=()),
    TestSet(
        title="pinions of 61 to 90 teeth (trained to 60)",
        words=(_varied("gear.pinion.n_teeth", "integers", 61, 90),),
    ),
    TestSet(
        title="modules of 9 to 14 mm (trained to 8)",
        words=(_varied("gear.normal_module_mm", "uniform", 9, 14),),
    ),
    TestSet(
        title="3,600 to 6,000 r/min (trained to 3,600)",
        words=(_varied("operating.speed_rpm", "uniform", 3600, 6000),),
    ),
    TestSet(
        title="sensors on the bearings, without a housing",
        words=("sensing=bearing",),
    ),
    TestSet(
        title="unit loads of 3 to 10 N/mm2 (trained from 10)",
        words=(_varied(TORQUE, "log_uniform", 3, 10, "unit_load"),),
    ),
    TestSet(
        title="noise at 0 to 10 dB (trained from 10)",
        words=(_varied("sensing.snr_db", "uniform", 0, 10),),
    ),
    TestSet(
        title="helical gears of 15 degrees (trained on spur gears)",
        words=("system=helical_pair", "gear.helix_angle_deg=15"),
    ),
)


def words_of(n_records: int, seed: int, further: Sequence[str] = ()) -> Words:
    """Overrides of a stream of so many records."""
    n_units = max(n_records // RECORDS_A_UNIT, 1)
    counts = (f"plan.n_records={n_records}", f"plan.n_units={n_units}")
    return (EXPERIMENT, *counts, f"seed={seed}", *FAST, *further)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Scores of the network on the machines of one test set.

    Attributes
    ----------
    title : of the test set
    score : balanced accuracy of records, of `diagnose.scoring.metrics.score_with_interval`
    recalls : by class
    known : share of the inputs that the flag takes for known
    calibration_error : expected error of the probabilities
    n_records, n_machines : judged
    """

    title: str
    score: dict[str, Any]
    recalls: dict[str, float]
    known: float
    calibration_error: float
    n_records: int
    n_machines: int

    def row(self) -> str:
        """Row of the table of the card."""
        score = interval_text(self.score)
        shares = [f"{share:.2f}" for share in self.recalls.values()]
        cells = [self.title, str(self.n_machines), score, *shares]
        cells += [f"{self.known:.2f}", f"{self.calibration_error:.3f}"]
        return f"| {' | '.join(cells)} |"


@dataclass(frozen=True, slots=True, kw_only=True)
class Maker:
    """Makes inputs of streams.

    Attributes
    ----------
    inputs : of the network
    n_workers : processes
    kept : folder that keeps the turns for another training, or None
    """

    inputs: Turns
    n_workers: int
    kept: Path | None

    def windows(self, title: str, words: Words) -> WindowSet:
        """Inputs of a stream, with a line for each tenth of its blocks."""

        def on_block(done: int, total: int) -> None:
            if done * 10 // total > (done - 1) * 10 // total:
                say(f"{title}: {done} of {total} blocks")

        return windows_of(
            words,
            self.inputs,
            n_workers=self.n_workers,
            kept=self.kept,
            on_block=on_block,
        )


def judge(
    test: TestSet, n_records: int, maker: Maker, training: Training[Any], domain: Any
) -> Judged:
    """Scores on new machines of a test set."""
    words = words_of(n_records, TEST_SEED, test.words)
    windows, stream = maker.windows(test.title, words), stream_of(words)
    record, answers = over_records(
        predict_windows(training.model, windows), windows.record
    )
    label = np.asarray(stream.column("label"))[record]
    unit = np.asarray(stream.column("unit_id"))[record]
    names = stream.class_names
    counts = confusion_by_unit(label, answers.argmax(axis=1), unit, len(names))
    score = score_with_interval(
        "balanced_accuracy",
        counts[None],
        n_bootstrap=N_BOOTSTRAP,
        rng=np.random.default_rng(0),
    )
    calibrated = calibration_scores([answers], [label], [training.temperature])
    return Judged(
        title=test.title,
        score=score,
        recalls=dict(zip(names, recall(counts.sum(axis=0)).tolist(), strict=True)),
        known=float(np.mean(distances(domain, windows) <= domain.threshold)),
        calibration_error=calibrated["after"]["expected_calibration_error"][0],
        n_records=len(record),
        n_machines=len(np.unique(unit)),
    )


def train(
    windows: WindowSet, validation: WindowSet, settings: TrainSettings, n_classes: int
) -> Training[Any]:
    """Network of the last epoch, its temperature from the validation machines."""

    def on_epoch(epoch: int, loss: float, held_out: float) -> None:
        say(f"epoch {epoch}: training {loss:.3f}, validation {held_out:.3f}")

    return train_network(
        windows,
        validation,
        target=Classes(n_classes=n_classes),
        settings=settings,
        seed=0,
        on_epoch=on_epoch,
    )


def describe(
    settings: TrainSettings,
    words: Words,
    training: Training[Any],
    domain: Any,
    judged: Judged,
) -> ModelDescription:
    """Content of ``model.json``."""
    stream = stream_of(words)
    speed = np.asarray(stream.column("speed_set_rpm"), dtype=float)
    teeth = teeth_of(stream)
    return ModelDescription(
        model_schema_version=MODEL_SCHEMA_VERSION,
        model=dict(settings.model),
        class_names=tuple(stream.class_names),
        channel_names=("any",),
        sampling_rate_hz=stream.sampling_rate,
        window_samples=1,  # turns are as long as the gears have teeth
        stride_samples=1,
        normalise="rms",
        data_schema_version=None,
        data_fingerprint=hashlib.sha256(json.dumps(words).encode()).hexdigest(),
        protocol="new_machine",
        seed=0,
        best_epoch=training.best_epoch,
        n_bootstrap=N_BOOTSTRAP,
        speed_rpm_range=(float(speed.min()), float(speed.max())),
        out_of_distribution=domain.facts(),
        n_teeth_range=(least_and_most(teeth[:, 0]), least_and_most(teeth[:, 1])),
        temperature=training.temperature,
        test_score={
            "balanced_accuracy": {
                key: judged.score[key] for key in ("mean", "low", "high", "too_few")
            },
            "chance": 1.0 / len(judged.recalls),
            "n_records": judged.n_records,
            "n_units": judged.n_machines,
            "leaky": False,
        },
    )


def least_and_most(counts: IntArray) -> tuple[int, int]:
    """The range of some counts."""
    return int(counts.min()), int(counts.max())


def card(words: Words, settings: TrainSettings, judged: Sequence[Judged]) -> str:
    """Card of the network, in Markdown."""
    stream = stream_of(words)
    names = list(judged[0].recalls)
    head = ["machines", "number", "balanced accuracy", *names, "known", "error"]
    rule = ["---"] + ["---:"] * (len(head) - 1)
    table = [f"| {' | '.join(cells)} |" for cells in (head, rule)]
    table += [each.row() for each in judged]
    varied = stream.config["plan"]["vary"]
    ranges = [f"- `{key}`: {_range(spec)}" for key, spec in varied.items()]
    n_units = len(np.unique(stream.column("unit_id")))
    return "\n".join(
        [
            "# Network for any pair of gears",
            "",
            "It tells healthy, cracked, pitted and missing teeth from one recording of a gear",
            "pair, given speed and tooth counts. Every channel is looked at by itself, and the",
            "answers are averaged.",
            "",
            f"Trained on {len(stream):,} simulated records of {n_units:,} machines, streamed and",
            f"not stored: 0.8 s, {len(stream.channel_names)} sensors on the housing. No recording",
            "of a real machine was used. Drawn for every machine or condition:",
            "",
            *ranges,
            "",
            "## Scores on machines it has not seen",
            "",
            "Balanced accuracy over records with its 95 % interval over machines (chance",
            f"{1 / len(names):.2f}), recall of each class, share of the inputs that the flag for",
            "unlike recordings takes for known, and expected error of the probabilities.",
            "",
            *table,
            "",
            "## Made again",
            "",
            "`python -m benchmarks.general_model FOLDER`. The same processor and versions give",
            "the same bits.",
            "",
        ]
    )


def _range(spec: Any) -> str:
    """A distribution in words."""
    bounds = [f"{spec[name]:g}" for name in ("low", "high") if name in spec]
    of = f" of {spec['of']}" if "of" in spec else ""
    return f"{spec['distribution']} {' to '.join(bounds)}{of}"


def say(text: str) -> None:
    """Print a line with the seconds since the start."""
    print(f"{time.monotonic() - STARTED:6.0f} s  {text}", flush=True)


STARTED = time.monotonic()


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the network and its card."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="gets network and card")
    parser.add_argument("--records", type=int, default=N_RECORDS)
    parser.add_argument("--test-records", type=int, default=N_TEST)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--turns", type=Path, help="keeps turns for another training")
    given = parser.parse_args(arguments)
    settings = settings_from(compose("train", list(TRAINING)))
    inputs = input_of(settings.model)
    assert isinstance(inputs, Turns)
    maker = Maker(inputs=inputs, n_workers=given.workers, kept=given.turns)

    words = words_of(given.records, SEED)
    windows = maker.windows("training", words)
    held_out = words_of(min(given.records, N_VALIDATION), VALIDATION_SEED)
    validation = maker.windows("validation", held_out)
    training = train(windows, validation, settings, len(stream_of(words).class_names))
    domain = fit_domain(windows, validation)
    judged = []
    for test in TEST_SETS:
        result = judge(test, given.test_records, maker, training, domain)
        judged.append(result)
        say(result.row())
    description = describe(settings, words, training, domain, judged[0])
    tensors = training.weights() | domain.tensors()
    beside = {"README.md": card(words, settings, judged)}
    save_model(given.folder, tensors, description, beside)
    say(f"{given.folder}: network and card")


if __name__ == "__main__":
    main()
