"""One run of the frozen protocol on a machine of a measured set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from diagnose.bridge.bridge_machine import BridgeMachine
from diagnose.bridge.bridge_networks import (
    bridge_settings,
    network_answers,
    with_shuffles,
)
from diagnose.bridge.bridge_scores import (
    Answers,
    Interval,
    Judged,
    accuracy,
    separation,
)
from diagnose.bridge.healthy_distance import distance_answers
from diagnose.bridge.implanted_windows import (
    BURSTS,
    NO_RESIDUAL,
    PHYSICS,
    Implanted,
    healthy_stretches,
    implanted,
    judged_stretches,
    judged_windows,
)
from diagnose.bridge.protocol import BridgeProtocol
from diagnose.bridge.rules import handbook_answers
from gensig.measured.measured_set import LABELS

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

OnStep = Callable[[str], None]
OURS, NOISE, WRONG_GEARBOX = "implants", "noise bursts", "wrong gearbox"
NOTHING, SHUFFLED = "gain 0", "shuffled labels"
HANDBOOK, NOVELTY = "handbook rule", "novelty"
RESIDUALS = {NOISE: BURSTS, NOTHING: NO_RESIDUAL}
# name of a method -> its meaning, in the order of the page
METHODS = {
    OURS: "network on the machine's healthy recordings plus simulated residuals",
    NOISE: "the same with bursts of noise once a turn in place of residuals",
    WRONG_GEARBOX: "the same with simulated residuals on shafts that the machine has not",
    NOTHING: "the same with nothing added: the three classes are the same",
    SHUFFLED: "simulated residuals with labels that tell nothing",
    HANDBOOK: "kurtosis over 6 is one tooth, level 3 dB over healthy is many; no training",
    NOVELTY: "distance from the healthy recordings; no simulation, no fault, names no class",
}
NETWORKS = (OURS, NOISE, WRONG_GEARBOX, NOTHING, SHUFFLED)


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeResult:
    """Answers of all methods for the recordings of one machine.

    Attributes
    ----------
    machine, protocol, judged : what was asked, and how
    answers : method -> its answers
    why_not : method -> reason why it gave none
    n_blocks : blocks of the healthy recordings that carried, and that were held out
    window_seconds : s    of a window
    """

    machine: BridgeMachine
    protocol: BridgeProtocol
    judged: Judged
    answers: Mapping[str, Answers]
    why_not: Mapping[str, str]
    n_blocks: tuple[int, int]
    window_seconds: float

    def accuracy(self, method: str) -> Interval | None:
        """Balanced accuracy of a method; None for one that names no class."""
        predicted = self.answers[method].predicted
        if predicted is None:
            return None
        return accuracy(self.judged, predicted, n_bootstrap=self.protocol.n_bootstrap)

    def separation(self, method: str) -> float | None:
        """Share of pairs of a healthy and a faulty recording that a method ranks right."""
        return separation(self.judged, self.answers[method].faulty)


def run_bridge(
    machine: BridgeMachine,
    data: Dataset,
    protocol: BridgeProtocol,
    *,
    on_step: OnStep = lambda text: None,
) -> BridgeResult:
    """Train, judge and compare.

    Parameters
    ----------
    data : simulated set with healthy twins, the source of the residuals
    on_step : is told what begins

    Raises
    ------
    ConfigError, DatasetError    with one line, for recordings or a set that cannot be used
    """
    on_step("implants in the healthy recordings")
    physics = [
        implanted(machine, data, protocol, residual=PHYSICS, seed=seed)
        for seed in protocol.seeds
    ]
    first = physics[0]
    stretches = judged_stretches(machine, first.blocks)
    windows = judged_windows(stretches, first.window_samples, protocol)
    judged = Judged(
        names=tuple(one.sample.source.name for one in stretches),
        label=np.array([LABELS.index(one.sample.label) for one in stretches]),
        specimen=tuple(one.sample.source.specimen for one in stretches),
        labels=LABELS,
    )
    settings = bridge_settings(protocol)
    answers: dict[str, Answers] = {}
    for method in NETWORKS:
        rows = []
        for seed, own in zip(protocol.seeds, physics, strict=True):
            on_step(f"{method}, seed {seed}")
            implants = _implants_of(method, own, machine, data, protocol, seed)
            rows.append(network_answers(implants, windows, settings, seed))
        answers[method] = _of_network(np.stack(rows))
    healthy = healthy_stretches(machine, first.blocks, carry=True)
    on_step("handbook rule and novelty")
    answers[HANDBOOK] = handbook_answers(healthy, stretches)
    distance, why_not = distance_answers(machine, healthy, stretches)
    if distance is not None:
        answers[NOVELTY] = distance
    n_carrying = sum(block.carries for block in first.blocks)
    return BridgeResult(
        machine=machine,
        protocol=protocol,
        judged=judged,
        answers=answers,
        why_not={NOVELTY: why_not} if why_not else {},
        n_blocks=(n_carrying, len(first.blocks) - n_carrying),
        window_seconds=first.window_samples / machine.healthy[0].signal.sampling_rate,
    )


def _implants_of(
    method: str,
    physics: Implanted,
    machine: BridgeMachine,
    data: Dataset,
    protocol: BridgeProtocol,
    seed: int,
) -> Implanted:
    """Training windows of a method; `physics` are those of the implants with the same seed."""
    if method == OURS:
        return physics
    if method == SHUFFLED:
        return with_shuffles(physics, seed)
    is_wrong = method == WRONG_GEARBOX
    residual = PHYSICS if is_wrong else RESIDUALS[method]
    return implanted(
        machine, data, protocol, residual=residual, seed=seed, wrong_gearbox=is_wrong
    )


def _of_network(log_probability: np.ndarray) -> Answers:
    """Answers of (seed, recording, class) log-probabilities."""
    return Answers(
        predicted=log_probability.argmax(axis=-1),
        faulty=1.0 - np.exp(log_probability[..., 0]),
    )
