"""``python -m benchmarks.implants``: are implants worth more than simulations, and more than noise?

Simulated machines stand for real ones: two of other teeth, with a housing, ball bearings, grade 7
and wandering speed, and one of each world of ``benchmarks.bridge`` in records of 2 s. Some of their
healthy records carry implants; a small network that is trained on these
judges the machine's own faulty records. Beside it the same network on simulations alone, on
implants of noise bursts and of shuffled phases, on implants of nothing, and the handbook rule.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

import gensig
from benchmarks._bridge_worlds import WORLDS
from benchmarks._measure import machine, print_machine
from diagnose.networks.registry import build_model
from gensig.dataset.reader import Dataset
from gensig.implants.implanting import implant_records
from gensig.implants.options import ImplantOptions
from gensig.implants.simulated_pairs import CLASSES, SimulatedPairs, class_of
from gensig.signals.handbook_rule import handbook_rule
from gensig.signals.indicators import kurtosis
from gensig.signals.recording import Recording
from gensig.signals.resampling import rate_change

RATE = 12800.0  # Hz, of training and judgement
WINDOW = 3200  # samples: a quarter of a second, three turns of the slower shaft or more
FAULTS = "plan.classes=[healthy,missing_tooth,chipped,distributed_pitting,wear]"
SOURCE = (
    "experiment=quickstart",
    FAULTS,
    "sensing.snr_db=null",
    "sensing.sampling_rate_hz=25600",
    "dataset.store_healthy_twin=true",
    "plan.n_reference=0",
    "plan.n_records=100",
    "plan.n_units=25",
    "operating.duration_s=0.5",
)
OF_MACHINE = (
    FAULTS,
    "plan.n_units=1",
    "plan.n_records=50",
    "plan.n_reference=0",
    "operating.torque_nm=20",
    "sensing.snr_db=20",
    "operating.duration_s=2",
)
ONE_UNIT = ("plan.n_gearboxes=1",)  # of a world
CHANNEL = "housing_input"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """A simulated machine that stands for a real one.

    Attributes
    ----------
    words : overrides of its data set
    teeth : of the driving and the driven gear
    speed_rpm : of the driving shaft
    """

    words: tuple[str, ...]
    teeth: tuple[int, int]
    speed_rpm: float

    def overrides(self) -> tuple[str, ...]:
        """All overrides of its data set."""
        return (
            *self.words,
            *OF_MACHINE,
            f"gear.pinion.n_teeth={self.teeth[0]}",
            f"gear.wheel.n_teeth={self.teeth[1]}",
            f"operating.speed_rpm={self.speed_rpm:g}",
        )


MACHINES: Mapping[str, Rig] = {
    "m1": Rig(
        words=("experiment=realistic", "seed=21"), teeth=(31, 67), speed_rpm=1500.0
    ),
    "m2": Rig(
        words=("experiment=realistic", "seed=22"), teeth=(27, 49), speed_rpm=1900.0
    ),
    **{
        name: Rig(words=(*words, *ONE_UNIT), teeth=(23, 84), speed_rpm=1800.0)
        for name, words in WORLDS.items()
    },
}
N_CARRIERS = 6  # of the machine's ten healthy records
KINDS = ("physics", "noise_bursts", "shuffled_phases", "none")
N_IMPLANTS = 240
PLAIN_HEALTHY = (
    0.5  # share of the healthy records without a residual, in the arms named so
)
USUAL_GAIN, WIDE_GAIN = (-10.0, 10.0), (-30.0, 5.0)  # dB
N_FOLDS = 2  # of the machine's own records, for what the network can reach at most
NETWORK = {
    "name": "cnn",
    "kind": "small_cnn",
    "widths": [16, 32, 48, 64],
    "kernels": [32, 9, 5, 3],
    "strides": [8, 2, 2, 2],
    "dropout": 0.2,
}
N_STEPS, BATCH, RATE_OF_LEARNING = 500, 16, 3e-3
SEEDS = (0, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Records of a machine with their classes, and its healthy records that carry."""

    signals: list[np.ndarray]
    labels: np.ndarray
    carriers: list[Recording]


