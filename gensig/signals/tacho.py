"""Speed and angle domain from a tachometer's pulses: computed order tracking.

K. R. Fyfe & E. D. S. Munck (1997), "Analysis of computed order tracking", Mechanical Systems and
Signal Processing 11 (2), 187-205.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import interpolate, samples_per_turn_for


def pulse_times(tacho: ArrayLike, sampling_rate: float) -> FloatArray:
    """Instants at which pulses begin, (pulse,) s from the first sample.

    Parameters
    ----------
    tacho : (sample,)    low between pulses and high in them; what lies halfway between its
        extremes is the threshold
    sampling_rate : Hz

    Notes
    -----
    What the two samples around an edge have in common with the high level tells where it is:
    exact, but for rounding, where a sample is the mean over its interval, as in a data set's
    ``tacho``, and pulses and gaps last two samples or more. A train of zeros and ones has its
    edges half a sample before the first high one, within half a sample.
    """
    signal = np.asarray(tacho, dtype=float)
    low, high = float(signal.min()), float(signal.max())
    if not high > low:
        return np.empty(0)
    share = (signal - low) / (high - low)
    rising = np.flatnonzero((share[:-1] < 0.5) & (share[1:] >= 0.5)) + 1
    return (rising + 0.5 - share[rising - 1] - share[rising]) / sampling_rate


def speed_of_pulses(
    times: ArrayLike, pulses_per_turn: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Mean speed from each pulse to the next.

    Parameters
    ----------
    times : (pulse,) s

    Returns
    -------
    time : (pulse - 1,) s           halfway between the pulses
    rotation_frequency : (pulse - 1,) Hz
    """
    instants = np.asarray(times, dtype=float)
    middles = 0.5 * (instants[1:] + instants[:-1])
    return middles, 1.0 / (pulses_per_turn * np.diff(instants))


def resample_by_pulses(
    signal: ArrayLike,
    sampling_rate: float,
    times: ArrayLike,
    *,
    pulses_per_turn: int = 1,
    samples_per_turn: int | None = None,
) -> FloatArray:
    """Cut a signal into whole turns, sampled uniformly in shaft angle, at any course of the speed.

    The first turn starts at the first pulse; what comes before it and after the last whole turn
    is left out. Their mean is `gensig.signals.averaging.average_turn`.

    Parameters
    ----------
    signal : (..., sample)
    sampling_rate : Hz
    times : (pulse,) s        instants of the pulses, from the first sample
    samples_per_turn : int    default: `samples_per_turn_for` the slowest turn; fewer alias

    Returns
    -------
    (..., turn, sample)

    Raises
    ------
    ValueError    if the pulses span no whole turn

    Notes
    -----
    Time over angle is the cubic spline through the pulses (not-a-knot: with three pulses the
    parabola of constant acceleration that Fyfe and Munck take). The signal is interpolated as in
    `resample_to_angle`.
    """
    from scipy.interpolate import CubicSpline

    instants = np.asarray(times, dtype=float)
    n_turns = (len(instants) - 1) // pulses_per_turn
    if n_turns < 1:
        raise ValueError(
            f"{len(instants)} pulses at {pulses_per_turn} a turn span no whole turn"
        )
    longest = float(np.max(instants[pulses_per_turn:] - instants[:-pulses_per_turn]))
    per_turn = samples_per_turn or samples_per_turn_for(sampling_rate, 1.0 / longest)
    at = CubicSpline(np.arange(len(instants)) / pulses_per_turn, instants)
    turned = np.arange(n_turns * per_turn).reshape(n_turns, per_turn) / per_turn
    x = np.asarray(signal, dtype=float)
    position = np.clip(at(turned) * sampling_rate, 0.0, x.shape[-1] - 1.0)
    return interpolate(x, position)
