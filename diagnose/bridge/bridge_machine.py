"""One machine of a measured set as the bridge uses it: recordings of steady speed, with labels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnose.bridge.protocol import BridgeProtocol
from gensig.errors import ConfigError
from gensig.measured.measured_set import (
    HEALTHY,
    LABELS,
    GearTrain,
    MeasuredRecording,
    MeasuredSet,
)
from gensig.measured.measured_signal import read_signals
from gensig.signals.recording import Recording
from gensig.signals.resampling import rate_change

NO_LABEL, VARYING = "class is none of the three", "speed varies"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """A recording of the machine, with its signal at the rate of the bridge.

    Attributes
    ----------
    source : the recording in its set
    signal : (sensor, sample), in the unit of the set
    """

    source: MeasuredRecording
    signal: Recording

    @property
    def label(self) -> str:
        """One of the three labels."""
        assert self.source.label is not None
        return self.source.label

    @property
    def shaft_frequency(self) -> float:
        """Frequency of the driving shaft, Hz."""
        assert self.source.shaft_frequency is not None
        return self.source.shaft_frequency


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeMachine:
    """A machine with its healthy and faulty recordings.

    Attributes
    ----------
    name : of the machine in its set
    train : its gears
    healthy, faulty : recordings of steady speed
    left_out : reason -> number of recordings that are not used
    """

    name: str
    train: GearTrain
    healthy: tuple[Sample, ...]
    faulty: tuple[Sample, ...]
    left_out: Mapping[str, int]

    @property
    def teeth(self) -> tuple[int, ...]:
        """Driving and driven gear of each stage in turn."""
        return tuple(n for pair in self.train.stages for n in pair)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of which there are recordings, in the order of the three."""
        present = {one.label for one in (*self.healthy, *self.faulty)}
        return tuple(label for label in LABELS if label in present)

    def slowest_turn(self) -> float:
        """Longest turn of the slowest shaft in any healthy recording, s."""
        shafts = range(1, len(self.train.stages) + 2)
        ratio = min(self.train.shaft_ratio(shaft) for shaft in shafts)
        return 1.0 / (ratio * min(one.shaft_frequency for one in self.healthy))


def bridge_machine(
    found: MeasuredSet, protocol: BridgeProtocol, *, machine: str | None = None
) -> BridgeMachine:
    """The machine of a set that is judged, with its signals.

    Parameters
    ----------
    machine : its name; None takes the one with most labels, then with most recordings

    Raises
    ------
    ConfigError    for a set that lacks rates, speeds or teeth, or has no healthy or no faulty
        recordings of one machine
    """
    name = _chosen(found, machine)
    recordings = found.of_machine(name)
    usable = [
        one for one in recordings if one.label is not None and not one.speed_varies
    ]
    left_out = Counter(
        {
            NO_LABEL: sum(one.label is None for one in recordings),
            VARYING: sum(
                one.speed_varies and one.label is not None for one in recordings
            ),
        }
    )
    _check_known(found, usable)
    train = usable[0].train
    assert train is not None
    samples = [
        Sample(source=one, signal=_at_rate(signal, protocol))
        for one, signal in read_signals(usable)
    ]
    _check_alike(samples)
    return BridgeMachine(
        name=name,
        train=train,
        healthy=tuple(one for one in samples if one.label == HEALTHY),
        faulty=tuple(one for one in samples if one.label != HEALTHY),
        left_out={reason: n for reason, n in left_out.items() if n},
    )


def _chosen(found: MeasuredSet, machine: str | None) -> str:
    """Name of the machine to judge."""
    names = found.machines()
    if machine is not None and machine not in names:
        raise ConfigError(
            f"{found.name}: no machine '{machine}'; there is {', '.join(names)}"
        )
    if machine is not None:
        return machine

    def size(name: str) -> tuple[int, int]:
        ones = found.of_machine(name)
        return len({one.label for one in ones if one.label}), len(ones)

    return max(names, key=size)


def _check_known(found: MeasuredSet, usable: Sequence[MeasuredRecording]) -> None:
    """Raise ConfigError for what the recordings lack, in one line."""
    counts = Counter(one.label for one in usable)
    if not counts[HEALTHY] or len(counts) < 2:
        has = ", ".join(f"{n} {label}" for label, n in counts.items()) or "none"
        raise ConfigError(
            f"{found.name}: a bridge needs healthy and faulty recordings of steady speed; it has "
            f"{has}"
        )
    missing = [
        key
        for key, lacks in {
            "sampling_rate_hz": any(one.sampling_rate is None for one in usable),
            "speed_rpm": any(one.shaft_frequency is None for one in usable),
            "stages": any(one.train is None for one in usable),
        }.items()
        if lacks
    ]
    if missing:
        reason = found.missing.get(missing[0], "not given")
        raise ConfigError(
            f"{found.name}: {', '.join(missing)} must be given in measured.yaml ({reason})"
        )
    if len({one.train for one in usable}) > 1:
        raise ConfigError(
            f"{found.name}: its recordings are of several gear trains; name each with machine"
        )


def _at_rate(signal: Recording, protocol: BridgeProtocol) -> Recording:
    """The begin of a recording, at the highest rate of the protocol or below."""
    n_kept = round(protocol.most_seconds * signal.sampling_rate)
    kept = signal.acceleration[:, :n_kept]
    kept = kept - kept.mean(axis=1, keepdims=True)
    if signal.sampling_rate <= protocol.highest_rate:
        return replace(signal, acceleration=kept)
    change = rate_change(signal.sampling_rate, protocol.highest_rate)
    return replace(
        signal,
        acceleration=np.asarray(change.apply(kept), dtype=np.float64),
        sampling_rate=signal.sampling_rate * change.ratio,
    )


def _check_alike(samples: Sequence[Sample]) -> None:
    """Refuse recordings of other channels or another rate than the first."""
    first = samples[0]
    for one in samples[1:]:
        if one.signal.sensors != first.signal.sensors:
            raise ConfigError(
                f"{one.source.name} has the channels {', '.join(one.signal.sensors)}, "
                f"{first.source.name} has {', '.join(first.signal.sensors)}; name them with "
                "channels"
            )
        if abs(one.signal.sampling_rate / first.signal.sampling_rate - 1.0) > 1e-3:
            raise ConfigError(
                f"{one.source.name} has {one.signal.sampling_rate:g} samples a second, "
                f"{first.source.name} has {first.signal.sampling_rate:g}"
            )
