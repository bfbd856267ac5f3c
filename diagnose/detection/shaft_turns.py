"""Parts of a signal that repeat with each shaft of a gear train, none holding another's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.signals.averaging import resample_to_angle

FloatArray = NDArray[np.floating]

SWEEPS = 2  # over all shafts; a third changes less than the noise of a few turns


@dataclass(frozen=True, slots=True, kw_only=True)
class ShaftTurns:
    """One turn of every shaft, and the rest of the signal.

    Attributes
    ----------
    turns : for each shaft (channel, sample), begun where the recording begins
    rest : (channel, sample) that repeats with no shaft
    """

    turns: tuple[FloatArray, ...]
    rest: FloatArray


def separate_shafts(
    signal: FloatArray,
    samples_per_turn: int,
    shaft_orders: tuple[float, ...],
    *,
    start: int,
    n_orders: tuple[int, ...],
) -> ShaftTurns:
    """Take a signal over the angle of the input shaft apart by its shafts.

    Parameters
    ----------
    signal : (channel, sample), evenly sampled in angle; a whole turn of every shaft at least
    samples_per_turn : of the input shaft
    shaft_orders : turns of every shaft in one turn of the input
    start : samples of the recording before the signal
    n_orders : orders of every shaft that its turn keeps; the turn has twice as many samples

    Raises
    ------
    ValueError    if the signal holds no whole turn of a shaft

    Notes
    -----
    Synchronous averages of what the other shafts leave, shaft by shaft, in `SWEEPS`: backfitting
    of an additive model, Buja, Hastie & Tibshirani (1989), The Annals of Statistics 17 (2),
    453-510. Orders that two shafts share stay with the first of them.
    """
    x = signal - signal.mean(axis=-1, keepdims=True)
    parts: list[FloatArray] = [np.zeros_like(x) for _ in shaft_orders]
    averages: list[FloatArray] = [np.empty(0) for _ in shaft_orders]
    for _ in range(SWEEPS):
        for shaft, order in enumerate(shaft_orders):
            others = sum(parts) - parts[shaft]
            turn = resample_to_angle(x - others, samples_per_turn, order).mean(axis=-2)
            averages[shaft] = turn - turn.mean(axis=-1, keepdims=True)
            parts[shaft] = _repeated(
                averages[shaft], order / samples_per_turn, x.shape[-1]
            )
    turns = tuple(
        _begun_earlier(average, start * order / samples_per_turn, kept)
        for average, order, kept in zip(averages, shaft_orders, n_orders, strict=True)
    )
    return ShaftTurns(turns=turns, rest=x - sum(parts))


def _repeated(turn: FloatArray, turns_a_sample: float, n_samples: int) -> FloatArray:
    """(channel, sample) of a turn repeated at so many turns a sample."""
    from scipy.ndimage import map_coordinates

    per_turn = turn.shape[-1]
    at = (np.arange(n_samples) * turns_a_sample % 1.0) * per_turn
    rows = [map_coordinates(row, at[None], order=3, mode="grid-wrap") for row in turn]
    return np.stack(rows)


def _begun_earlier(turn: FloatArray, turns: float, n_orders: int) -> FloatArray:
    """A turn as it is seen from so many turns earlier, by its lowest orders."""
    spectrum = np.fft.rfft(turn, axis=-1)
    kept = np.zeros((turn.shape[0], n_orders + 1), dtype=complex)
    n_known = min(n_orders, spectrum.shape[-1])
    orders = np.arange(n_known)
    kept[:, :n_known] = spectrum[:, :n_known] * np.exp(-2j * np.pi * orders * turns)
    return np.fft.irfft(kept, n=2 * n_orders, axis=-1) * (2 * n_orders / turn.shape[-1])
