"""Synchronous averaging: angle domain at constant speed, average turn, regular part, residual.

Time-synchronous averaging: S. Braun (1975), Acustica 32, 69-77; P. D. McFadden (1989),
"Interpolation techniques for time domain averaging of gear vibration", Mechanical Systems and
Signal Processing 3 (1), 87-97.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray

# an average of fewer turns holds more than 1/20 of the power of what does not repeat
MIN_TURNS = 20


def samples_per_turn_for(sampling_rate: float, rotation_frequency: float) -> int:
    """Smallest even number of samples a turn that loses no bandwidth.

    Parameters
    ----------
    sampling_rate : Hz
    rotation_frequency : Hz    turns of the shaft per second
    """
    return 2 * math.ceil(sampling_rate / rotation_frequency / 2)


def resample_to_angle(
    signal: ArrayLike,
    sampling_rate: float,
    rotation_frequency: float,
    samples_per_turn: int | None = None,
) -> FloatArray:
    """Cut a signal into whole turns, sampled uniformly in shaft angle.

    The shaft turns at constant speed, known by its mean; the first turn starts at the first
    sample, the remainder of a turn at the end is dropped.

    Parameters
    ----------
    signal : (..., sample)
    sampling_rate : Hz
    rotation_frequency : Hz    turns of the shaft per second
    samples_per_turn : int     default: `samples_per_turn_for`; fewer alias what lies above half of
        them per turn

    Returns
    -------
    (..., turn, sample)

    Raises
    ------
    ValueError    if the signal holds no whole turn

    Notes
    -----
    Cubic B-spline interpolation: M. Unser (1999), "Splines: a perfect fit for signal and image
    processing", IEEE Signal Processing Magazine 16 (6), 22-38. Largest error for a sine: 0.1 % of
    its amplitude at an eighth of the sampling rate, 0.4 % at a sixth, 2.5 % at a quarter.
    """
    x = np.asarray(signal, dtype=float)
    n_samples = x.shape[-1]
    samples_in_a_turn = sampling_rate / rotation_frequency
    n_turns = math.floor((n_samples + 1e-6) / samples_in_a_turn)
    if n_turns < 1:
        raise ValueError(
            f"{n_samples} samples hold no whole turn of {samples_in_a_turn:.1f} samples"
        )
    default = samples_per_turn_for(sampling_rate, rotation_frequency)
    per_turn = samples_per_turn or default
    position = np.arange(n_turns * per_turn) * (samples_in_a_turn / per_turn)
    return interpolate(x, position.reshape(n_turns, per_turn))


def interpolate(x: FloatArray, position: FloatArray) -> FloatArray:
    """Values of a signal, (..., sample), between its samples, by the cubic B-spline of
    `resample_to_angle`.

    Parameters
    ----------
    position : (turn, point)    in samples from the first; at most the last sample or just behind it

    Returns
    -------
    (..., turn, point)
    """
    from scipy.ndimage import spline_filter1d

    index = np.minimum(position.astype(np.intp), x.shape[-1] - 1)
    u = position - index
    coefficients = spline_filter1d(x, order=3, axis=-1, mode="mirror")
    ends = [coefficients[..., -2:-1], coefficients[..., -3:-2]]
    padded = np.concatenate([coefficients[..., 1:2], coefficients, *ends], axis=-1)
    squared = u * u
    cubed = squared * u
    rest = 1 - u
    weights = (
        rest * rest * rest / 6,
        (3 * cubed - 6 * squared + 4) / 6,
        (3 * (u + squared - cubed) + 1) / 6,
        cubed / 6,
    )
    angle_signal = weights[0] * padded.take(index, axis=-1)
    for offset in (1, 2, 3):
        angle_signal += weights[offset] * padded.take(index + offset, axis=-1)
    return angle_signal


def time_synchronous_average(
    signal: ArrayLike,
    sampling_rate: float,
    rotation_frequency: float,
    samples_per_turn: int | None = None,
    *,
    min_turns: int = 1,
) -> FloatArray:
    """Average turn of a shaft at constant speed.

    `resample_to_angle`, then `average_turn` with its ``min_turns``.
    """
    turns = resample_to_angle(
        signal, sampling_rate, rotation_frequency, samples_per_turn
    )
    return average_turn(turns, min_turns=min_turns)


def average_turn(turns: ArrayLike, *, min_turns: int = MIN_TURNS) -> FloatArray:
    """Mean turn of a shaft.

    What repeats every turn stays; the rest falls with the square root of the turns.

    Parameters
    ----------
    turns : (..., turn, sample)    at any course of the speed: from `resample_to_angle`,
                                   `gensig.signals.rotation.resample_by_angle` or
                                   `gensig.signals.tacho.resample_by_pulses`
    min_turns : with fewer the average is NaN, and with it every indicator that needs one

    Returns
    -------
    (..., sample)    one turn; order k of the shaft is bin k of its discrete Fourier transform
    """
    x = np.asarray(turns, dtype=float)
    if x.shape[-2] < min_turns:
        return np.full((*x.shape[:-2], x.shape[-1]), np.nan)
    return x.mean(axis=-2)


def remove_orders(average: ArrayLike, orders: Iterable[int]) -> FloatArray:
    """Average turn without the given shaft orders.

    Parameters
    ----------
    average : (..., sample)    one turn
    orders : whole multiples of the rotation frequency; those above half the samples of a turn are
        ignored
    """
    turn = np.asarray(average, dtype=float)
    spectrum = np.fft.rfft(turn, axis=-1)
    removed = [order for order in orders if 0 <= order < spectrum.shape[-1]]
    spectrum[..., removed] = 0
    return np.fft.irfft(spectrum, n=turn.shape[-1], axis=-1)


def regular_signal(
    average: ArrayLike, n_teeth: int, *, n_sidebands: int = 1
) -> FloatArray:
    """Regular mesh of a healthy gear: every mesh harmonic with the lowest sidebands.

    The lowest shaft orders are left out.

    Parameters
    ----------
    average : (..., sample)    one turn of the gear
    n_teeth : teeth of the gear
    n_sidebands : kept on either side of every mesh harmonic; 0 for the mesh alone

    Notes
    -----
    With 1 it is what `difference_signal` takes away, less the mean and the shaft orders: for the
    energy ratio those of unbalance and misalignment are no sign of the mesh.

    Source: regular mesh components of M. Lebold, K. McClintic, R. Campbell, C. Byington & K.
    Maynard (2000), "Review of vibration analysis methods for gearbox diagnostics and
    prognostics", Proc. 54th MFPT Meeting, 623-634.
    """
    kept = _mesh_orders(average, n_teeth, n_sidebands)
    return remove_orders(average, set(range(np.shape(average)[-1] // 2 + 1)) - kept)


def residual_signal(
    average: ArrayLike, n_teeth: int, *, n_shaft_orders: int = 2
) -> FloatArray:
    """Average turn without the mean, the lowest shaft orders and every mesh harmonic.

    Parameters
    ----------
    average : (..., sample)    one turn of the gear
    n_teeth : teeth of the gear
    n_shaft_orders : shaft orders removed from 1 up: imbalance and misalignment

    Source: residual signal of Zakrajsek, Townsend & Decker (1993), NASA TM-105950, sidebands kept.
    """
    return _without_mesh(average, n_teeth, 0, n_shaft_orders)


def difference_signal(
    average: ArrayLike, n_teeth: int, *, n_shaft_orders: int = 2
) -> FloatArray:
    """Residual signal without the first sideband on either side of every mesh harmonic too.

    Parameters as `residual_signal`.

    Source: difference signal of Zakrajsek, Townsend & Decker (1993), NASA TM-105950, after R. M.
    Stewart (1977).
    """
    return _without_mesh(average, n_teeth, 1, n_shaft_orders)


def _without_mesh(
    average: ArrayLike, n_teeth: int, n_sidebands: int, n_shaft_orders: int
) -> FloatArray:
    mesh = _mesh_orders(average, n_teeth, n_sidebands)
    return remove_orders(average, mesh.union(range(n_shaft_orders + 1)))


def _mesh_orders(average: ArrayLike, n_teeth: int, n_sidebands: int) -> set[int]:
    """Orders of the mesh harmonics and their sidebands within half the samples of a turn."""
    top = np.shape(average)[-1] // 2
    mesh = range(n_teeth, top + n_sidebands + 1, n_teeth)
    return {order + k for order in mesh for k in range(-n_sidebands, n_sidebands + 1)}
