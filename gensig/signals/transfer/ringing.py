"""Turns of recordings of one machine without the ringing of its housing.

A housing rings at frequencies of its own whatever the speed is, so that two recordings at two
speeds have its resonances at other orders. All recordings of a machine together show them: what
repeats at the same frequency is the housing's, what repeats at the same order is the gears'. One
all-pole filter is fitted to the lines of all turns by frequency, and its inverse, a short
convolution, takes the ringing away; what is left of the path is smooth.

Source: linear prediction by the autocorrelation method, J. Makhoul (1975), "Linear prediction: a
tutorial review", Proceedings of the IEEE 63 (4), 561-580; as pre-whitening of gear signals in
R. B. Randall, N. Sawalhi & M. Coats (2011), "A comparison of methods for separation of
deterministic and random signals", International Journal of Condition Monitoring 1 (1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, FloatArray
from gensig.signals.separation import GearTurns

MEMORY = 1.2e-3  # s of the inverse filter; assumed, 61 samples at 51.2 kHz
RIDGE = 1e-3  # of the mean power, as white noise that is added to the lines; assumed
TINY = 1e-300


def without_ringing(
    turns: Sequence[GearTurns],
    mesh_frequencies: Sequence[float],
    sampling_rate: float,
) -> list[GearTurns]:
    """Turns of recordings of one machine, through the inverse of what rings in all of them.

    Parameters
    ----------
    turns : (channel, sample) of `gensig.signals.separation.separate_gears`, one a recording
    mesh_frequencies : Hz of each recording
    sampling_rate : Hz of the recordings; lines above half of it are taken away

    Raises
    ------
    ValueError    without a recording

    Notes
    -----
    Lines at orders of the mesh, which are stronger than their neighbors, do not count in the fit.
    Each channel of each recording counts by its shape alone.
    """
    if not turns:
        raise ValueError("give at least one recording")
    n_lags = round(MEMORY * sampling_rate)
    lags = np.zeros(n_lags + 1)
    for each, frequency in zip(turns, mesh_frequencies, strict=True):
        lags += _autocorrelation(each, frequency, sampling_rate, n_lags)
    inverse = _prediction_error(lags)
    return [
        _filtered(each, frequency, sampling_rate, inverse)
        for each, frequency in zip(turns, mesh_frequencies, strict=True)
    ]


def _autocorrelation(
    turns: GearTurns, mesh_frequency: float, sampling_rate: float, n_lags: int
) -> FloatArray:
    """(lag,) of the lines of both turns, of mean power 1 a channel."""
    n_samples = turns.mesh.shape[-1]
    power = np.var(turns.driving, axis=-1) + np.var(turns.driven, axis=-1)
    total = np.zeros(n_lags + 1)
    for turn in (turns.driving, turns.driven):
        n_teeth = turn.shape[-1] // n_samples
        lines = np.square(np.abs(np.fft.rfft(turn))) / turn.shape[-1] ** 2
        of_channels = np.sum(lines / (power + TINY)[:, None], axis=0)
        of_channels[::n_teeth] = 0.0
        frequency = np.arange(of_channels.size) * mesh_frequency / n_teeth
        inside = frequency < 0.5 * sampling_rate
        # lines by bins of a spectrum whose inverse transform has these lags
        n_bins = 16 * n_lags
        place = np.round(frequency[inside] / sampling_rate * 2 * n_bins).astype(int)
        density = np.bincount(place, of_channels[inside], minlength=n_bins + 1)
        total += np.fft.irfft(density)[: n_lags + 1]
    return total


def _prediction_error(lags: FloatArray) -> Array:
    """(lag + 1,) inverse of the all-pole filter with this autocorrelation."""
    from scipy.linalg import solve_toeplitz

    if not lags[0] > 0.0:
        return np.eye(1, lags.size)[0]
    raised = lags.copy()
    raised[0] *= 1.0 + RIDGE
    return np.concatenate([[1.0], solve_toeplitz(raised[:-1], -raised[1:])])


def _filtered(
    turns: GearTurns,
    mesh_frequency: float,
    sampling_rate: float,
    inverse: Array,
) -> GearTurns:
    """Turns through a filter (sample,) at the sampling rate."""
    n_samples = turns.mesh.shape[-1]

    def through(turn: FloatArray) -> FloatArray:
        n_teeth = turn.shape[-1] // n_samples
        frequency = np.arange(turn.shape[-1] // 2 + 1) * mesh_frequency / n_teeth
        answer = _answer(inverse, frequency / sampling_rate)
        return np.fft.irfft(np.fft.rfft(turn) * answer, n=turn.shape[-1])

    return GearTurns(
        driving=through(turns.driving),
        driven=through(turns.driven),
        mesh=through(turns.mesh),
    )


def _answer(inverse: Array, share: FloatArray) -> NDArray[np.complexfloating]:
    """Frequency response at shares of the sampling rate; 0 from half of it on."""
    step = np.exp(-2j * np.pi * share)
    answer = np.polynomial.polynomial.polyval(step, inverse)
    return np.where(share < 0.5, answer, 0.0)
