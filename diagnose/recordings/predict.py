"""One recording and a trained network: class probabilities, and whether it is like anything the network has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.inputs import RecordedSignal
from diagnose.data.windows import WindowSet
from diagnose.networks.calibration import probabilities
from diagnose.recordings.verdict import class_text, score_text, verdict
from gensig.errors import ConfigError
from gensig.signals.mesh_motion import in_hertz
from gensig.signals.recording import Recording, RecordingFile, read_file, recording_of, without_unit
from gensig.signals.resampling import rate_change

if TYPE_CHECKING:
    from diagnose.data.tracking import Tracked
    from diagnose.networks.domain import Domain
    from diagnose.networks.network import Network
    from diagnose.training.store import ModelDescription

RATE_OPTION = "--sampling-rate"
RATE_TOLERANCE = 1e-3
SPEED_TOLERANCE = 0.02  # assumed: how well a user knows the speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What the user says about the recording; None where the file tells or nothing is known.

    Attributes
    ----------
    file : see `gensig.signals.recording.read_file`
    sampling_rate : Hz
    speed_rpm : r/min of the driving shaft, compared with the speeds of the training records
    teeth : of the driving and the driven gear, compared with those of the training records
    tacho : name of a channel with the pulses of the driving shaft
    pulses_per_turn : of it
    as_recorded : no order tracking, whatever is known
    to_speed_rpm : r/min that an order-tracked recording is played at; None is its own mean
    channels : names in the file, in the order of the network's
    unit : m/s2 or g
    array : name in a .npz, HDF5 or MATLAB file
    """

    file: str
    sampling_rate: float | None = None
    speed_rpm: float | None = None
    teeth: tuple[int, int] | None = None
    tacho: str | None = None
    pulses_per_turn: int = 1
    as_recorded: bool = False
    to_speed_rpm: float | None = None
    channels: tuple[str, ...] | None = None
    unit: str = "m/s2"
    array: str | None = None

    def __post_init__(self) -> None:
        if self.speed_rpm is not None and not 0.0 < self.speed_rpm < 1e6:
            raise ConfigError(f"--speed-rpm {self.speed_rpm:g} must be positive")
        if self.teeth is not None and not all(4 <= n_teeth <= 1000 for n_teeth in self.teeth):
            raise ConfigError(f"--teeth {self.teeth[0]} {self.teeth[1]}: a gear has 4 to 1000 teeth")
        if self.pulses_per_turn < 1:
            raise ConfigError(f"--pulses-per-turn {self.pulses_per_turn} must be at least 1")
        if self.to_speed_rpm is not None and not self.is_tracked:
            raise ConfigError("--to-speed needs order tracking: give --tacho, or --teeth and --speed-rpm")
        if Path(self.file).expanduser().is_dir():
            raise ConfigError(f"{self.file} is a folder, not a recording; for a data set use diagnose evaluate")

    @property
    def is_tracked(self) -> bool:
        """Whether enough is known to follow the speed."""
        by_mesh = self.teeth is not None and self.speed_rpm is not None
        return (self.tacho is not None or by_mesh) and not self.as_recorded


def predict_recording(
    model: Network, description: ModelDescription, domain: Domain | None, source: Source
) -> dict[str, Any]:
    """Class probabilities of a recording and of its windows, and the out-of-distribution flag.

    The recording counts as out of distribution if at least half of its windows lie farther from the training windows
    than the threshold, its speed lies outside those of the training records, or its gears have other teeth. With a
    tachometer, or with teeth and speed, the recording is first played at one constant speed.

    Returns
    -------
    plain dictionary, the content of ``diagnose predict --json``

    Raises
    ------
    ConfigError    for a recording that cannot be read, is too short or too slowly sampled, or whose channels do not fit
    """
    from diagnose.networks.domain import distances
    from diagnose.networks.network import GEARS
    from diagnose.scoring.metrics import over_records
    from diagnose.training.classes import predict_windows
    from diagnose.training.heads import predict_heads

    windows, recording, channels, tracked = windows_of(description, source)
    log_probability = predict_windows(model, windows)
    overall = probabilities(over_records(log_probability, windows.record)[1], description.temperature)[0]
    distance = None if domain is None else distances(domain, windows)
    beyond = None if domain is None or distance is None else distance > domain.threshold
    reasons = reasons_unlike(description, source, tracked, beyond)
    names, rate = description.class_names, description.sampling_rate_hz
    said = {name: values[0] for name, values in predict_heads(model, windows).items()}
    by_class = dict(zip(names, overall.tolist(), strict=True))
    return {
        "recording": source.file,
        **verdict(by_class, description.test_score),
        "probabilities": by_class,
        "severity": float(said["severity"][overall.argmax()]) if "severity" in said else None,
        "gear": GEARS[int(said["gear"].argmax())] if "gear" in said else None,
        "out_of_distribution": None if beyond is None and not reasons else bool(reasons),
        "reasons": reasons,
        "n_windows": len(windows),
        "n_windows_beyond": None if beyond is None else int(beyond.sum()),
        "distance_threshold": None if domain is None else domain.threshold,
        "window_duration_s": window_duration(description, recording),
        "windows": [
            {
                "start_s": float(start / rate),
                "probabilities": dict(zip(names, row.tolist(), strict=True)),
                "distance": None if distance is None else float(distance[index]),
                "beyond": None if beyond is None else bool(beyond[index]),
            }
            for index, (start, row) in enumerate(zip(windows.start, probabilities(log_probability), strict=True))
        ],
        "channels": dict(zip(description.channel_names, channels, strict=True)),
        "sampling_rate_hz": recording.sampling_rate,
        "model_sampling_rate_hz": rate,
        "adaptation": description.adaptation,
        "speed_rpm": source.speed_rpm,
        "order_tracking": None if tracked is None else tracking_facts(tracked, source),
        "trained_n_teeth": None if description.n_teeth is None else list(description.n_teeth),
        "trained_speed_rpm": None if description.speed_rpm_range is None else list(description.speed_rpm_range),
    }


