"""Vibration level at each tooth of a gear, and its change against an earlier record."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import resample_to_angle
from gensig.signals.envelope import band_pass

# standard deviation of a normal variable over the median of its magnitude
NORMAL = 1.4826
FLOOR = 1e-30  # of a mean square, below which a passage is silent


def tooth_levels(
    signal: ArrayLike,
    sampling_rate: float,
    rotation_frequency: float,
    n_teeth: int,
    *,
    band: tuple[float, float],
    start: float = 0.0,
) -> FloatArray:
    """Level of a band while each tooth of a gear passes, (..., tooth) dB.

    It is the mean of the decibels over the whole turns of the signal.

    Parameters
    ----------
    signal : (..., sample)    at constant speed
    sampling_rate : Hz
    rotation_frequency : Hz   turns of the gear per second
    n_teeth : of the gear
    band : (low, high) Hz
    start : teeth that have come into mesh at the first sample, counted from tooth 0; a phase mark
        on the shaft tells it

    Returns
    -------
    (..., tooth) dB of the mean square, tooth 0 first

    Raises
    ------
    ValueError    for less than a turn from the first tooth that passes whole, or a band that is
        none

    Notes
    -----
    Decibels before the mean: impacts of rattling teeth scatter by factors, and one of them would
    outweigh all turns.
    """
    x = band_pass(signal, sampling_rate, band)
    first = math.ceil(start - 1e-9)
    per_tooth = sampling_rate / rotation_frequency / n_teeth
    skipped = (first - start) * per_tooth
    samples = max(math.ceil(per_tooth), 2)
    whole = x[..., round(skipped) :]
    turns = resample_to_angle(
        whole, sampling_rate, rotation_frequency, samples * n_teeth
    )
    passages = turns.reshape(*turns.shape[:-1], n_teeth, samples)
    power = np.mean(np.square(passages), axis=-1)
    levels = np.mean(10.0 * np.log10(np.maximum(power, FLOOR)), axis=-2)
    return np.roll(levels, first % n_teeth, axis=-1)


def changed_teeth(levels: ArrayLike, reference: ArrayLike) -> FloatArray:
    """Change of each tooth against a reference, in standard deviations of the changes of all teeth.

    Parameters
    ----------
    levels, reference : (..., tooth) dB    of `tooth_levels`, the same band, gear and operating
        point

    Returns
    -------
    (..., tooth)    less the median of the teeth, over their robust standard deviation; 0 where
        nothing changed
    """
    change = np.asarray(levels, dtype=float) - np.asarray(reference, dtype=float)
    change = change - np.median(change, axis=-1, keepdims=True)
    spread = NORMAL * np.median(np.abs(change), axis=-1, keepdims=True)
    return np.divide(change, spread, out=np.zeros_like(change), where=spread > 0)
