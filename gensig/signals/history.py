"""Indicators of a history: each record of a machine judged by its records up to then.

J. J. Zakrajsek, D. P. Townsend & H. J. Decker (1993), "An analysis of gear fault detection
methods as applied to pitting fatigue failure data", NASA TM-105950 (NA4); J. J. Zakrajsek, R. F.
Handschuh & H. J. Decker (1994), "Application of fault detection techniques to spiral bevel gear
fatigue data", NASA TM-106467 (NB4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import residual_signal
from gensig.signals.envelope import mesh_envelope
from gensig.signals.indicators import ROUNDING, rms


def na4(averages: ArrayLike, n_teeth: int) -> FloatArray:
    """Fourth moment of the residual signal over the squared mean variance of the records up to it.

    Where damage grows, the moment grows with the fourth power of the residual and the mean
    variance follows late. So it goes on rising where FM4, whose own variance rises too, falls
    back to 3 as damage spreads over the teeth.

    Parameters
    ----------
    averages : (..., record, sample)    time-synchronous averages of one turn of the gear, in the
        order of time
    n_teeth : teeth of the gear

    Returns
    -------
    (..., record) dimensionless: 3 for Gaussian noise that stays, and for the first record the
        kurtosis of its residual; NaN where nothing is left without the mesh. Records that are NaN,
        those of too few turns, are passed over.

    Source: NA4 of NASA TM-105950 (1993).
    """
    x = np.asarray(averages, dtype=float)
    return _over_mean_variance(residual_signal(x, n_teeth), rms(x))


def nb4(
    averages: ArrayLike,
    n_teeth: int,
    *,
    harmonic: int = 1,
    n_sidebands: int | None = None,
) -> FloatArray:
    """`na4` of the envelope of one mesh harmonic.

    Teeth that share the load differently modulate the mesh.

    Parameters
    ----------
    averages : (..., record, sample)    time-synchronous averages of one turn of the gear, in the
        order of time
    n_teeth : teeth of the gear
    harmonic, n_sidebands : the band, see `gensig.signals.envelope.mesh_envelope`; the sources take
        the strongest harmonic and the sidebands that lie symmetrically about it

    Returns
    -------
    (..., record) dimensionless; NaN for a mesh that nothing modulates

    Raises
    ------
    ValueError    as `gensig.signals.envelope.mesh_envelope`

    Source: NB4 of NASA TM-106467 (1994).
    """
    x = np.asarray(averages, dtype=float)
    magnitude = mesh_envelope(x, n_teeth, harmonic=harmonic, n_sidebands=n_sidebands)
    return _over_mean_variance(magnitude, rms(x))


def _over_mean_variance(signal: FloatArray, level: FloatArray) -> FloatArray:
    """Fourth central moment of each record over the squared mean variance of the records up to it.

    Parameters
    ----------
    signal : (..., record, sample)
    level : (..., record)    RMS of what the signal was taken from: what is smaller than its
        rounding counts as zero
    """
    squared = np.square(signal - signal.mean(axis=-1, keepdims=True))
    variance = squared.mean(axis=-1)
    known = np.isfinite(variance)
    above = known & (variance > (ROUNDING * level) ** 2)
    total = np.cumsum(np.where(above, variance, 0.0), axis=-1)
    mean_variance = total / np.maximum(np.cumsum(known, axis=-1), 1)
    moment = np.where(above, np.mean(np.square(squared), axis=-1), 0.0)
    indicator = np.full(variance.shape, np.nan)
    defined = known & (mean_variance > 0.0)
    return np.divide(moment, np.square(mean_variance), out=indicator, where=defined)
