"""Two observers of the same fault: one knows what it adds, one knows indicators of machines.

Both answer with d', the distance of healthy and faulty records in standard deviations. A share
Phi(d' / sqrt(2)) of pairs of a healthy and a faulty record is then ranked right.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gensig.signals.averaging import average_turn, residual_signal
from gensig.signals.indicators import (
    crest_factor,
    energy_ratio,
    fm4,
    kurtosis,
    rms,
    sideband_ratio,
)
from gensig.signals.rotation import resample_by_angle

FloatArray = NDArray[np.floating]

OF_SIGNAL = ("rms", "band_rms", "kurtosis", "crest_factor")
OF_GEAR = ("envelope", "fm4", "sideband_ratio", "energy_ratio", "residual_rms")
# Of the gear's turns, assumed: a short event once a turn has about equal ones.
ENVELOPE_HARMONICS = 5
FEWEST_UNITS = 4  # all but one of them still have a spread
LEAST_SPREAD = 1e-9  # of an indicator's logarithm: what rounding leaves of none


def residual_energy(
    residual: FloatArray,
    noise_density: FloatArray,
    sampling_rate: float,
    bandwidths: Sequence[float],
) -> FloatArray:
    """Square of d' of a known residual in Gaussian noise of a known spectrum, by band.

    Parameters
    ----------
    residual : (..., sample) m/s2, what the fault adds
    noise_density : (..., bin) (m/s2)^2, mean of |rfft(noise)|^2 / samples; one bin for all where
        it is white
    sampling_rate : Hz
    bandwidths : (band,) Hz, rising upper ends; the first band begins at 0, a frequency belongs to
        the lower band

    Returns
    -------
    (..., band)    independent bands, and records after one another, add up: d' grows with the root
                   of the duration; NaN without noise

    Source: the matched filter of a known signal in Gaussian noise, whitened: Van Trees (1968),
    "Detection, estimation, and modulation theory", part I, section 4.3.
    """
    n_samples = residual.shape[-1]
    frequency = np.fft.rfftfreq(n_samples, 1.0 / sampling_rate)
    sides = np.full(frequency.size, 2.0)
    sides[0] = 1.0
    if n_samples % 2 == 0:
        sides[-1] = 1.0
    power = sides * np.abs(np.fft.rfft(residual, axis=-1)) ** 2 / n_samples
    unknown = np.full(power.shape, np.nan)
    energy = np.divide(power, noise_density, out=unknown, where=noise_density > 0.0)
    ends = np.searchsorted(frequency, bandwidths, side="right")
    bands = [energy[..., low:high].sum(axis=-1) for low, high in pairwise([0, *ends])]
    return np.stack(bands, axis=-1)


def indicator_names(gears: Sequence[str]) -> tuple[str, ...]:
    """Names along the last axis of ``band_indicators``."""
    return (*OF_SIGNAL, *(f"{name}_{gear}" for gear in gears for name in OF_GEAR))


def band_indicators(
    signal: FloatArray,
    angle: FloatArray,
    sampling_rate: float,
    gears: Mapping[str, tuple[int, float]],
    bandwidths: Sequence[float],
) -> FloatArray:
    """Logarithms of the indicators of one record by bandwidth, for an analyst with a tachometer.

    ``band_rms`` and the envelope are those of the highest band of the bandwidth alone, all others
    of everything below. The envelope is the amplitude of its first `ENVELOPE_HARMONICS` orders of
    the gear over its mean; averages are those of all whole turns that there are.

    Parameters
    ----------
    signal : (channel, sample) m/s2
    angle : (sample,) rad           of the pinion
    sampling_rate : Hz
    gears : name -> (teeth, turns for one of the pinion)
    bandwidths : (band,) Hz, rising

    Returns
    -------
    (channel, band, indicator)    NaN where the record is too short or the bandwidth too small for
        an indicator
    """
    x = signal - signal.mean(axis=-1, keepdims=True)
    n_channels, n_samples = x.shape
    table = np.full(
        (n_channels, len(bandwidths), len(indicator_names(list(gears)))), np.nan
    )
    turns = {gear: _turns(x, ratio * angle) for gear, (_, ratio) in gears.items()}
    orders = {gear: _orders(ratio * angle) for gear, (_, ratio) in gears.items()}
    spectrum = np.fft.rfft(x, axis=-1)
    frequency = np.fft.rfftfreq(n_samples, 1.0 / sampling_rate)
    ends = np.searchsorted(frequency, bandwidths, side="right")
    below = np.zeros(x.shape, dtype=np.complex128)
    for band, (low, high) in enumerate(pairwise([1, *ends])):
        one_sided = np.zeros(x.shape, dtype=np.complex128)
        one_sided[:, low:high] = 2.0 * spectrum[:, low:high]
        analytic = np.fft.ifft(one_sided, axis=-1)
        below += analytic
        columns = [
            rms(below.real),
            rms(analytic.real),
            kurtosis(below.real),
            crest_factor(below.real),
        ]
        for gear, (n_teeth, ratio) in gears.items():
            columns.append(_envelope_turns(np.abs(analytic), orders[gear]))
            highest = (
                2.0
                * math.pi
                * bandwidths[band]
                * n_samples
                / sampling_rate
                / (ratio * (angle[-1] - angle[0]))
            )
            columns += _of_average(turns[gear], math.floor(highest), n_teeth)
        table[:, band] = np.stack(columns, axis=-1)
    with np.errstate(divide="ignore"):
        logarithm = np.log(table)
    return np.where(np.isfinite(logarithm), logarithm, np.nan)


def _turns(x: FloatArray, angle: FloatArray) -> FloatArray:
    """Average turn, (channel, sample); of one sample where there is no whole one."""
    try:
        return average_turn(resample_by_angle(x, angle), min_turns=1)
    except ValueError:
        return np.full((len(x), 1), np.nan)


def _orders(angle: FloatArray) -> FloatArray | None:
    """e^(-i k angle) of the harmonics over the whole turns that there are, (harmonic, sample)."""
    turned = angle - angle[0]
    whole_turns = 2.0 * math.pi * math.floor(turned[-1] / (2.0 * math.pi))
    n_kept = int(np.searchsorted(turned, whole_turns))
    if n_kept == 0:
        return None
    first = np.exp(-1j * turned[:n_kept])
    return np.cumprod(np.tile(first, (ENVELOPE_HARMONICS, 1)), axis=0)


def _envelope_turns(magnitude: FloatArray, orders: FloatArray | None) -> FloatArray:
    if orders is None:
        return np.full(len(magnitude), np.nan)
    kept = magnitude[:, : orders.shape[1]]
    mean = kept.mean(axis=-1)
    lines = 2.0 * np.abs(kept @ orders.T) / kept.shape[-1]
    total = np.sqrt(np.sum(lines**2, axis=-1))
    return np.divide(total, mean, out=np.full(len(kept), np.nan), where=mean > 0.0)


def _of_average(
    average: FloatArray, highest_order: int, n_teeth: int
) -> list[FloatArray]:
    """The indicators of an average turn up to some order, (channel,) each."""
    n_samples = average.shape[-1]
    highest = min(highest_order, (n_samples - 1) // 2)
    if highest <= n_teeth + (n_teeth - 1) // 2:
        # no room for the mesh and its sidebands
        return [np.full(len(average), np.nan)] * (len(OF_GEAR) - 1)
    # fewer samples a turn: nothing is left above the highest order, not even rounding
    n_kept = 2 * highest + 1
    orders = np.fft.rfft(average)[:, : highest + 1]
    turn = np.fft.irfft(orders, n_kept) * (n_kept / n_samples)
    ratios = [of_turn(turn, n_teeth) for of_turn in (fm4, sideband_ratio, energy_ratio)]
    return [*ratios, rms(residual_signal(turn, n_teeth))]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Detectability of a fault by indicators, on machines that had no part in choosing one.

    Attributes
    ----------
    d_prime, standard_error : NaN where too few machines have an indicator
    auroc : of pairs of different machines
    indicator : index of the one that most choices fell on; -1 where there is none
    raises : True if the fault raises it
    """

    d_prime: float
    standard_error: float
    auroc: float
    indicator: int
    raises: bool


