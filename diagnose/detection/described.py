"""Recordings as the user describes them, followed over the angle of the input shaft."""

from __future__ import annotations

from diagnose.detection.followed_shafts import FollowedRecording, Tacho, follow_shafts
from diagnose.detection.gear_stages import GearStages
from diagnose.recordings.channels import tacho_apart
from diagnose.recordings.source import Source
from gensig.signals.recording import read_file, recording_of

RATE_OPTION = "--sampling-rate"


def follow_file(source: Source, stages: GearStages) -> FollowedRecording:
    """Read a recording and follow its input shaft.

    Raises
    ------
    ConfigError    for a file that cannot be used, and as `follow_shafts`
    """
    content = read_file(
        source.file,
        rate=source.sampling_rate,
        array=source.array,
        rate_option=RATE_OPTION,
    )
    content, pulses = tacho_apart(content, source.tacho)
    recording = recording_of(content, unit=source.unit, channels=source.channels)
    tacho = None
    if pulses is not None and source.tacho is not None:
        tacho = Tacho(
            name=source.tacho, signal=pulses, pulses_per_turn=source.pulses_per_turn
        )
    return follow_shafts(
        recording, stages, source.speed_rpm, name=source.file, tacho=tacho
    )