def windows_of(
    description: ModelDescription, source: Source
) -> tuple[WindowSet, Recording, tuple[str, ...], Tracked | None]:
    """Windows of a recording as the network takes them, the recording as read, its names of the channels, and over the
    shaft's angle where that is tracked."""
    from diagnose.networks.registry import input_of

    recording, channels, tacho = _read(description, source)
    tracked = _tracked(recording, tacho, source) if source.is_tracked else None
    signal = _in_domain(recording, tracked, description, source)
    speed = source.speed_rpm if tracked is None else source.to_speed_rpm or tracked.speed_rpm
    recorded = RecordedSignal(
        signal=signal,
        sampling_rate=description.sampling_rate_hz,
        speed_rpm=speed,
        file=source.file,
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
    )
    windows = input_of(description.model).of_recording(recorded)
    return windows, recording, channels, tracked


def summary(result: dict[str, Any]) -> str:
    """One line for people."""
    said = f"{result['recording']}: {class_text(result)}"
    if result["severity"] is not None and result["gear"] not in (None, "none") and not result["undecided"]:
        said += f", severity {result['severity']:.2f} on the {result['gear']}"
    if tracking := result["order_tracking"]:
        low, high = tracking["speed_range_rpm"]
        said += (
            f" (speed by {tracking['by']}, {low:.5g} to {high:.5g} r/min, played at {tracking['played_at_rpm']:.5g})"
        )
    n_windows, beyond = result["n_windows"], result["n_windows_beyond"]
    if result["out_of_distribution"]:
        return f"{said}; OUT OF DISTRIBUTION, do not rely on the class: {'; '.join(result['reasons'])}"
    if beyond is None:
        return f"{said}; no out-of-distribution flag: the model stores none, train it again; {score_text(result)}"
    return f"{said}; like the training data ({beyond} of {n_windows} windows beyond it); {score_text(result)}"


def reasons_unlike(
    description: ModelDescription, source: Source, tracked: Tracked | None, beyond: NDArray[np.bool_] | None
) -> list[str]:
    """Why a recording is out of distribution; empty if it is not."""
    reasons = []
    if beyond is not None and 2 * beyond.sum() >= beyond.size:
        reasons.append(f"{beyond.sum()} of {beyond.size} windows are unlike the training data")
    if description.speed_rpm_range is not None:
        low, high = description.speed_rpm_range
        speeds = (source.speed_rpm,) if tracked is None else tracked.speed_range_rpm
        outside = [
            speed
            for speed in speeds
            if speed and not low * (1 - SPEED_TOLERANCE) <= speed <= high * (1 + SPEED_TOLERANCE)
        ]
        if outside:
            hint = in_hertz(outside[-1]) if low <= 60.0 * outside[-1] <= high else ""
            reasons.append(f"{outside[-1]:g} r/min is outside the {low:.0f} to {high:.0f} r/min of the training{hint}")
    if source.teeth is not None and description.n_teeth is not None and source.teeth != description.n_teeth:
        given, known = ("/".join(map(str, teeth)) for teeth in (source.teeth, description.n_teeth))
        reasons.append(f"the gears have {given} teeth, those of the training {known}")
    return reasons


