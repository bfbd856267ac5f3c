"""From clean bearing accelerations to what is recorded: channel gain and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.units import unit

Array = NDArray[np.float64]

SNR_REFERENCES = ("healthy_twin", "record")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Which channels are recorded, how fast, and under how much noise.

    ``snr`` in dB is that of white noise over the whole band; None records without noise. Its reference is the power
    of the same unit at the same condition without the fault (``healthy_twin``), so the floor cannot tell the class.
    """

    sampling_rate: float = unit("hz")
    channels: tuple[str, ...]
    snr: float | None = unit("db")
    snr_reference: str
    gain_scatter: float

    def __post_init__(self) -> None:
        if not 1000.0 <= self.sampling_rate <= 1e6:
            raise ConfigError(f"sensing.sampling_rate_hz = {self.sampling_rate:g} must lie in 1000..1000000")
        if not self.channels or len(set(self.channels)) != len(self.channels):
            raise ConfigError(f"sensing.channels = {list(self.channels)} must name at least one channel, each once")
        if self.snr_reference not in SNR_REFERENCES:
            raise ConfigError(f"sensing.snr_reference = {self.snr_reference!r}; allowed: {', '.join(SNR_REFERENCES)}")
        if not 0.0 <= self.gain_scatter < 0.5:
            raise ConfigError(f"sensing.gain_scatter = {self.gain_scatter:g} must lie in 0..0.5")


def power(signal: Array) -> Array:
    """Mean square without the mean, (channel,) (m/s2)^2."""
    return np.var(signal, axis=-1)


def detectability(residual: Array, noise_power: Array) -> float:
    """How far the best possible detector tells a known residual from white noise: d' of a matched filter.

    Square root of the residual's energy over the noise power, summed over channels; NaN where a channel has no noise.
    With d' the detector is right in a share Phi(d' / 2) of equally many records with and without the fault: 0.69 at 1,
    0.93 at 3. It knows unit, phase, load and speed of the record, and the fault; no classifier can do better.

    Parameters
    ----------
    residual : (channel, sample) m/s2    what the fault adds
    noise_power : (channel,) (m/s2)^2    variance of a sample's noise
    """
    if not np.all(noise_power > 0.0):
        return math.nan
    return math.sqrt(float(np.sum(np.sum(residual**2, axis=-1) / noise_power)))


def add_noise(clean: Array, noise_power: Array, rng: np.random.Generator) -> Array:
    """Add white Gaussian noise of the given power to each channel, (channel, sample)."""
    return clean + np.sqrt(noise_power)[:, None] * rng.standard_normal(clean.shape)