def main(arguments: Sequence[str] | None = None) -> int:
    """Make what is not there yet, train, judge, and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.implants", description=__doc__
    )
    parser.add_argument("--data", metavar="DIR", help="keeps the data sets")
    parser.add_argument("--json", metavar="FILE", help="where the figures go")
    parser.add_argument("--machines", nargs="+", default=list(MACHINES))
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    named, begun = machine(), time.perf_counter()
    print_machine(named)
    place = nullcontext(options.data) if options.data else tempfile.TemporaryDirectory()
    with place as folder:
        source = gensig.generate(*SOURCE, out=Path(folder) / "source", reuse=True)
        results = {name: judge(source, name, Path(folder)) for name in options.machines}
    if options.json:
        content = {"machine": named, "results": results}
        Path(options.json).write_text(json.dumps(content, indent=1) + "\n")
    print(f"{time.perf_counter() - begun:.0f} s")
    return 0


def judge(source: Dataset, name: str, folder: Path) -> dict[str, Any]:
    """Balanced accuracy and recalls of every arm on one machine, printed too."""
    rig = MACHINES[name]
    data = gensig.generate(*rig.overrides(), out=folder / name, reuse=True)
    judged = judged_records(data)
    results: dict[str, Any] = {"handbook rule": scored(rule(judged), judged.labels)}
    tell(name, "handbook rule", results["handbook rule"])
    results["its own records"] = own_records(judged)
    tell(name, "its own records", results["its own records"])
    for arm, (signals, labels) in arms(source, judged, rig):
        runs = []
        for run in SEEDS:
            network = trained(signals, labels, run)
            answers = [answer(network, signal) for signal in judged.signals]
            runs.append(scored(np.array(answers), judged.labels))
        results[arm] = {key: [round(each[key], 3) for each in runs] for key in runs[0]}
        tell(name, arm, results[arm])
    return results


def tell(name: str, arm: str, result: Mapping[str, Any]) -> None:
    """One line of a result."""
    print(f"{name} {arm:<22}", *(f"{k} {v}" for k, v in result.items()), flush=True)


def judged_records(data: Dataset) -> Judged:
    """Records of a machine at the common rate; its first healthy ones carry."""
    change = rate_change(data.sampling_rate, RATE)
    classes = [class_of(text) for text in data.column("faults_json").tolist()]
    signals, labels, carriers = [], [], []
    for index, label in enumerate(classes):
        signal = change.apply(data.signals(index, channels=[CHANNEL]))
        signal -= signal.mean(axis=-1, keepdims=True)
        if label == CLASSES[0] and len(carriers) < N_CARRIERS:
            recording = Recording(
                sensors=(CHANNEL,), acceleration=signal, sampling_rate=RATE
            )
            carriers.append(recording)
            continue
        signals.append(signal)
        labels.append(CLASSES.index(str(label)))
    return Judged(signals=signals, labels=np.array(labels), carriers=carriers)


def arms(
    source: Dataset, judged: Judged, rig: Rig
) -> Iterator[tuple[str, tuple[list[np.ndarray], np.ndarray]]]:
    """Training signals, (1, sample) each, and labels by the name of the arm."""
    yield "simulations alone", simulations(source)
    choices = [("twin", kind, 0.0) for kind in KINDS]
    choices += [("none", "physics", 0.0)]
    choices += [("twin", kind, PLAIN_HEALTHY) for kind in KINDS[:3]]
    choices += [("none", "physics", PLAIN_HEALTHY)]
    laws = [(*choice, USUAL_GAIN) for choice in choices]
    laws += [("twin", "physics", PLAIN_HEALTHY, WIDE_GAIN)]
    for path, kind, plain, gain in laws:
        made = implant_records(
            source,
            judged.carriers,
            teeth=rig.teeth,
            speed_rpm=rig.speed_rpm,
            options=ImplantOptions(
                gain_db=gain,
                n_records=N_IMPLANTS,
                plain_healthy=plain,
                residual=kind,
                path=path,
                duration=0.5,
                held_out=0.1,
            ),
        )
        words = f"{kind}, no path" if path == "none" else kind
        if plain:
            words += ", plain healthy"
        if gain == WIDE_GAIN:
            words += ", wide law"
        yield words, (list(made.acceleration), made.label)


def own_records(judged: Judged) -> dict[str, list[float]]:
    """Scores of networks that are trained on half of the machine's own records, for the others."""
    healthy = [carrier.acceleration for carrier in judged.carriers]
    signals = [each.astype(np.float32) for each in (*judged.signals, *healthy)]
    labels = np.concatenate([judged.labels, np.zeros(len(healthy), dtype=int)])
    fold = np.empty(len(labels), dtype=int)
    for label in np.unique(labels):
        mine = np.flatnonzero(labels == label)
        fold[mine] = np.arange(len(mine)) % N_FOLDS
    runs = []
    for run in SEEDS:
        answers = np.empty(len(labels), dtype=int)
        for held_back in range(N_FOLDS):
            shown = np.flatnonzero(fold != held_back)
            network = trained([signals[i] for i in shown], labels[shown], run)
            for index in np.flatnonzero(fold == held_back):
                answers[index] = answer(network, signals[index])
        runs.append(scored(answers, labels))
    return {key: [round(each[key], 3) for each in runs] for key in runs[0]}


