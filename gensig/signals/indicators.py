"""Condition indicators: one number for a signal, or for the average turn of a gear.

Batched over leading axes. Limits of each: ``docs/theory/indicators.md``. Indicators of an average
are NaN where it is NaN: of too few turns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import difference_signal, regular_signal
from gensig.signals.synchronous import mesh_harmonics

# of the average's RMS: what is left of a transform forth and back where nothing is
ROUNDING = 1e-12


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
    return _standardised_moment(signal, 2)


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


def fm0(
    average: ArrayLike, n_teeth: int, *, n_harmonics: int | None = None
) -> FloatArray:
    """Peak to peak of the average turn over the sum of the mesh's amplitudes.

    It is 2 for a mesh that is one sine.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear
    n_harmonics : mesh harmonics counted, from the first; default: all below half the samples of a
        turn

    Returns
    -------
    (...) dimensionless; NaN without any mesh harmonic

    Raises
    ------
    ValueError    if the average has too few samples for the first mesh harmonic

    Source: R. M. Stewart (1977), "Some useful data analysis techniques for gearbox diagnostics",
    ISVR Southampton, MHM/R/10/77.
    """
    turn = np.asarray(average, dtype=float)
    n_held = (turn.shape[-1] - 1) // 2 // n_teeth
    if n_held < 1:
        raise ValueError(
            f"{turn.shape[-1]} samples a turn cannot hold mesh order {n_teeth}"
        )
    amplitudes = mesh_harmonics(turn, n_teeth, min(n_harmonics or n_held, n_held))
    return _ratio(np.ptp(turn, axis=-1), _above_rounding(amplitudes.sum(axis=-1), turn))


def fm4(average: ArrayLike, n_teeth: int) -> FloatArray:
    """Kurtosis of the difference signal, which a fault of one or two teeth raises.

    It is 3 for Gaussian noise.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear

    Returns
    -------
    (...) dimensionless; NaN where nothing is left without the regular mesh components

    Source: FM4 of R. M. Stewart (1977), ISVR Southampton, MHM/R/10/77, in the form of NASA
    TM-105950 (1993).
    """
    return _standardised_moment(_difference(average, n_teeth), 2)


def m6a(average: ArrayLike, n_teeth: int) -> FloatArray:
    """Sixth moment of the difference signal over its cubed variance.

    It is 15 for noise. Peaks count more than in `fm4`.

    Parameters, returns : as `fm4`

    Source: H. R. Martin (1989), "Statistical moment analysis as a means of surface damage
    detection", Proc. 7th International Modal Analysis Conference, 1016-1021.
    """
    return _standardised_moment(_difference(average, n_teeth), 3)


def m8a(average: ArrayLike, n_teeth: int) -> FloatArray:
    """Eighth moment of the difference signal over the fourth power of its variance.

    It is 105 for Gaussian noise.

    Parameters, returns, source : as `m6a`
    """
    return _standardised_moment(_difference(average, n_teeth), 4)


def energy_ratio(average: ArrayLike, n_teeth: int) -> FloatArray:
    """RMS of the difference signal over that of the regular mesh with its first sidebands.

    Wear of all teeth raises it.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear

    Returns
    -------
    (...) dimensionless; NaN without any mesh

    Source: N. S. Swansson (1980), Conf. on Lubrication, Friction and Wear in Engineering,
    Institution of Engineers Australia, 262-267, in the form of Lebold et al. (2000), see
    `gensig.signals.averaging.regular_signal`.
    """
    turn = np.asarray(average, dtype=float)
    mesh = _above_rounding(rms(regular_signal(turn, n_teeth)), turn)
    return _ratio(rms(_difference(turn, n_teeth)), mesh)


def _above_rounding(level: FloatArray, turn: FloatArray) -> FloatArray:
    """Level of a part of a turn, exactly zero where only rounding is left."""
    return np.where(level > ROUNDING * rms(turn), level, 0.0)


def sideband_ratio(
    average: ArrayLike, n_teeth: int, *, n_harmonics: int = 3, n_sidebands: int = 6
) -> FloatArray:
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

    Source: sideband energy ratio of Hanna, Hatch, Kalb, Weiss & Luo (2011), here summed over
    several harmonics.
    """
    amplitude = np.abs(np.fft.rfft(np.asarray(average, dtype=float), axis=-1))
    reach = min(n_sidebands, (n_teeth - 1) // 2)
    centers = np.arange(1, n_harmonics + 1) * n_teeth
    centers = centers[centers + reach < amplitude.shape[-1]]
    if centers.size == 0:
        raise ValueError(
            f"{np.shape(average)[-1]} samples a turn cannot hold mesh order {n_teeth} and its "
            "sidebands"
        )
    steps = np.arange(1, reach + 1)
    sidebands = (centers[:, None] + np.concatenate([-steps, steps])).ravel()
    return _ratio(
        amplitude[..., sidebands].sum(axis=-1), amplitude[..., centers].sum(axis=-1)
    )


def _difference(average: ArrayLike, n_teeth: int) -> FloatArray:
    """Difference signal, exactly zero where only rounding is left."""
    turn = np.asarray(average, dtype=float)
    difference = difference_signal(turn, n_teeth)
    is_more = rms(difference) > ROUNDING * rms(turn)
    return np.where(is_more[..., None], difference, 0.0)


def _standardised_moment(signal: ArrayLike, half_order: int) -> FloatArray:
    """Central moment of twice the half order over that power of the standard deviation.

    NaN for a constant signal.
    """
    x = np.asarray(signal, dtype=float)
    squared = np.square(x - x.mean(axis=-1, keepdims=True))
    moment = np.mean(squared**half_order, axis=-1)
    return _ratio(moment, squared.mean(axis=-1) ** half_order)


def _ratio(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Quotient, NaN where the denominator is zero."""
    quotient = np.full(np.shape(numerator), np.nan)
    defined = np.asarray(denominator) > 0
    return np.divide(numerator, denominator, out=quotient, where=defined)
