"""Condition indicators: one number for a signal, or for the average turn of a gear. Batched over leading axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.signals.averaging import difference_signal

FloatArray = NDArray[np.floating]


def rms(signal: ArrayLike) -> FloatArray:
    """Root mean square.

    Parameters
    ----------
    signal : (..., sample)

    Returns
    -------
    (...) in the unit of the signal; a mean value counts, so subtract it first if it means nothing
    """
    return np.sqrt(np.mean(np.square(np.asarray(signal, dtype=float)), axis=-1))


def kurtosis(signal: ArrayLike) -> FloatArray:
    """Fourth central moment over squared variance: 3 for Gaussian noise, 1.5 for a sine.

    Parameters
    ----------
    signal : (..., sample)

    Returns
    -------
    (...) dimensionless; NaN for a constant signal

    Source: Dyer & Stewart (1978), J. Mechanical Design 100 (2), 229-235.
    """
    x = np.asarray(signal, dtype=float)
    squared = np.square(x - x.mean(axis=-1, keepdims=True))
    variance = squared.mean(axis=-1)
    return _ratio(np.mean(np.square(squared), axis=-1), variance**2)


def crest_factor(signal: ArrayLike) -> FloatArray:
    """Largest magnitude over root mean square: sqrt(2) for a sine.

    Parameters
    ----------
    signal : (..., sample)

    Returns
    -------
    (...) dimensionless; NaN for a signal that is zero
    """
    x = np.asarray(signal, dtype=float)
    return _ratio(np.max(np.abs(x), axis=-1), rms(x))


def fm4(average: ArrayLike, n_teeth: int) -> FloatArray:
    """Kurtosis of the difference signal: a fault of one or two teeth makes it peak, a healthy gear stays near 3.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear

    Returns
    -------
    (...) dimensionless; NaN where nothing is left without the regular mesh components

    Source: FM4 of R. M. Stewart (1977), ISVR Southampton, MHM/R/10/77, in the form of NASA TM-105950 (1993).
    """
    turn = np.asarray(average, dtype=float)
    difference = difference_signal(turn, n_teeth)
    rounding = 1e-12 * rms(turn)
    return np.where(rms(difference) > rounding, kurtosis(difference), np.nan)


def sideband_ratio(average: ArrayLike, n_teeth: int, *, n_harmonics: int = 3, n_sidebands: int = 6) -> FloatArray:
    """Sum of sideband amplitudes over the sum of mesh-harmonic amplitudes.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear
    n_harmonics : mesh harmonics counted, from the first
    n_sidebands : sidebands counted on either side of each, at multiples of the rotation frequency

    Returns
    -------
    (...) dimensionless; NaN without any mesh harmonic

    Raises
    ------
    ValueError    if the average has too few samples for the first mesh harmonic with its sidebands

    Source: sideband energy ratio of Hanna, Hatch, Kalb, Weiss & Luo (2011), here summed over several harmonics.
    """
    amplitude = np.abs(np.fft.rfft(np.asarray(average, dtype=float), axis=-1))
    reach = min(n_sidebands, (n_teeth - 1) // 2)
    centers = np.arange(1, n_harmonics + 1) * n_teeth
    centers = centers[centers + reach < amplitude.shape[-1]]
    if centers.size == 0:
        raise ValueError(f"{np.shape(average)[-1]} samples a turn cannot hold mesh order {n_teeth} and its sidebands")
    steps = np.arange(1, reach + 1)
    sidebands = (centers[:, None] + np.concatenate([-steps, steps])).ravel()
    return _ratio(amplitude[..., sidebands].sum(axis=-1), amplitude[..., centers].sum(axis=-1))


def _ratio(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Quotient, NaN where the denominator is zero."""
    quotient = np.full(np.shape(numerator), np.nan)
    return np.divide(numerator, denominator, out=quotient, where=np.asarray(denominator) > 0)
