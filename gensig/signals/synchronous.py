"""Parts of a signal by a shaft's turns: mesh harmonics, residual, share that does not repeat."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import remove_orders


def mesh_harmonics(
    average: ArrayLike, n_teeth: int, n_harmonics: int = 3
) -> FloatArray:
    """Amplitudes of the harmonics of the mesh in an average turn.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear
    n_harmonics : how many, from the first

    Returns
    -------
    (..., harmonic) in the unit of the signal; NaN for those at or above half the samples of a turn
    """
    turn = np.asarray(average, dtype=float)
    amplitude = np.abs(np.fft.rfft(turn, axis=-1)) * (2.0 / turn.shape[-1])
    orders = np.arange(1, n_harmonics + 1) * n_teeth
    held = orders < turn.shape[-1] / 2
    return np.where(held, amplitude[..., np.where(held, orders, 0)], np.nan)


def nonsynchronous_share(turns: ArrayLike) -> FloatArray:
    """Share of the power, less the mean, that does not repeat from turn to turn.

    Parameters
    ----------
    turns : (..., turn, sample)    as from `resample_by_angle` or `resample_to_angle`, two turns or
        more

    Returns
    -------
    (...) from 0, the same turn again and again, to 1 on the average for noise; NaN for a constant
    signal

    Raises
    ------
    ValueError    for a single turn, which does not show what repeats

    Notes
    -----
    With synchronous power S and other power N, an average of T turns holds S + N / T, the turns S
    + N: solved for N, so that few turns do not make noise look synchronous. What turns with
    another shaft alone counts as not repeating.
    """
    x = np.asarray(turns, dtype=float)
    n_turns = x.shape[-2]
    if n_turns < 2:
        raise ValueError("one turn does not tell what repeats; give two or more")
    x = x - x.mean(axis=(-2, -1), keepdims=True)
    whole = np.mean(np.square(x), axis=(-2, -1))
    averaged = np.mean(np.square(x.mean(axis=-2)), axis=-1)
    other = (whole - averaged) * n_turns / (n_turns - 1)
    share = np.full(np.shape(whole), np.nan)
    return np.divide(other, whole, out=share, where=whole > 0.0)


def residual_turns(
    turns: ArrayLike, n_teeth: int, *, n_shaft_orders: int = 2
) -> FloatArray:
    """Turns without the mean, the lowest shaft orders and every mesh harmonic.

    What does not repeat stays.

    Parameters
    ----------
    turns : (..., turn, sample)
    n_teeth : teeth of the gear
    n_shaft_orders : shaft orders removed from 1 up: unbalance and misalignment

    Returns
    -------
    (..., turn, sample)

    Notes
    -----
    The residual signal of NASA TM-105950 (1993) taken from all turns instead of their average.
    """
    x = np.asarray(turns, dtype=float)
    n_turns, per_turn = x.shape[-2:]
    orders = {*range(n_shaft_orders + 1), *range(n_teeth, per_turn // 2 + 1, n_teeth)}
    flat = x.reshape(*x.shape[:-2], -1)
    residual = remove_orders(flat, [n_turns * order for order in orders])
    return residual.reshape(x.shape)
