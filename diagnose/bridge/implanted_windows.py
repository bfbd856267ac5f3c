"""Training windows of implants in the machine's healthy recordings, and the stretches judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from diagnose.bridge.bridge_machine import BridgeMachine, Sample
from diagnose.bridge.protocol import BridgeProtocol
from diagnose.data.windows import Segments, WindowSet, plan_windows
from gensig.implants.blocks import Block, refuse_carried
from gensig.implants.implanting import Implants, implant_records
from gensig.implants.options import ImplantOptions
from gensig.measured.measured_set import LABELS
from gensig.signals.recording import Recording

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

PHYSICS, BURSTS, NO_RESIDUAL = "physics", "noise_bursts", "none"
LEAST_TEETH = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """A stretch of a recording that is judged.

    Attributes
    ----------
    sample : the recording
    start, stop : samples of its signal, stop exclusive
    """

    sample: Sample
    start: int
    stop: int

    @property
    def signal(self) -> Recording:
        """The samples of the stretch, less their mean."""
        signal = self.sample.signal.acceleration[:, self.start : self.stop]
        return replace(
            self.sample.signal, acceleration=signal - signal.mean(axis=1, keepdims=True)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Implanted:
    """Windows of implants for one training.

    Attributes
    ----------
    train, validation : of different blocks
    blocks : of the healthy recordings, those held out among them
    window_samples : of a window
    """

    train: WindowSet
    validation: WindowSet
    blocks: tuple[Block, ...]
    window_samples: int


def window_seconds(machine: BridgeMachine, protocol: BridgeProtocol) -> float:
    """Length of a window, s."""
    return protocol.window_turns * machine.slowest_turn()


def implanted(
    machine: BridgeMachine,
    data: Dataset,
    protocol: BridgeProtocol,
    *,
    residual: str,
    seed: int,
    wrong_gearbox: bool = False,
) -> Implanted:
    """Implants in the healthy recordings of a machine.

    Parameters
    ----------
    data : simulated set with healthy twins
    residual : "physics", "noise_bursts" or "none"
    wrong_gearbox : True tells wrong teeth, so that residuals turn with shafts that are not there

    Raises
    ------
    ConfigError, DatasetError    with one line, of `gensig.implants`
    """
    teeth, scale = machine.teeth, 1.0
    if wrong_gearbox:
        teeth, scale = wrong_teeth(teeth, protocol.wrong_teeth)
    seconds = window_seconds(machine, protocol)
    options = ImplantOptions(
        gain_db=protocol.gain_db,
        plain_healthy=protocol.plain_healthy,
        path=protocol.path,
        residual=residual,
        n_records=protocol.n_records,
        duration=protocol.record_windows * seconds,
        held_out=protocol.held_out,
        seed=seed,
    )
    implants = implant_records(
        data,
        [one.signal for one in machine.healthy],
        teeth=teeth,
        speed_rpm=[60.0 * scale * one.shaft_frequency for one in machine.healthy],
        options=options,
    )
    n_window = round(seconds * implants.sampling_rate)
    return _windows(implants, n_window, protocol)


def wrong_teeth(teeth: Sequence[int], factor: float) -> tuple[tuple[int, ...], float]:
    """Teeth of a gearbox that is not there, and the factor on the speed of its driving shaft.

    The mesh of the first stage keeps its frequency, so that it is found; all shafts turn faster.
    """
    wrong = tuple(max(round(factor * n), LEAST_TEETH) for n in teeth)
    return wrong, teeth[0] / wrong[0]


def _windows(implants: Implants, n_window: int, protocol: BridgeProtocol) -> Implanted:
    """Windows of implanted records, those of some blocks for early stopping."""
    label = np.array([LABELS.index(implants.class_names[k]) for k in implants.label])
    carrying = np.unique(implants.block)
    held = carrying[:: protocol.validation_every]
    is_held = np.isin(implants.block, held)
    return Implanted(
        train=_window_set(implants, label, ~is_held, n_window, protocol),
        validation=_window_set(implants, label, is_held, n_window, protocol),
        blocks=implants.blocks,
        window_samples=n_window,
    )


def _window_set(
    implants: Implants,
    label: NDArray[np.int64],
    chosen: NDArray[np.bool_],
    n_window: int,
    protocol: BridgeProtocol,
) -> WindowSet:
    """One window a record, which starts anywhere in the training."""
    records = np.flatnonzero(chosen)
    return WindowSet(
        signals=tuple(implants.acceleration[record] for record in records),
        segment=np.arange(records.size),
        start=np.zeros(records.size, dtype=np.int64),
        label=label[records],
        record=records,
        window_samples=n_window,
        normalise=protocol.normalise,
    )


def healthy_stretches(
    machine: BridgeMachine, blocks: Sequence[Block], *, carry: bool
) -> list[Stretch]:
    """Stretches of the healthy recordings that carry, to learn from, or that were held out."""
    stretches = []
    for number, sample in enumerate(machine.healthy):
        own = [one for one in blocks if (one.recording, one.carries) == (number, carry)]
        if own:
            start, stop = min(one.start for one in own), max(one.stop for one in own)
            stretches.append(Stretch(sample=sample, start=start, stop=stop))
    return stretches


def judged_stretches(machine: BridgeMachine, blocks: Sequence[Block]) -> list[Stretch]:
    """Stretches that are judged: what was held out of healthy recordings, and all faulty ones.

    Raises
    ------
    DatasetError    for a stretch that carried
    """
    stretches = healthy_stretches(machine, blocks, carry=False)
    for sample in machine.faulty:
        length = sample.signal.acceleration.shape[1]
        stretches.append(Stretch(sample=sample, start=0, stop=length))
    check_stretches(stretches, blocks)
    return stretches


def check_stretches(stretches: Sequence[Stretch], blocks: Sequence[Block]) -> None:
    """Refuse to judge samples that carried implants in a training.

    Raises
    ------
    DatasetError    with one line, which names the stretches held out
    """
    for one in stretches:
        refuse_carried(
            blocks,
            one.sample.signal,
            start=one.start,
            stop=one.stop,
            name=one.sample.source.name,
        )


def judged_windows(
    stretches: Sequence[Stretch], n_window: int, protocol: BridgeProtocol
) -> WindowSet:
    """Windows of the stretches, half a window apart; `record` is the number of the stretch."""
    lengths = np.array([one.stop - one.start for one in stretches])
    segments = Segments(
        record=np.arange(lengths.size), start=np.zeros_like(lengths), stop=lengths
    )
    segment, start = plan_windows(segments, n_window, max(n_window // 2, 1))
    label = np.array([LABELS.index(one.sample.label) for one in stretches])
    return WindowSet(
        signals=tuple(one.signal.acceleration.astype(np.float32) for one in stretches),
        segment=segment,
        start=start,
        label=label[segment],
        record=segment,
        window_samples=n_window,
        normalise=protocol.normalise,
    )
