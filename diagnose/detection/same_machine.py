"""Refusals of recordings that cannot be of one machine and one way of measuring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnose.detection.followed_shafts import FollowedRecording
from diagnose.recordings.plausible import MOST_LEVEL_RATIO
from gensig.errors import ConfigError
from gensig.signals.indicators import rms

RATE_TOLERANCE = 1e-3
SAME_SPEED = 0.02  # relative
AT_OTHER_SPEED = 4.0  # times the ratio of levels; simulated machines reach 7 in all


def check_alike(recording: FollowedRecording, healthy: FollowedRecording) -> None:
    """Refuse a recording of another rate or other channels than a healthy one.

    Raises
    ------
    ConfigError    with both
    """
    name, other = recording.name, healthy.name
    rates = recording.sampling_rate, healthy.sampling_rate
    if abs(rates[0] / rates[1] - 1.0) > RATE_TOLERANCE:
        raise ConfigError(
            f"{name} has {rates[0]:g} samples a second, {other} {rates[1]:g}: record both at one "
            "rate, or resample one"
        )
    if recording.sensors != healthy.sensors:
        raise ConfigError(
            f"{name} has the channels {', '.join(recording.sensors)}, {other} "
            f"{', '.join(healthy.sensors)}: choose the same with --channels"
        )


def check_healthy(recordings: Sequence[FollowedRecording]) -> None:
    """Refuse healthy recordings that differ in rate, channels or by far in level.

    Raises
    ------
    ConfigError    with both recordings
    """
    first, *others = recordings
    for other in others:
        check_alike(other, first)
        levels = rms(other.signal) / np.maximum(rms(first.signal), 1e-30)
        ratio = float(np.median(levels))
        most = MOST_LEVEL_RATIO
        if abs(other.speed_rpm / first.speed_rpm - 1.0) > SAME_SPEED:
            most *= AT_OTHER_SPEED
        if not 1.0 / most <= ratio <= most:
            raise ConfigError(
                f"{other.name} has {ratio:.3g} times the level of {first.name}; healthy recordings "
                f"of one machine differ by at most {most:g}: check machine, sensor and "
                "--unit"
            )