def simulations(source: Dataset) -> tuple[list[np.ndarray], np.ndarray]:
    """Simulated records as they are, each channel by itself, in white noise of 10 to 30 dB."""
    pairs, rng = SimulatedPairs(source), np.random.default_rng(0)
    change = rate_change(source.sampling_rate, RATE)
    signals, labels = [], []
    for index in np.flatnonzero(pairs.label >= 0).tolist():
        for row in change.apply(source.signals(index)):
            noise = 10.0 ** (-rng.uniform(10.0, 30.0) / 20.0) * row.std()
            noisy = row + noise * rng.standard_normal(row.size)
            signals.append(noisy[None].astype(np.float32))
            labels.append(int(pairs.label[index]))
    return signals, np.array(labels)


def trained(
    signals: Sequence[np.ndarray], labels: np.ndarray, seed: int
) -> torch.nn.Module:
    """The network after as many windows for every arm, drawn evenly from the classes."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    network = build_model(NETWORK, n_channels=1, n_classes=len(CLASSES))
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE_OF_LEARNING)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, RATE_OF_LEARNING, total_steps=N_STEPS
    )
    by_class = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    network.train()
    for _ in range(N_STEPS):
        chosen = [int(rng.choice(by_class[k % len(by_class)])) for k in range(BATCH)]
        batch = np.stack([cut(signals[index], rng) for index in chosen])
        scores = network(torch.from_numpy(batch))
        target = torch.from_numpy(labels[chosen])
        loss = torch.nn.functional.cross_entropy(scores, target)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
    return network.eval()


def cut(signal: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A window at a random place, over its RMS."""
    start = int(rng.integers(signal.shape[-1] - WINDOW + 1))
    return over_rms(signal[:, start : start + WINDOW])


def over_rms(window: np.ndarray) -> np.ndarray:
    """A window without mean, over its RMS."""
    centred = window - window.mean(axis=-1, keepdims=True)
    return (centred / centred.std()).astype(np.float32)


def answer(network: torch.nn.Module, signal: np.ndarray) -> int:
    """Class of a record, by the mean of its windows."""
    starts = range(0, signal.shape[-1] - WINDOW + 1, WINDOW)
    windows = np.stack([over_rms(signal[:, s : s + WINDOW]) for s in starts])
    with torch.inference_mode():
        scores = torch.log_softmax(network(torch.from_numpy(windows)), dim=1)
    return int(scores.mean(dim=0).argmax())


def rule(judged: Judged) -> np.ndarray:
    """Answers of the handbook rule: kurtosis for one tooth, level over the healthy for many."""
    level = np.mean([each.acceleration.std() for each in judged.carriers])
    answers = []
    for signal in judged.signals:
        louder = 20.0 * np.log10(signal.std() / level)
        windows = signal[0, : signal.shape[-1] // WINDOW * WINDOW].reshape(-1, WINDOW)
        state = handbook_rule(float(np.mean(kurtosis(windows))), louder)
        answers.append(CLASSES.index(state))
    return np.array(answers)


def scored(answers: np.ndarray, labels: np.ndarray) -> dict[str, float]:
    """Balanced accuracy, and the recall of each class."""
    recalls = {
        name: float(np.mean(answers[labels == label] == label))
        for label, name in enumerate(CLASSES)
    }
    return {"balanced": float(np.mean(list(recalls.values()))), **recalls}


if __name__ == "__main__":
    sys.exit(main())
