"""Recordings as inputs of a network: channels chosen, speed followed, resampled and cut."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.inputs import NetworkInput, RecordedSignal, SoundSignal
from diagnose.data.turns import Turns
from diagnose.data.windows import WindowSet
from diagnose.recordings.followed import (
    SPEED_TOLERANCE,
    at_nearest_rate,
    at_one_speed,
    played_at,
    tracked_if_long,
)
from diagnose.recordings.plausible import (
    Statement,
    check_level,
    check_mesh,
    check_place,
    check_turns,
)
from diagnose.recordings.source import Source, chosen_channels, read_source
from diagnose.training.carried import Stretch, digests_of, held_out_stretch
from gensig.errors import ConfigError
from gensig.signals.recording import Recording, RecordingFile, recording_of

if TYPE_CHECKING:
    from diagnose.data.tracking import Tracked
    from diagnose.training.store import ModelDescription

SPEED_OPTION, HEALTHY_SPEED_OPTION = "--speed-rpm", "--healthy-speed-rpm"


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedRecording:
    """A recording with its inputs for a network.

    Attributes
    ----------
    windows : inputs as the network takes them
    recording : as read, at its own rate
    channels : names in the file, in the order of the network's
    tracked : the recording over the shaft's angle; None without order tracking
    speed_rpm : r/min at which the inputs are; None where it is not known
    duration_s : duration of the signal of one input
    held_out : samples that were held out of a recording that carried implants, `recording` is
        these; None for a whole one
    """

    windows: WindowSet
    recording: Recording
    channels: tuple[str, ...]
    tracked: Tracked | None
    speed_rpm: float | None
    duration_s: float
    held_out: Stretch | None


def prepare_recording(
    description: ModelDescription,
    inputs: NetworkInput,
    source: Source,
) -> PreparedRecording:
    """Inputs of a recording for a network, of the kind that it reads.

    Recordings of `Source.healthy` may have carried implants in the training: nothing is judged by
    them.

    Raises
    ------
    ConfigError    for a recording that cannot be read, is too short or too slowly sampled, or
        whose channels do not fit
    DatasetError    for one that carried, unless what was held out is asked for
    """
    read = _without_carried(description, _read(description, source), source)
    played = _played(description, inputs, source, read, SPEED_OPTION)
    sound = [
        _played(
            description,
            inputs,
            other,
            _read(description, other),
            HEALTHY_SPEED_OPTION,
            played.sampling_rate,
        )
        for other in source.healthy
    ]
    if isinstance(inputs, Turns):
        for other, described in zip(sound, source.healthy, strict=True):
            check_level(played.signal, other.signal, source.file, described.file)
    recorded = RecordedSignal(
        signal=played.signal,
        sampling_rate=played.sampling_rate,
        speed_rpm=played.speed_rpm,
        n_teeth=source.teeth or description.n_teeth,
        file=source.file,
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        healthy=tuple(
            _sound_signal(other, described.file, played.sampling_rate)
            for other, described in zip(sound, source.healthy, strict=True)
        ),
    )
    return PreparedRecording(
        windows=inputs.of_recording(recorded),
        recording=read.recording,
        channels=read.channels,
        tracked=played.tracked,
        speed_rpm=played.speed_rpm,
        duration_s=inputs.seconds(
            window=description.window_samples / description.sampling_rate_hz,
            recording=read.recording.duration,
        ),
        held_out=read.held_out,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """A recording as read, at its own rate.

    Attributes
    ----------
    content : of the file, without the tachometer
    recording : with the network's channels in their order
    channels : their names in the file
    tacho : (sample,) pulses, or None
    held_out : as in `PreparedRecording`
    """

    content: RecordingFile
    recording: Recording
    channels: tuple[str, ...]
    tacho: NDArray[Any] | None
    held_out: Stretch | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Played:
    """A recording at the rate that a network takes it at, and at one speed.

    Attributes
    ----------
    signal : (channel, sample)
    sampling_rate : Hz, of the signal
    tracked, speed_rpm : of `PreparedRecording`
    """

    signal: NDArray[np.float32]
    sampling_rate: float
    tracked: Tracked | None
    speed_rpm: float | None


def _played(
    description: ModelDescription,
    inputs: NetworkInput,
    source: Source,
    read: _Read,
    speed_option: str,
    sampling_rate: float | None = None,
) -> _Played:
    """A recording at one speed, whose mesh is where the turns of the network need it.

    ``sampling_rate`` is that of the signal; None for that which the network takes it at.

    Raises
    ------
    ConfigError    as `prepare_recording`
    """
    recording, tacho = read.recording, read.tacho
    tracked = None
    if isinstance(inputs, Turns):
        teeth = _teeth(description, inputs, source)
        _check_as_recorded(recording, teeth, source, speed_option)
    if source.is_tracked:
        tracked = tracked_if_long(recording, tacho, source, inputs)
    wanted = sampling_rate or _rate(recording, tracked, description, inputs, source)
    if tracked is None:
        signal, rate = at_nearest_rate(recording, source, wanted)
        speed = source.speed_rpm
    else:
        constant = at_one_speed(recording, tracked, description, source, wanted)
        signal, speed, rate = constant.signal, constant.speed_rpm, wanted
    if isinstance(inputs, Turns) and speed is not None:
        statement = replace(
            _statement(teeth, source, speed, speed_option),
            followed=tracked is not None,
            can_follow=tracked is not None or not source.is_tracked,
        )
        check_turns(signal.shape[-1] / rate, statement)
        check_mesh(signal, rate, statement)
    return _Played(
        signal=signal.astype(np.float32),
        sampling_rate=rate,
        tracked=tracked,
        speed_rpm=speed,
    )


def _rate(
    recording: Recording,
    tracked: Tracked | None,
    description: ModelDescription,
    inputs: NetworkInput,
    source: Source,
) -> float:
    """Samples a second at which a network takes a recording.

    Windows are at the rate of the training. Turns may be of a recording of fewer samples.
    """
    trained = description.sampling_rate_hz
    if inputs.has_window_length:
        return trained
    available = float(recording.sampling_rate)
    if tracked is not None:
        available *= played_at(tracked, source) / tracked.speed_rpm
    return min(trained, available)


def _teeth(
    description: ModelDescription, inputs: Turns, source: Source
) -> tuple[int, int]:
    """Teeth of the driving and the driven gear: as stated, or those of the training.

    Raises
    ------
    ConfigError    for a network of any gears, where nothing says them
    """
    teeth = source.teeth or inputs.n_teeth or description.n_teeth
    if teeth is None:
        raise ConfigError(
            f"{source.file}: this model reads turns of any gears and must know theirs: "
            "give --teeth DRIVING DRIVEN"
        )
    return teeth


def _check_as_recorded(
    recording: Recording, teeth: tuple[int, int], source: Source, speed_option: str
) -> None:
    """Refuse a recording without speed, and one whose mesh is found elsewhere before it is tracked.

    Raises
    ------
    ConfigError    with what to give
    """
    if source.tacho is not None:
        return
    if source.speed_rpm is None:
        raise ConfigError(
            f"{source.file}: this model reads turns and must know the speed, which nothing tells: "
            f"give {speed_option} and --teeth {teeth[0]} {teeth[1]}, or --tacho CHANNEL"
        )
    if source.is_tracked:
        statement = _statement(teeth, source, source.speed_rpm, speed_option)
        check_place(recording.acceleration, recording.sampling_rate, statement)


def _statement(
    teeth: tuple[int, int], source: Source, speed_rpm: float, speed_option: str
) -> Statement:
    """Speed and teeth as the user, or the training, states them."""
    options = f"--teeth and {speed_option}"
    said = f"{teeth[0]} teeth, those of the training, at {speed_rpm:.5g} r/min"
    if source.teeth is not None:
        said = f"--teeth {teeth[0]} {teeth[1]} at {speed_rpm:.5g} r/min"
    if source.tacho is not None:
        options = "--teeth and --pulses-per-turn"
    return Statement(
        file=source.file,
        speed_rpm=speed_rpm,
        teeth=teeth,
        said=said,
        options=options,
        followed=source.is_tracked,
    )


def _sound_signal(played: _Played, file: str, sampling_rate: float) -> SoundSignal:
    """A healthy recording, as a network takes it beside a recording of a sampling rate.

    The speed is the one at which its samples would be at that very rate.

    Raises
    ------
    ConfigError    for an unknown speed
    """
    if played.speed_rpm is None:
        raise ConfigError(
            f"the speed of {file} is not known: say {HEALTHY_SPEED_OPTION}"
        )
    speed = played.speed_rpm * sampling_rate / played.sampling_rate
    return SoundSignal(signal=played.signal, speed_rpm=speed)


def tracking_facts(tracked: Tracked, source: Source) -> dict[str, Any]:
    """Order tracking of a recording: its kind and the speeds."""
    return {
        "by": tracked.by,
        "speed_rpm": tracked.speed_rpm,
        "speed_range_rpm": list(tracked.speed_range_rpm),
        "played_at_rpm": played_at(tracked, source),
    }


def trained_at(description: ModelDescription, speed_rpm: float) -> bool:
    """True if a speed lies within those of the training, or those are not known."""
    if description.speed_rpm_range is None:
        return True
    low, high = description.speed_rpm_range
    return low * (1 - SPEED_TOLERANCE) <= speed_rpm <= high * (1 + SPEED_TOLERANCE)


def tracking_text(tracking: Mapping[str, Any] | None) -> str:
    """Order tracking in words, from its facts; empty without any."""
    if not tracking:
        return ""
    low, high = tracking["speed_range_rpm"]
    return (
        f" (speed by {tracking['by']}, {low:.5g} to {high:.5g} r/min, "
        f"played at {tracking['played_at_rpm']:.5g})"
    )


def _read(description: ModelDescription, source: Source) -> _Read:
    """Recording with the network's channels in their order, and its tachometer."""
    content, tacho = read_source(source)
    chosen = source.channels or content.channels
    if not description.takes_each_channel:
        chosen = chosen_channels(content, description.channel_names, source.channels)
    recording = recording_of(
        content,
        unit=source.unit,
        channels=chosen,
        needs_level=description.normalise == "none",
    )
    return _Read(content=content, recording=recording, channels=chosen, tacho=tacho)


def _without_carried(
    description: ModelDescription, read: _Read, source: Source
) -> _Read:
    """The recording, or what was held out of it if it carried implants.

    Raises
    ------
    DatasetError    for one that carried, unless what was held out is asked for
    """
    carried = description.carried
    if carried is None:
        return read
    forms = [read.recording]
    with suppress(ConfigError):  # other columns of the file may be no accelerations
        forms.append(recording_of(read.content, unit=source.unit, needs_level=False))
    digests = digests_of(source.file, *forms)
    stretch = held_out_stretch(
        carried,
        digests,
        read.recording,
        file=source.file,
        held_out=source.held_out,
    )
    if stretch is None:
        return read
    tacho = read.tacho
    if tacho is not None:
        tacho = tacho[stretch.start : stretch.stop]
    recording = stretch.of(read.recording)
    return replace(read, recording=recording, tacho=tacho, held_out=stretch)
