"""One recording and a trained network: class probabilities, and whether it is like anything the network has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.calibration import probabilities
from diagnose.windows import Segments, WindowSet, plan_windows
from gensig.errors import ConfigError
from gensig.signals.recording import Recording, RecordingFile, read_file, recording_of, without_unit

if TYPE_CHECKING:
    from torch import nn

    from diagnose.domain import Domain
    from diagnose.model_io import ModelDescription

RATE_OPTION = "--sampling-rate"
RATE_TOLERANCE = 1e-3
SPEED_TOLERANCE = 0.02  # assumed: how well a user knows the speed
MOST_STEPS = 1000  # of the ratio of two rates; leaves an error of 0.0005 at most


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What the user says about the recording; None where the file tells or nothing is known.

    Attributes
    ----------
    file : see `gensig.signals.recording.read_file`
    sampling_rate : Hz
    speed_rpm : r/min of the driving shaft, compared with the speeds of the training records
    channels : names in the file, in the order of the network's
    unit : m/s2 or g
    array : name in a .npz, HDF5 or MATLAB file
    """

    file: str
    sampling_rate: float | None = None
    speed_rpm: float | None = None
    channels: tuple[str, ...] | None = None
    unit: str = "m/s2"
    array: str | None = None

    def __post_init__(self) -> None:
        if self.speed_rpm is not None and not 0.0 < self.speed_rpm < 1e6:
            raise ConfigError(f"--speed-rpm {self.speed_rpm:g} must be positive")
        if Path(self.file).expanduser().is_dir():
            raise ConfigError(f"{self.file} is a folder, not a recording; for a data set use diagnose evaluate")


def predict_recording(
    model: nn.Module, description: ModelDescription, domain: Domain | None, source: Source
) -> dict[str, Any]:
    """Class probabilities of a recording and of its windows, and the out-of-distribution flag.

    The recording counts as out of distribution if at least half of its windows lie farther from the training windows
    than the threshold, or its stated speed lies outside those of the training records.

    Returns
    -------
    plain dictionary, the content of ``diagnose predict --json``

    Raises
    ------
    ConfigError    for a recording that cannot be read, is too short or too slowly sampled, or whose channels do not fit
    """
    from diagnose.domain import distances
    from diagnose.metrics import over_records
    from diagnose.train import predict_windows

    windows, recording, channels = windows_of(description, source)
    log_probability = predict_windows(model, windows)
    overall = probabilities(over_records(log_probability, windows.record)[1], description.temperature)[0]
    distance = None if domain is None else distances(domain, windows)
    beyond = None if domain is None or distance is None else distance > domain.threshold
    reasons = _reasons(description, source, beyond)
    names, rate = description.class_names, description.sampling_rate_hz
    return {
        "recording": source.file,
        "class": names[int(overall.argmax())],
        "probability": float(overall.max()),
        "probabilities": dict(zip(names, overall.tolist(), strict=True)),
        "out_of_distribution": None if beyond is None and not reasons else bool(reasons),
        "reasons": reasons,
        "n_windows": len(windows),
        "n_windows_beyond": None if beyond is None else int(beyond.sum()),
        "distance_threshold": None if domain is None else domain.threshold,
        "window_duration_s": description.window_samples / rate,
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
        "trained_speed_rpm": None if description.speed_rpm_range is None else list(description.speed_rpm_range),
    }


def windows_of(description: ModelDescription, source: Source) -> tuple[WindowSet, Recording, tuple[str, ...]]:
    """Windows of a recording as the network takes them, the recording as read, and its names of the channels."""
    recording, channels = _read(description, source)
    return _windows(_resampled(recording, description, source.file), description, source.file), recording, channels


def summary(result: dict[str, Any]) -> str:
    """One line for people."""
    said = f"{result['recording']}: {result['class']}, probability {result['probability']:.2f}"
    n_windows, beyond = result["n_windows"], result["n_windows_beyond"]
    if result["out_of_distribution"]:
        return f"{said}; OUT OF DISTRIBUTION, do not rely on the class: {'; '.join(result['reasons'])}"
    if beyond is None:
        return f"{said}; no out-of-distribution flag: the model stores none, train it again"
    return f"{said}; like the training data ({beyond} of {n_windows} windows beyond it)"


def _reasons(description: ModelDescription, source: Source, beyond: NDArray[np.bool_] | None) -> list[str]:
    """Why a recording is out of distribution; empty if it is not."""
    reasons = []
    if beyond is not None and 2 * beyond.sum() >= beyond.size:
        reasons.append(f"{beyond.sum()} of {beyond.size} windows are unlike the training data")
    if source.speed_rpm is not None and description.speed_rpm_range is not None:
        low, high = description.speed_rpm_range
        if not low * (1 - SPEED_TOLERANCE) <= source.speed_rpm <= high * (1 + SPEED_TOLERANCE):
            reasons.append(f"{source.speed_rpm:g} r/min is outside the {low:.0f} to {high:.0f} r/min of the training")
    return reasons


def _read(description: ModelDescription, source: Source) -> tuple[Recording, tuple[str, ...]]:
    """Recording with the network's channels in their order, and what the file calls them."""
    content = read_file(source.file, rate=source.sampling_rate, array=source.array, rate_option=RATE_OPTION)
    chosen = _channels(content, description.channel_names, source.channels)
    needs_level = description.normalise == "none"
    return recording_of(content, unit=source.unit, channels=chosen, needs_level=needs_level), chosen


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


def _resampled(recording: Recording, description: ModelDescription, file: str) -> NDArray[np.float32]:
    """(channel, sample) at the network's rate; refuses what holds less bandwidth than that."""
    found, rate = recording.sampling_rate, description.sampling_rate_hz
    if found < rate * (1 - RATE_TOLERANCE):
        raise ConfigError(
            f"{file} has {found:g} samples a second and so nothing above {found / 2:g} Hz; the model was trained at "
            f"{rate:g}: measure faster, or train a model at sensing.sampling_rate_hz={found:g} or below"
        )
    ratio = Fraction(rate / found).limit_denominator(MOST_STEPS)
    if ratio == 1:
        return recording.acceleration.astype(np.float32)
    from scipy.signal import resample_poly

    samples = resample_poly(recording.acceleration, ratio.numerator, ratio.denominator, axis=-1)
    return samples.astype(np.float32)


def _windows(signal: NDArray[np.float32], description: ModelDescription, file: str) -> WindowSet:
    """Windows as those of a record of a data set; the label is not used."""
    n_samples, rate = signal.shape[-1], description.sampling_rate_hz
    if n_samples < description.window_samples:
        raise ConfigError(
            f"{file} is too short: {n_samples / rate:.3g} s, a window of the model is "
            f"{description.window_samples / rate:.3g} s"
        )
    whole = Segments(record=np.array([0]), start=np.array([0]), stop=np.array([n_samples]))
    segment, start = plan_windows(whole, description.window_samples, description.stride_samples)
    return WindowSet(
        signals=(signal,),
        segment=segment,
        start=start,
        label=np.zeros_like(segment),
        record=np.zeros_like(segment),
        window_samples=description.window_samples,
        normalise=description.normalise,
    )
