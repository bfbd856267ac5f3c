"""Time signals as int16 counts with one scale a record and channel.

Half the bytes, an error far below the noise.
"""

import h5py
import numpy as np

from gensig.dataset.schema import SCALES

COUNTS = 32767  # of the largest value of a channel; both signs have the same range


def quantized(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Counts and the value of one count; `counts * scale` is the signal to half a count.

    Parameters
    ----------
    signal : (channel, sample)

    Returns
    -------
    counts : (channel, sample) int16    -32767 to 32767, which the largest value of each channel has
    scale : (channel,) float64          unit of the signal; 1 for a channel of zeros, NaN (and
        counts of 0) for one that is not finite throughout

    The error is at most half a count: 1 / 65534 of the channel's peak, 96.3 dB below it.
    """
    counts = np.zeros(signal.shape, "<i2")
    scale = np.ones(len(signal))
    for channel, values in enumerate(signal):
        peak = float(max(values.max(), -values.min()))
        if not np.isfinite(peak):
            scale[channel] = np.nan
        elif peak > 0.0:
            scale[channel] = peak / COUNTS
            exact = np.divide(values, scale[channel], dtype=np.float64)
            counts[channel] = np.rint(exact, out=exact)
    return counts, scale


def is_scale(scale: np.ndarray) -> np.ndarray:
    """True where a number can be the value of one count: positive and finite."""
    return (scale > 0.0) & (scale < np.inf)


def read_signal(
    file: h5py.File, name: str, row: int, start: int = 0, stop: int | None = None
) -> np.ndarray:
    """One record's time signal from a checked shard, in its unit however it is stored.

    Parameters
    ----------
    file : h5py.File      as `guard.open_shard` gives it
    name : str            a key of `SCALES`
    row : int
    start, stop : int     samples, stop exclusive; None is the end

    Returns
    -------
    (channel, sample) float32    m/s^2

    Raises
    ------
    ValueError    for a scale that is neither positive and finite nor NaN, besides what h5py raises
    """
    stored = file[name][row, :, start:stop]
    if stored.dtype.kind == "f":
        return stored.astype(np.float32, copy=False)
    scale = np.asarray(file[SCALES[name]][row])
    wrong = ~(is_scale(scale) | np.isnan(scale))
    if wrong.any():
        raise ValueError(
            f"{SCALES[name]} of row {row} is {scale[wrong][0]}; a scale is positive and finite"
        )
    # A forged scale may overflow; infinite values are found where signals are checked.
    with np.errstate(over="ignore"):
        return np.multiply(stored, scale[:, None], dtype=np.float64).astype(np.float32)