NOTHING_SEEN = Seen(
    d_prime=math.nan, standard_error=math.nan, auroc=math.nan, indicator=-1, raises=True
)


def seen_by_indicators(sound: FloatArray, faulty: FloatArray) -> Seen:
    """Score of the indicator that is best on all machines but one, judged on that one, in turn.

    A machine's score is its distance from the mean of the healthy ones, in their standard
    deviations, in the direction in which the faulty ones of the others lie. Scores of indicators
    chosen for different machines are then on one scale.

    Parameters
    ----------
    sound, faulty : (unit, indicator)    the same machines without and with the fault

    Returns
    -------
    Seen

    Notes
    -----
    d' is the difference of the means over the root mean square s of both standard deviations,
    times 1 - 3 / (4 n - 5), which takes the bias of few machines away. The groups are the same n
    machines, so that the square of its standard error is the variance of their differences over
    n s^2, plus d'^2 / (2 n - 2) for s. Both hold for one indicator: S. B. Morris & R. P. DeShon
    (2002), "Combining effect size estimates in meta-analysis with repeated measures and
    independent-groups designs", Psychological Methods 7 (1), 105-125. Without a fault both groups
    are the same numbers: d' is 0 and the AUROC 0.5, however many indicators there are.
    """
    known = np.isfinite(sound).any(axis=1) & np.isfinite(faulty).any(axis=1)
    sound, faulty = sound[known], faulty[known]
    everywhere = np.isfinite(sound).all(axis=0) & np.isfinite(faulty).all(axis=0)
    usable = np.flatnonzero(everywhere)
    n_units = len(sound)
    if n_units < FEWEST_UNITS or usable.size == 0:
        return NOTHING_SEEN
    groups = np.stack([sound[:, usable], faulty[:, usable]])
    middle = groups[0].mean(axis=0)
    scale = np.maximum(groups[0].std(axis=0, ddof=1), LEAST_SPREAD)
    scores = np.empty((2, n_units))
    chosen = np.empty(n_units, dtype=np.intp)
    for unit in range(n_units):
        others = np.delete(groups, unit, axis=1)
        difference = others[1].mean(axis=0) - others[0].mean(axis=0)
        chosen[unit] = best = int(np.argmax(np.abs(difference) / _spread(others)))
        score = (groups[:, unit, best] - middle[best]) / scale[best]
        if difference[best] < 0.0:
            score = -score
        scores[:, unit] = score
    most = int(np.argmax(np.bincount(chosen)))
    raises = groups[1, :, most].mean() >= groups[0, :, most].mean()
    return _judged(*scores, indicator=int(usable[most]), raises=bool(raises))


