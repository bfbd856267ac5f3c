"""Transfer path that a user measured.

The file has frequency or impulse responses from every bearing channel to every sensor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Complex
from gensig.dynamics.decimation import LOWEST_HZ, usable_band
from gensig.errors import ConfigError
from gensig.text.user_file import check_columns, check_rate, read_table

KEY = "sensing.path.file"
LEAST_ROWS = 16
MOST_TAPS = 1_000_000
NON_CAUSAL = 0.05  # share of a response's energy that may come before time 0


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredPath:
    """CSV file of accelerations at the sensors over accelerations at the bearings.

    Its columns are ``frequency_hz`` with ``<channel>_to_<sensor>_real`` and ``_imaginary``, or
    ``time_s`` with ``<channel>_to_<sensor>``, the response to a single sample of 1 m/s2. Every
    channel and sensor has its columns.
    """

    file: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpulseResponses:
    """Responses at the sampling rate, (sensor, channel, sample)."""

    taps: Array
    sampling_rate: float

    @property
    def memory(self) -> float:
        """Length of the responses, s."""
        return self.taps.shape[2] / self.sampling_rate

    def apply(self, source: Array, sampling_rate: float) -> Array:
        """Accelerations at the sensors from those at the bearings.

        (channel, sample) to (sensor, sample).
        """
        from scipy.signal import oaconvolve

        if sampling_rate != self.sampling_rate:
            raise ValueError(
                f"responses at {self.sampling_rate:g} Hz, signal at {sampling_rate:g} Hz"
            )
        responses: Array = oaconvolve(source[None], self.taps, axes=2)
        return np.asarray(responses[:, :, : source.shape[1]].sum(axis=1))


@lru_cache(maxsize=4)
def read_responses(
    path: MeasuredPath,
    channels: tuple[str, ...],
    sensors: tuple[str, ...],
    sampling_rate: float,
) -> ImpulseResponses:
    """Impulse responses of a measured path.

    Raises
    ------
    ConfigError    for a file with other columns, rates or bands, with NaN, too short, or not causal
    """
    pairs = [f"{channel}_to_{sensor}" for sensor in sensors for channel in channels]
    names, values = read_table(KEY, path.file, least_rows=LEAST_ROWS)
    if "time_s" in names:
        check_columns(KEY, path.file, names, ["time_s", *pairs])
        check_rate(KEY, path.file, values[names.index("time_s")], sampling_rate)
        taps = values[[names.index(pair) for pair in pairs]]
    else:
        parts = [f"{pair}_{part}" for pair in pairs for part in ("real", "imaginary")]
        check_columns(KEY, path.file, names, ["frequency_hz", *parts])
        columns = values[[names.index(part) for part in parts]]
        frequency = values[names.index("frequency_hz")]
        taps = _impulse_responses(
            path.file, frequency, columns[::2] + 1j * columns[1::2], sampling_rate
        )
    return ImpulseResponses(
        taps=taps.reshape(len(sensors), len(channels), -1), sampling_rate=sampling_rate
    )


def _impulse_responses(
    file: str, frequency: Array, response: Complex, sampling_rate: float
) -> Array:
    """Causal impulse responses of frequency responses, (pair, line) to (pair, sample).

    The response goes straight between the lines given and is held beyond them: records have
    nothing above the usable band. Half of the inverse transform is time before 0. What a
    measurement has there is left out, and refused where it is more than a trace.
    """
    where = f"{KEY} = {file}"
    step = np.diff(frequency)
    if not (np.all(step > 0.0) and frequency[0] >= 0.0):
        raise ConfigError(
            f"{where}: frequency_hz must rise from line to line and not be negative"
        )
    highest = usable_band(sampling_rate)[1]
    if frequency[0] > LOWEST_HZ or frequency[-1] < highest:
        raise ConfigError(
            f"{where} reaches from {frequency[0]:g} to {frequency[-1]:g} Hz; "
            f"{LOWEST_HZ:g} to {highest:g} Hz is needed"
        )
    n_taps = 2 * math.ceil(sampling_rate / float(step.min()))
    if n_taps > MOST_TAPS:
        raise ConfigError(
            f"{where}: lines {step.min():g} Hz apart are too narrow; thin them out"
        )
    grid = np.fft.rfftfreq(n_taps, 1.0 / sampling_rate)
    even = np.array([np.interp(grid, frequency, row) for row in response])
    taps = np.fft.irfft(even, n_taps, axis=1)
    half = n_taps // 2
    energy = taps**2
    share = energy[:, half:].sum(axis=1) / np.maximum(energy.sum(axis=1), 1e-300)
    early = float(share.max())
    if early > NON_CAUSAL:
        raise ConfigError(
            f"{where}: {100.0 * early:.0f} % of a response's energy comes before time 0; "
            "shift it to be causal"
        )
    return taps[:, :half]
