"""Envelope of a band and its spectrum: impacts that repeat show as lines at their rate.

McFadden & Smith (1984), "Vibration monitoring of rolling element bearings by the high-frequency resonance technique",
Tribology International 17 (1), 3-10; Randall & Antoni (2011), Mechanical Systems and Signal Processing 25 (2), 485-520.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.signals.spectrum import amplitude_spectrum

FloatArray = NDArray[np.floating]


def band_pass(signal: ArrayLike, sampling_rate: float, band: tuple[float, float], *, order: int = 4) -> FloatArray:
    """Butterworth band-pass run forwards and backwards: no phase shift, twice the order in attenuation.

    Parameters
    ----------
    signal : (..., sample)
    sampling_rate : Hz
    band : (low, high) Hz, inside (0, sampling_rate / 2)

    Raises
    ------
    ValueError    if the band is empty or leaves that range
    """
    from scipy.signal import butter, sosfiltfilt

    low, high = band
    if not 0 < low < high < sampling_rate / 2:
        raise ValueError(f"band {low:g}-{high:g} Hz must lie inside 0-{sampling_rate / 2:g} Hz, low before high")
    sections = butter(order, [low, high], btype="bandpass", fs=sampling_rate, output="sos")
    return sosfiltfilt(sections, np.asarray(signal, dtype=float), axis=-1)


def envelope(signal: ArrayLike, sampling_rate: float, band: tuple[float, float] | None = None) -> FloatArray:
    """Magnitude of the analytic signal, of the band if one is given and otherwise of the signal less its mean.

    Parameters
    ----------
    signal : (..., sample) m/s^2
    sampling_rate : Hz
    band : (low, high) Hz

    Returns
    -------
    (..., sample) m/s^2
    """
    from scipy.signal import hilbert

    x = np.asarray(signal, dtype=float)
    x = x - x.mean(axis=-1, keepdims=True) if band is None else band_pass(x, sampling_rate, band)
    return np.abs(hilbert(x, axis=-1))


def envelope_spectrum(
    signal: ArrayLike, sampling_rate: float, band: tuple[float, float] | None = None, *, window: str = "hann"
) -> tuple[FloatArray, FloatArray]:
    """Amplitude spectrum of the envelope less its mean.

    Parameters
    ----------
    signal : (..., sample) m/s^2
    sampling_rate : Hz
    band : (low, high) Hz
    window : see `gensig.signals.spectrum.amplitude_spectrum`

    Returns
    -------
    frequency : (bin,) Hz
    amplitude : (..., bin) m/s^2
    """
    magnitude = envelope(signal, sampling_rate, band)
    return amplitude_spectrum(magnitude - magnitude.mean(axis=-1, keepdims=True), sampling_rate, window=window)
