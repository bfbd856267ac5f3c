"""The recording of a twin.

Read like any other, its channels named as sensors of a configuration.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from gensig.errors import ConfigError
from gensig.signals.recording import Recording, read_file, recording_of
from gensig.units import is_turning


def read_recording(
    file: str,
    *,
    rate: float | None = None,
    unit: str = "m/s2",
    channels: Sequence[str] | None = None,
    array: str | None = None,
) -> Recording:
    """Recording of a file; parameters and mistakes as of `read_file` and `recording_of`."""
    recording = recording_of(
        read_file(file, rate=rate, array=array), unit=unit, channels=channels
    )
    return replace(recording, sensors=_sensor_names(file, recording.sensors))


def _sensor_names(file: str, names: Sequence[str]) -> tuple[str, ...]:
    """Names as ``sensing.sensors`` takes them: letters, digits and _, at most 32."""
    made = []
    for place, name in enumerate(names):
        plain = (
            re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:32] or f"channel_{place}"
        )
        made.append(
            plain
            if plain[0].isalpha() and not is_turning(plain)
            else f"s_{plain}"[:30] + "_a"
        )
    if len(set(made)) < len(made):
        raise ConfigError(
            f"{file}: the names {', '.join(names)} differ in nothing but signs; rename the columns"
        )
    return tuple(made)
