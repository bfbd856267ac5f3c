"""Agreement of two solutions of one motion, in the quantities that people use.

Point values of teeth that bounce mean little. A landing that comes later by a microsecond changes
every sample after it, and nothing that anybody measures. Where bouncing is chaotic, no two
solutions follow each other at any step. They are samples of one random process, and narrow bands
differ: those of noise by 8.6 dB over the root of width x duration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array, Flags
from gensig.dynamics.decimation import usable_band
from gensig.signals.indicators import crest_factor, kurtosis, rms

THIRD_OCTAVE_DB = 0.5
INDICATORS = 0.05
HEARD_DB = 60.0  # bands further below the channel's loudest are not compared
LINES = 4  # a band is at least that wide: the main lobe of a Hann window
LOWEST_BAND = -17  # x of the band at 20 Hz


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """Largest differences between two solutions, (lane,) each.

    ``third_octave_db`` in the level of a band, over bands and channels, dB; ``indicators`` in
    RMS, kurtosis or crest factor, over channels, as a share. Infinite or NaN where one of the two
    is still or not finite.
    """

    third_octave_db: Array
    indicators: Array

    @property
    def agrees(self) -> Flags:
        """True where both lie within their limits, (lane,)."""
        return np.asarray(
            (self.third_octave_db <= THIRD_OCTAVE_DB) & (self.indicators <= INDICATORS)
        )


def agreement(tested: Array, exact: Array, sampling_rate: float) -> Agreement:
    """Compare two solutions, (lane, channel, sample) each."""
    return Agreement(
        third_octave_db=third_octave_difference(tested, exact, sampling_rate),
        indicators=indicator_difference(tested, exact),
    )


def third_octave_bands(n_samples: int, sampling_rate: float) -> tuple[Array, Array]:
    """Lower and upper edges of the third-octave bands that a signal resolves, Hz.

    They reach from the band at 20 Hz to the usable band's end, which cuts the highest. Bands
    narrower than four lines of the signal's spectrum are left out: a second resolves them from
    20 Hz on, 50 ms from 400 Hz on.

    Raises
    ------
    ValueError    if the signal resolves none

    Source: IEC 61260-1:2014, mid-band frequencies 1000 G^(x/3) Hz, edges G^(+-1/6) from there, G
    = 10^0.3.
    """
    highest = usable_band(sampling_rate)[1]
    numbers = np.arange(LOWEST_BAND, math.log10(highest / 1000.0) * 10.0 + 1.0)
    lower = 1000.0 * 10.0 ** ((numbers - 0.5) / 10.0)
    upper = np.minimum(10.0**0.1 * lower, highest)
    resolved = upper - lower >= LINES * sampling_rate / n_samples
    if not resolved.any():
        raise ValueError(
            f"{n_samples} samples at {sampling_rate:g} Hz resolve no third-octave band"
        )
    return lower[resolved], upper[resolved]


def third_octave_power(signal: Array, sampling_rate: float) -> Array:
    """Mean square by third-octave band, (..., sample) to (..., band).

    It is that of the power spectrum under a Hann window. A line that an edge crosses is shared in
    proportion. Bands as ``third_octave_bands``.
    """
    n_samples = signal.shape[-1]
    window = np.hanning(n_samples)
    lines = np.abs(np.fft.rfft(signal * window, axis=-1)) ** 2 * (
        2.0 / (n_samples * np.sum(window**2))
    )
    below = np.cumsum(lines, axis=-1)

    def power_below(edge: Array) -> Array:
        # line k reaches from k - 0.5 to k + 0.5
        position = edge * n_samples / sampling_rate + 0.5
        line = position.astype(np.int64)
        return np.asarray(below[..., line] - (line + 1 - position) * lines[..., line])

    lower, upper = third_octave_bands(n_samples, sampling_rate)
    return power_below(upper) - power_below(lower)


def third_octave_difference(tested: Array, exact: Array, sampling_rate: float) -> Array:
    """Largest difference of a third-octave level over channels and bands, (lane,) dB.

    Parameters
    ----------
    tested, exact : (lane, channel, sample)

    Left out are bands that lie more than 60 dB below the channel's loudest in both: noise covers
    them.
    """
    powers, expected = (
        third_octave_power(signal, sampling_rate) for signal in (tested, exact)
    )
    threshold = 10.0 ** (-HEARD_DB / 10.0) * expected.max(axis=-1, keepdims=True)
    unheard = np.maximum(powers, expected) <= threshold
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = np.abs(10.0 * np.log10(powers / expected))
    return np.asarray(np.where(unheard, 0.0, difference).max(axis=(-1, -2)))


def indicator_difference(tested: Array, exact: Array) -> Array:
    """Largest relative difference of RMS, kurtosis and crest factor over channels, (lane,).

    Parameters
    ----------
    tested, exact : (lane, channel, sample)

    Channels that are zero in both agree.
    """
    values, expected = (
        np.stack([indicator(signal) for indicator in (rms, kurtosis, crest_factor)])
        for signal in (tested, exact)
    )
    still = ~(tested.any(axis=-1) | exact.any(axis=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = np.abs(values / expected - 1.0)
    return np.asarray(np.where(still, 0.0, difference).max(axis=(0, -1)))
