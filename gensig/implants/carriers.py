"""Healthy recordings of one machine, with the angle of its driving shaft at every sample."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gensig.arrays import Array
from gensig.dataset.storage.atomic import sha256_file
from gensig.errors import ConfigError, TooShortError
from gensig.implants.gearing import Gearing
from gensig.signals.recording import Recording, read_file, recording_of
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.speed_ridge import wandering_mesh_cycles
from gensig.signals.tacho import pulse_times

SAME_RATE = 1e-3  # relative; times in files are rounded
LOWEST_RATE = 5000.0  # Hz; below, no gear mesh is left with its harmonics
MOST_JUMP = 1.5  # from one interval between pulses to the next; a lost pulse makes it 2
TACHO_TOLERANCE = 0.03  # between stated and measured speed
OPTIONS = "--teeth, --speed-rpm and --sampling-rate"


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthyRecording:
    """A healthy recording before its speed is known.

    Attributes
    ----------
    name : of the file, or any other
    sha256 : of the file; that of the samples where there is none
    recording : accelerations of the sensors
    tacho : (sample,) pulses of the driving shaft, or None
    """

    name: str
    sha256: str
    recording: Recording
    tacho: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Carrier:
    """A healthy recording whose driving shaft is followed.

    Attributes
    ----------
    name, sha256 : of the file
    samples_sha256 : of the samples
    recording : accelerations of the sensors
    turned : (sample,) turns of the driving shaft since the first sample
    set_rpm : r/min    as stated
    """

    name: str
    sha256: str
    samples_sha256: str
    recording: Recording
    turned: Array
    set_rpm: float

    def speed_rpm(self, start: int, stop: int) -> float:
        """Mean speed of the driving shaft between two samples, r/min."""
        turns = float(self.turned[stop - 1] - self.turned[start])
        return 60.0 * turns * self.recording.sampling_rate / (stop - 1 - start)


def samples_digest(recording: Recording) -> str:
    """The sha256 of the samples of a recording, (sensor, sample), its mean removed."""
    samples = np.ascontiguousarray(recording.acceleration, dtype="<f8")
    return hashlib.sha256(samples.tobytes()).hexdigest()


def healthy_recording(recording: Recording, name: str) -> HealthyRecording:
    """A recording that was loaded elsewhere, under a name of its own."""
    return HealthyRecording(
        name=name, sha256=samples_digest(recording), recording=recording
    )


def read_healthy(
    file: str,
    *,
    rate: float | None = None,
    channels: Sequence[str] | None = None,
    unit: str = "m/s2",
    array: str | None = None,
    tacho: str | None = None,
) -> HealthyRecording:
    """A healthy recording of a file.

    Parameters
    ----------
    file, rate, channels, unit, array : see `gensig.signals.recording`
    tacho : channel with the pulses of the driving shaft

    Raises
    ------
    ConfigError    with one line, for files, channels and rates that cannot be used
    """
    content = read_file(file, rate=rate, array=array, rate_option="--sampling-rate")
    pulses = None
    if tacho is not None:
        if tacho not in content.channels:
            raise ConfigError(
                f"{file}: no channel {tacho} for --tacho; it has {', '.join(content.channels)}"
            )
        pulses = content.values[content.channels.index(tacho)]
        if channels is None:
            channels = [name for name in content.channels if name != tacho]
    recording = recording_of(content, unit=unit, channels=channels)
    path = Path(file).expanduser()
    return HealthyRecording(
        name=path.name, sha256=sha256_file(path), recording=recording, tacho=pulses
    )


def follow_all(
    recordings: Sequence[HealthyRecording],
    gearing: Gearing,
    speed_rpm: Sequence[float],
    *,
    pulses_per_turn: int = 1,
) -> list[Carrier]:
    """Recordings of one machine with the angle of its driving shaft.

    Parameters
    ----------
    speed_rpm : r/min of the driving shaft: one for all recordings, or one each

    Raises
    ------
    ConfigError    with one line, where recordings differ in rate or channels, occur twice, are too
        short, or show no mesh near the speed
    """
    if not recordings:
        raise ConfigError("--healthy: give at least one healthy recording")
    if len(speed_rpm) not in (1, len(recordings)):
        raise ConfigError(
            f"--speed-rpm: {len(speed_rpm)} speeds for {len(recordings)} recordings; "
            "give one, or one for each"
        )
    for speed in speed_rpm:
        if not 0.0 < speed < 1e6:
            raise ConfigError(f"--speed-rpm {speed:g} must be positive")
    _check_alike(recordings)
    speeds = list(speed_rpm)
    if len(speeds) == 1:
        speeds *= len(recordings)
    carriers = [
        _follow(healthy, gearing, speed, pulses_per_turn)
        for healthy, speed in zip(recordings, speeds, strict=True)
    ]
    _check_distinct(carriers)
    return carriers


def _check_alike(recordings: Sequence[HealthyRecording]) -> None:
    """Refuse recordings of other sensors or another rate than the first."""
    first = recordings[0]
    rate, sensors = first.recording.sampling_rate, first.recording.sensors
    if rate < LOWEST_RATE:
        raise ConfigError(
            f"{first.name}: {rate:g} samples a second; at least {LOWEST_RATE:g} are needed"
        )
    for other in recordings[1:]:
        if other.recording.sensors != sensors:
            raise ConfigError(
                f"{other.name} has the channels {', '.join(other.recording.sensors)}, "
                f"{first.name} has {', '.join(sensors)}; name the same with --channels"
            )
        if not math.isclose(other.recording.sampling_rate, rate, rel_tol=SAME_RATE):
            raise ConfigError(
                f"{other.name} has {other.recording.sampling_rate:g} samples a second, "
                f"{first.name} has {rate:g}; resample one of them"
            )


def _check_distinct(carriers: Sequence[Carrier]) -> None:
    """Refuse a recording that is given twice: its blocks would be on two sides."""
    by_samples: dict[str, str] = {}
    for carrier in carriers:
        if carrier.samples_sha256 in by_samples:
            raise ConfigError(
                f"--healthy: {carrier.name} has the samples of "
                f"{by_samples[carrier.samples_sha256]}; give each recording once"
            )
        if carrier.name in by_samples.values():
            raise ConfigError(
                f"--healthy: two files are named {carrier.name}; rename one of them"
            )
        by_samples[carrier.samples_sha256] = carrier.name


def _follow(
    healthy: HealthyRecording, gearing: Gearing, speed_rpm: float, pulses_per_turn: int
) -> Carrier:
    if healthy.tacho is None:
        turned = _by_mesh(healthy, gearing, speed_rpm)
    else:
        turned = _by_tacho(healthy, speed_rpm, pulses_per_turn)
    return Carrier(
        name=healthy.name,
        sha256=healthy.sha256,
        samples_sha256=samples_digest(healthy.recording),
        recording=healthy.recording,
        turned=turned,
        set_rpm=speed_rpm,
    )


def _by_mesh(healthy: HealthyRecording, gearing: Gearing, speed_rpm: float) -> Array:
    """Turns of the driving shaft by the first stage whose mesh is found."""
    first: ConfigError | None = None
    for stage in range(gearing.n_stages):
        gear = 2 * stage
        try:
            cycles = wandering_mesh_cycles(
                healthy.recording,
                gearing.stage(stage),
                speed_rpm * gearing.turns(gear),
                highest=PASS_SHARE * healthy.recording.sampling_rate,
                options=OPTIONS,
                longer="record longer",
            )
        except TooShortError as error:
            raise TooShortError(f"{healthy.name}: {error}") from None
        except ConfigError as error:
            first = first or error
            continue
        return np.asarray(cycles, dtype=float) / gearing.mesh_order(gear)
    stages = ""
    if gearing.n_stages > 1:
        stages = f" (nor of {gearing.n_stages - 1} further stage(s))"
    raise ConfigError(f"{healthy.name}{stages}: {first}")


def _by_tacho(
    healthy: HealthyRecording, speed_rpm: float, pulses_per_turn: int
) -> Array:
    """Turns of the driving shaft by its pulses; at the mean speed before and after them."""
    from scipy.interpolate import PchipInterpolator

    assert healthy.tacho is not None
    rate = healthy.recording.sampling_rate
    if pulses_per_turn < 1:
        raise ConfigError(f"--pulses-per-turn {pulses_per_turn} must be at least 1")
    if not np.all(np.isfinite(healthy.tacho)):
        raise ConfigError(f"{healthy.name}: --tacho holds values that are not finite")
    times = pulse_times(healthy.tacho, rate)
    if len(times) < 4 * pulses_per_turn + 1:
        raise ConfigError(
            f"{healthy.name}: --tacho has {len(times)} pulses at {pulses_per_turn} a turn, "
            "fewer than four turns; check the channel and --pulses-per-turn"
        )
    between = np.diff(times)
    jump = np.maximum(between[1:] / between[:-1], between[:-1] / between[1:])
    if jump.max() > MOST_JUMP:
        raise ConfigError(
            f"{healthy.name}: --tacho jumps by {jump.max():.3g} from pulse to pulse at "
            f"{times[1 + int(jump.argmax())]:.4g} s; mend the channel, or leave --tacho out"
        )
    passed = np.arange(len(times)) / pulses_per_turn
    speed = 60.0 * float(passed[-1] / (times[-1] - times[0]))
    if not math.isclose(speed, speed_rpm, rel_tol=TACHO_TOLERANCE):
        raise ConfigError(
            f"{healthy.name}: --tacho gives {speed:.5g} r/min, --speed-rpm says "
            f"{speed_rpm:g}; check --pulses-per-turn"
        )
    instants = np.arange(healthy.recording.acceleration.shape[1]) / rate
    turned = np.asarray(PchipInterpolator(times, passed)(instants), dtype=float)
    before, after = instants < times[0], instants > times[-1]
    turned[before] = (instants[before] - times[0]) / (between[0] * pulses_per_turn)
    turned[after] = passed[-1] + (instants[after] - times[-1]) / (
        between[-1] * pulses_per_turn
    )
    return turned - turned[0]
