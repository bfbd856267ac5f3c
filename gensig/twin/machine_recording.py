"""Recording of a machine for a fit.

It is read like any other; its channels get names of sensors of a configuration.
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
    for index, name in enumerate(names):
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:32]
        plain = plain or f"channel_{index}"
        if not plain[0].isalpha() or is_turning(plain):
            plain = f"s_{plain}"[:30] + "_a"
        made.append(plain)
    if len(set(made)) < len(made):
        raise ConfigError(
            f"{file}: the names {', '.join(names)} differ in nothing but signs; rename the columns"
        )
    return tuple(made)
