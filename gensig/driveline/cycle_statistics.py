"""What a motion that does not repeat has in common from cycle to cycle of the crank.

A drive that rattles is chaotic: its extremes over a run grow with the run and hang on the last
bit. What is told of it are medians over the cycles and amplitudes at the half orders, which a run
of some cycles gives to a few per cent.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.excitation.cycle import CYCLE
from gensig.errors import ConfigError

Array = NDArray[np.float64]


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
            f"the crank turns by {since[-1]:.3g} rad, less than a cycle of two turns; simulate longer"
        )
    edges = np.searchsorted(since, CYCLE * np.arange(n_cycles + 1))
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def fluctuations(signals: Array, crank_angle: Array) -> Array:
    """Half the peak to peak of each signal in each whole cycle, (signal, cycle), of signals
    (signal, sample).
    """
    return (
        0.5
        * np.array(
            [np.ptp(signals[:, cycle], axis=1) for cycle in whole_cycles(crank_angle)]
        ).T
    )


def typical_extremes(signals: Array, crank_angle: Array) -> tuple[Array, Array]:
    """Medians over the cycles of the least and of the greatest value in a cycle, (signal,) each."""
    found = np.array(
        [
            (signals[:, at].min(axis=1), signals[:, at].max(axis=1))
            for at in whole_cycles(crank_angle)
        ]
    )
    least, greatest = np.median(found, axis=0)
    return least, greatest


def order_amplitudes(signals: Array, crank_angle: Array, n_orders: int) -> Array:
    """Amplitudes of signals (signal, sample) at the orders 0.5, 1, ... over their whole cycles,
    (signal, order).

    Straight trends are taken off first. Fourier's integral over the crank's angle, so that the
    speed may change.
    """
    cycles = whole_cycles(crank_angle)
    used = slice(0, cycles[-1].stop)
    angle = crank_angle[used] - crank_angle[0]
    weight = np.gradient(angle)
    base = np.vander(angle, 2)
    rest = (
        signals[:, used]
        - (base @ np.linalg.lstsq(base, signals[:, used].T, rcond=None)[0]).T
    )
    orders = 0.5 * np.arange(1, n_orders + 1)
    # an order at a time: all of them for a minute of samples would fill the memory
    found = [np.abs((rest * weight) @ np.exp(-1j * order * angle)) for order in orders]
    return 2.0 / weight.sum() * np.array(found).T
