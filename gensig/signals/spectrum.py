"""Amplitude spectra over frequency and over shaft order."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import resample_to_angle


def amplitude_spectrum(
    signal: ArrayLike, sampling_rate: float, *, window: str = "hann"
) -> tuple[FloatArray, FloatArray]:
    """Single-sided amplitude spectrum: a sine of amplitude A on a bin gives A.

    Parameters
    ----------
    signal : (..., sample) m/s^2, or any unit
    sampling_rate : Hz
    window : name known to `scipy.signal.get_window`; ``"boxcar"`` for whole periods

    Returns
    -------
    frequency : (bin,) Hz
    amplitude : (..., bin) in the unit of the signal

    Source: Heinzel, Ruediger & Schilling (2002), "Spectrum and spectral density estimation by the
    DFT", eqs. 19 and 24.
    """
    from scipy.signal import get_window

    x = np.asarray(signal, dtype=float)
    n_samples = x.shape[-1]
    weights = get_window(window, n_samples)
    amplitude = np.abs(np.fft.rfft(x * weights, axis=-1)) * (2.0 / weights.sum())
    amplitude[..., 0] /= 2
    if n_samples % 2 == 0:
        amplitude[..., -1] /= 2
    return np.fft.rfftfreq(n_samples, 1.0 / sampling_rate), amplitude


def order_spectrum(
    signal: ArrayLike,
    sampling_rate: float,
    rotation_frequency: float,
    *,
    samples_per_turn: int | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Amplitude spectrum over the orders of a shaft, over the whole turns that the signal holds.

    Parameters
    ----------
    signal : (..., sample) m/s^2
    sampling_rate : Hz
    rotation_frequency : Hz    turns of the shaft per second, constant
    samples_per_turn : see `gensig.signals.averaging.resample_to_angle`

    Returns
    -------
    order, amplitude : as `spectrum_of_turns`

    Raises
    ------
    ValueError    if the signal holds no whole turn
    """
    turns = resample_to_angle(
        signal, sampling_rate, rotation_frequency, samples_per_turn
    )
    return spectrum_of_turns(turns)


def spectrum_of_turns(turns: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Amplitude spectrum over the orders of a shaft, of turns cut at any course of the speed.

    Parameters
    ----------
    turns : (..., turn, sample) m/s^2    by constant speed, by angle or by pulses, see
                                         `gensig.signals.averaging.average_turn`

    Returns
    -------
    order : (bin,) multiples of the rotation frequency, in steps of one over the number of turns
    amplitude : (..., bin) m/s^2, no window: whole orders fall on bins
    """
    x = np.asarray(turns, dtype=float)
    flat = x.reshape(*x.shape[:-2], -1)
    return amplitude_spectrum(flat, x.shape[-1], window="boxcar")
