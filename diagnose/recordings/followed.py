"""Recordings at the rate of a network, and over the angle of a shaft where that is followed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from diagnose.data.inputs import NetworkInput
from diagnose.data.turns import Turns
from diagnose.data.windows import FloatArray
from diagnose.recordings.source import Source
from gensig.errors import ConfigError, TooShortError
from gensig.signals.recording import Recording
from gensig.signals.resampling import rate_change

if TYPE_CHECKING:
    from diagnose.data.tracking import ConstantSpeed, Tracked
    from diagnose.training.store import ModelDescription

RATE_TOLERANCE = 1e-3
SPEED_TOLERANCE = 0.02  # assumed: how well a user knows the speed


def tracked_if_long(
    recording: Recording,
    tacho: NDArray[np.floating] | None,
    source: Source,
    inputs: NetworkInput,
) -> Tracked | None:
    """The recording over the shaft's angle; None for turns of too few to follow the speed.

    Turns need one of the slower gear. The speed of such a short recording counts as steady, as
    stated.
    """
    try:
        return _tracked(recording, tacho, source)
    except TooShortError:
        if not isinstance(inputs, Turns):
            raise
    return None


def _tracked(
    recording: Recording, tacho: NDArray[np.floating] | None, source: Source
) -> Tracked:
    """The recording over the angle of the driving shaft."""
    from diagnose.data.tracking import track_by_mesh, track_by_tacho
    from gensig.signals.mesh_motion import Teeth

    if tacho is None or source.tacho is None:
        assert source.teeth is not None
        assert source.speed_rpm is not None
        return track_by_mesh(
            recording,
            Teeth(driving=source.teeth[0], driven=source.teeth[1]),
            source.speed_rpm,
        )
    tracked = track_by_tacho(
        recording,
        tacho,
        source.tacho,
        pulses_per_turn=source.pulses_per_turn,
    )
    speed, (least, greatest) = source.speed_rpm, tracked.speed_range_rpm
    low, high = (1 - SPEED_TOLERANCE) * least, (1 + SPEED_TOLERANCE) * greatest
    if speed is not None and not low <= speed <= high:
        raise ConfigError(
            f"--tacho {source.tacho} gives {tracked.speed_rpm:.5g} r/min, --speed-rpm says "
            f"{speed:g}; check --pulses-per-turn, or leave --speed-rpm out"
        )
    return tracked


def at_nearest_rate(
    recording: Recording, source: Source, rate: float
) -> tuple[FloatArray, float]:
    """(channel, sample) as recorded, at the nearest rate that a ratio of whole numbers gives.

    Also that rate. Refuses a recording with less bandwidth.
    """
    given = recording.sampling_rate
    _check_bandwidth(given, source, rate)
    change = rate_change(given, rate)
    return change.apply(recording.acceleration), given * change.ratio


def at_one_speed(
    recording: Recording,
    tracked: Tracked,
    description: ModelDescription,
    source: Source,
    rate: float,
) -> ConstantSpeed:
    """The tracked recording at a rate and one speed.

    Refuses a recording with less bandwidth than that, and a speed outside the training.
    """
    from diagnose.data.tracking import at_constant_speed

    given, file = recording.sampling_rate, source.file
    _check_bandwidth(given, source, rate)
    speed, played = tracked.speed_rpm, played_at(tracked, source)
    if description.speed_rpm_range is not None and source.to_speed_rpm is not None:
        low, high = description.speed_rpm_range
        if not low <= played <= high:
            raise ConfigError(
                f"--to-speed {played:g} must lie in the {low:.0f} to {high:.0f} r/min of the "
                "training",
            )
    as_fast = given * played / speed
    if as_fast < rate * (1 - RATE_TOLERANCE):
        raise ConfigError(
            f"{file}: {given:g} samples a second at {speed:.4g} r/min, played at {played:g}, are "
            f"{as_fast:.5g}; the model was trained at {rate:g}: give a --to-speed of "
            f"{speed * rate / given:.4g} or more"
        )
    return at_constant_speed(tracked, rate, played)


def _check_bandwidth(given: float, source: Source, rate: float) -> None:
    """Refuse a recording of fewer samples a second than a rate."""
    if given < rate * (1 - RATE_TOLERANCE):
        raise ConfigError(
            f"{source.file} has {given:g} samples a second and so nothing above {given / 2:g} Hz; "
            f"the model was trained at {rate:g}: measure faster, or train a model with "
            f"sampling_rate_hz={given:g} or below"
        )


def played_at(tracked: Tracked, source: Source) -> float:
    """Speed in r/min of an order-tracked recording."""
    return source.to_speed_rpm or tracked.speed_rpm
