"""Spectral kurtosis: it is high in bands with bursts.

J. Antoni (2006), "The spectral kurtosis: a useful tool for characterising non-stationary
signals", Mechanical Systems and Signal Processing 20 (2), 282-307.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray

MAIN_LOBE = 2  # lines from the middle of a Hann window's main lobe to its first zero


def spectral_kurtosis(
    signal: ArrayLike, sampling_rate: float, window_samples: int
) -> tuple[FloatArray, FloatArray]:
    """Kurtosis over time of the short-time spectrum, by frequency.

    It is 0 for noise, -1 for a tone, and more for bursts.

    Parameters
    ----------
    signal : (..., sample) m/s^2
    sampling_rate : Hz
    window_samples : of the Hann window, moved by a quarter of it; shorter than the time between
        impacts, longer than their ringing

    Returns
    -------
    frequency : (bin,) Hz           those nearer than two lines to 0 or to half the sampling rate,
        where a real signal meets its mirror image, are left out
    kurtosis : (..., bin) dimensionless; NaN for silence

    Raises
    ------
    ValueError    if the window is shorter than eight samples or the signal shorter than two windows

    Notes
    -----
    Antoni's estimator, mean fourth power over squared mean square, less 2. In Gaussian noise, with
    n windows side by side in the signal, it scatters by 1.2 / sqrt(n) and lies 1 / n to 2 / n
    below 0 (measured). A mesh that is there all the time pulls a line towards -1, so take residual
    turns to find bursts below it.
    """
    # all windows at once; ShortTimeFFT, one by one, takes up to seven times as long
    from scipy.signal import stft

    x = np.asarray(signal, dtype=float)
    if window_samples < 8 or x.shape[-1] < 2 * window_samples:
        raise ValueError(
            f"a window of {window_samples} samples does not suit {x.shape[-1]}: take at least 8, "
            "at most half of them"
        )
    frequency, _, lines = stft(
        x,
        sampling_rate,
        window="hann",
        nperseg=window_samples,
        noverlap=window_samples - window_samples // 4,
        boundary=None,
        padded=False,
    )
    inner = slice(MAIN_LOBE, window_samples // 2 - MAIN_LOBE + 1)
    power = np.square(np.abs(lines[..., inner, :]))
    squared_mean = np.square(power.mean(axis=-1))
    moment = np.mean(np.square(power), axis=-1)
    ratio = np.full(squared_mean.shape, np.nan)
    np.divide(moment, squared_mean, out=ratio, where=squared_mean > 0.0)
    return frequency[inner], ratio - 2.0