def _tracked(recording: Recording, tacho: NDArray[np.floating] | None, source: Source) -> Tracked:
    """The recording over the angle of the driving shaft."""
    from diagnose.data.tracking import track_by_mesh, track_by_tacho
    from gensig.signals.mesh_motion import Teeth

    if tacho is None or source.tacho is None:
        assert source.teeth is not None
        assert source.speed_rpm is not None
        return track_by_mesh(recording, Teeth(driving=source.teeth[0], driven=source.teeth[1]), source.speed_rpm)
    tracked = track_by_tacho(recording, tacho, source.tacho, pulses_per_turn=source.pulses_per_turn)
    low, high = (1 - SPEED_TOLERANCE) * tracked.speed_range_rpm[0], (1 + SPEED_TOLERANCE) * tracked.speed_range_rpm[1]
    if source.speed_rpm is not None and not low <= source.speed_rpm <= high:
        raise ConfigError(
            f"--tacho {source.tacho} gives {tracked.speed_rpm:.5g} r/min, --speed-rpm says {source.speed_rpm:g}; check "
            "--pulses-per-turn, or leave --speed-rpm out"
        )
    return tracked


def tracking_facts(tracked: Tracked, source: Source) -> dict[str, Any]:
    """How the speed was followed, and what it was."""
    return {
        "by": tracked.by,
        "speed_rpm": tracked.speed_rpm,
        "speed_range_rpm": list(tracked.speed_range_rpm),
        "played_at_rpm": source.to_speed_rpm or tracked.speed_rpm,
    }


def _read(description: ModelDescription, source: Source) -> tuple[Recording, tuple[str, ...], NDArray[Any] | None]:
    """Recording with the network's channels in their order, what the file calls them, and the tachometer's."""
    content = read_file(source.file, rate=source.sampling_rate, array=source.array, rate_option=RATE_OPTION)
    tacho = None
    if source.tacho is not None:
        if source.tacho not in content.channels:
            raise ConfigError(f"{content.file}: no channel {source.tacho}; it has {', '.join(content.channels)}")
        place = content.channels.index(source.tacho)
        tacho = content.values[place]
        names = tuple(name for name in content.channels if name != source.tacho)
        if not names:
            raise ConfigError(f"{content.file}: there is no channel beside {source.tacho}")
        content = replace(content, channels=names, values=np.delete(content.values, place, axis=0))
    chosen = _channels(content, description.channel_names, source.channels)
    needs_level = description.normalise == "none"
    return recording_of(content, unit=source.unit, channels=chosen, needs_level=needs_level), chosen, tacho


def _channels(content: RecordingFile, wanted: Sequence[str], given: Sequence[str] | None) -> tuple[str, ...]:
    """Channels of the file for those of the network: as given, by name, or in order where no name says otherwise."""
    needs = f"the model takes {len(wanted)}, {', '.join(wanted)}"
    if given is not None:
        if len(given) != len(wanted):
            raise ConfigError(f"--channels names {len(given)} channel(s); {needs}: name as many, in this order")
        return tuple(given)
    by_name = {without_unit(name): name for name in content.channels}
    if all(name in by_name for name in wanted):
        return tuple(by_name[name] for name in wanted)
    has = f"{content.file} has {len(content.channels)} channel(s), {', '.join(content.channels)}"
    if len(content.channels) != len(wanted):
        raise ConfigError(f"{has}; {needs}: choose with --channels, in this order")
    if content.named and len(wanted) > 1:
        raise ConfigError(f"{has}; {needs}: say which is which with --channels, in this order")
    return content.channels


def _in_domain(
    recording: Recording, tracked: Tracked | None, description: ModelDescription, source: Source
) -> NDArray[np.float32]:
    """(channel, sample) at the network's rate and one speed; refuses what holds less bandwidth than that."""
    found, rate, file = recording.sampling_rate, description.sampling_rate_hz, source.file
    if found < rate * (1 - RATE_TOLERANCE):
        raise ConfigError(
            f"{file} has {found:g} samples a second and so nothing above {found / 2:g} Hz; the model was trained at "
            f"{rate:g}: measure faster, or train a model with sampling_rate_hz={found:g} or below"
        )
    if tracked is None:
        return rate_change(found, rate).apply(recording.acceleration).astype(np.float32)
    from diagnose.data.tracking import at_constant_speed

    speed, played = tracked.speed_rpm, source.to_speed_rpm or tracked.speed_rpm
    if description.speed_rpm_range is not None and source.to_speed_rpm is not None:
        low, high = description.speed_rpm_range
        if not low <= played <= high:
            raise ConfigError(f"--to-speed {played:g} must lie in the {low:.0f} to {high:.0f} r/min of the training")
    as_fast = found * played / speed
    if as_fast < rate * (1 - RATE_TOLERANCE):
        raise ConfigError(
            f"{file}: {found:g} samples a second at {speed:.4g} r/min, played at {played:g}, are {as_fast:.5g}; "
            f"the model was trained at {rate:g}: give a --to-speed of {speed * rate / found:.4g} or more"
        )
    return at_constant_speed(tracked, rate, played).astype(np.float32)


def window_duration(description: ModelDescription, recording: Recording) -> float:
    """Seconds that one answer is about."""
    from diagnose.networks.registry import input_of

    return input_of(description.model).seconds(
        window=description.window_samples / description.sampling_rate_hz,
        recording=float(recording.acceleration.shape[-1] / recording.sampling_rate),
    )