def confirmed(
    sound: FloatArray, faulty: FloatArray, *, indicator: int, raises: bool
) -> Seen:
    """Detectability by one indicator that was chosen on other machines.

    The best of many tests is partly best by luck.

    Parameters
    ----------
    sound, faulty : (unit, indicator)    as in `seen_by_indicators`
    indicator, raises : as that one says
    """
    scores = np.stack([sound[:, indicator], faulty[:, indicator]])
    if not raises:
        scores = -scores
    scores = scores[:, np.isfinite(scores).all(axis=0)]
    if scores.shape[1] < FEWEST_UNITS:
        return NOTHING_SEEN
    return _judged(*scores, indicator=indicator, raises=raises)


def _judged(
    sound: FloatArray, faulty: FloatArray, *, indicator: int, raises: bool
) -> Seen:
    """Scores of the same machines without and with the fault, (unit,) each."""
    n_units = len(sound)
    bias = 1.0 - 3.0 / (4.0 * n_units - 5.0)
    spread = float(_spread(np.stack([sound, faulty])[:, :, None])[0])
    d_prime = bias * float(faulty.mean() - sound.mean()) / spread
    of_mean = bias**2 * float(np.var(faulty - sound, ddof=1)) / (n_units * spread**2)
    return Seen(
        d_prime=d_prime,
        standard_error=math.sqrt(of_mean + d_prime**2 / (2.0 * n_units - 2.0)),
        auroc=_auroc(sound, faulty),
        indicator=indicator,
        raises=raises,
    )


def _spread(groups: FloatArray) -> FloatArray:
    """Root mean square of the standard deviations of two groups, (indicator,).

    Parameters
    ----------
    groups : (group, unit, indicator)
    """
    variance = np.mean(np.var(groups, axis=1, ddof=1), axis=0)
    return np.maximum(np.sqrt(variance), LEAST_SPREAD)


def _auroc(sound: FloatArray, faulty: FloatArray) -> float:
    """Share of pairs of different machines in which the faulty one scores higher.

    Ties count half.
    """
    higher = np.sign(faulty[:, None] - sound[None, :])
    others = ~np.eye(len(sound), dtype=bool)
    return float(0.5 + 0.5 * higher[others].mean())
