"""Statistics over the cycles of the crank of a motion that does not repeat.

A drive that rattles is chaotic: its extremes over a run grow with the run and depend on the last
bit. Medians over the cycles and amplitudes at the half orders are right to a few per cent after
some cycles.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gensig.arrays import Array
from gensig.driveline.excitation.cycle import CYCLE
from gensig.errors import ConfigError


def whole_cycles(crank_angle: Array) -> list[slice]:
    """Samples of each whole cycle of the crank, from the first sample on.

    Parameters
    ----------
    crank_angle : (sample,) rad, increasing

    Raises
    ------
    ConfigError    where there is not one
    """
    since = crank_angle - crank_angle[0]
    n_cycles = int(since[-1] / CYCLE)
    if n_cycles < 1:
        raise ConfigError(
            f"the crank turns by {since[-1]:.3g} rad, less than a cycle of two turns; "
            "simulate longer"
        )
    edges = np.searchsorted(since, CYCLE * np.arange(n_cycles + 1))
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def fluctuations(signals: Array, crank_angle: Array) -> Array:
    """Half the peak to peak of signals (signal, sample) in each whole cycle, (signal, cycle)."""
    cycles = whole_cycles(crank_angle)
    return 0.5 * np.array([np.ptp(signals[:, cycle], axis=1) for cycle in cycles]).T


def typical_extremes(signals: Array, crank_angle: Array) -> tuple[Array, Array]:
    """Medians over the cycles of the least and of the greatest value in a cycle, (signal,) each."""
    parts = [signals[:, cycle] for cycle in whole_cycles(crank_angle)]
    least = np.median([part.min(axis=1) for part in parts], axis=0)
    greatest = np.median([part.max(axis=1) for part in parts], axis=0)
    return least, greatest


def without_trend(signals: Array, x: Array) -> Array:
    """Signals (signal, sample) less the straight line through each over ``x`` (sample,)."""
    base = np.vander(x, 2)
    return signals - (base @ np.linalg.lstsq(base, signals.T, rcond=None)[0]).T


def order_amplitudes(signals: Array, crank_angle: Array, n_orders: int) -> Array:
    """Amplitudes of signals (signal, sample) at the orders 0.5, 1, ... over their whole cycles,
    (signal, order).

    Straight trends are taken off first. Fourier's integral over the crank's angle, so that the
    speed may change.
    """
    used = slice(0, whole_cycles(crank_angle)[-1].stop)
    angle = crank_angle[used] - crank_angle[0]
    weight = np.gradient(angle)
    rest = without_trend(signals[:, used], angle)
    orders = 0.5 * np.arange(1, n_orders + 1)
    # an order at a time: all of them for a minute of samples would fill the memory
    result = [np.abs((rest * weight) @ np.exp(-1j * order * angle)) for order in orders]
    return 2.0 / weight.sum() * np.array(result).T
