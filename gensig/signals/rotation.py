"""Angle domain of a shaft whose speed varies, by its angle or by the phase of the mesh.

Phase demodulation as a tachometer: F. Bonnardot, M. El Badaoui, R. B. Randall, J. Daniere & F.
Guillet (2005), "Use of the acceleration signal of a gearbox in order to perform angular
resampling", Mechanical Systems and Signal Processing 19 (4), 766-785.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import interpolate, samples_per_turn_for

PADDING = 8  # bins of the searched spectrum for one of the record's
# of the median amplitude; band-limited noise is below it for 3 % of the time
FADED = 0.2


def resample_by_angle(
    signal: ArrayLike, angle: ArrayLike, samples_per_turn: int | None = None
) -> FloatArray:
    """Cut a signal into whole turns of a shaft, sampled uniformly in its angle.

    Parameters
    ----------
    signal : (..., sample)
    angle : (sample,) rad      of the shaft at every sample, rising; its first value is where the
        first turn starts
    samples_per_turn : int     default: `samples_per_turn_for` the slowest turn; fewer alias

    Returns
    -------
    (..., turn, sample)

    Raises
    ------
    ValueError    if the angle does not rise, has another length than the signal, or makes no whole
        turn

    Notes
    -----
    Between samples the angle is a straight line. The signal is interpolated as in
    `gensig.signals.averaging.resample_to_angle`.
    """
    x, turned = np.asarray(signal, dtype=float), np.asarray(angle, dtype=float)
    if turned.shape != x.shape[-1:] or not np.all(np.diff(turned) > 0.0):
        raise ValueError(
            "the angle must rise from sample to sample, and have a value for every sample of the "
            "signal"
        )
    turned = (turned - turned[0]) / (2.0 * math.pi)
    n_turns = math.floor(turned[-1] + 1e-9)
    if n_turns < 1:
        raise ValueError(
            f"{turned.size} samples hold {turned[-1]:.3g} turns of the shaft, less than a whole one"
        )
    samples = np.arange(turned.size)
    longest = float(np.max(np.diff(np.interp(np.arange(n_turns + 1), turned, samples))))
    per_turn = samples_per_turn or samples_per_turn_for(longest, 1.0)
    wanted = np.arange(n_turns * per_turn).reshape(n_turns, per_turn) / per_turn
    return interpolate(x, np.interp(wanted, turned, samples))


def find_mesh_frequency(
    signal: ArrayLike,
    sampling_rate: float,
    n_teeth: int,
    rotation_frequency: float,
    *,
    share: float = 0.02,
    n_harmonics: int = 6,
) -> float:
    """Mesh frequency near the expected one: where its harmonics together stand out most.

    Parameters
    ----------
    signal : (..., sample)          channels are looked at together
    sampling_rate : Hz
    n_teeth : teeth of the gear
    rotation_frequency : Hz         expected turns of that gear per second
    share : of the expected frequency, searched on either side
    n_harmonics : mesh harmonics looked at, those below half the sampling rate

    Returns
    -------
    Hz; where there is no mesh it is that of the strongest other line or noise

    Raises
    ------
    ValueError    if the search reaches the sidebands one shaft order away, or half the sampling
        rate

    Notes
    -----
    First the largest sum over the harmonics of the logarithm of amplitude over its median in the
    searched band, so that a foreign tone near one harmonic does not outweigh the mesh in the
    others; then, within a bin of the record, of the squares, so that the strongest lines tell the
    place. Assumes a constant speed: one that drifts by more than a bin over the record blunts the
    peak.
    """
    x = np.asarray(signal, dtype=float)
    x = (x - x.mean(axis=-1, keepdims=True)).reshape(-1, x.shape[-1])
    expected = n_teeth * rotation_frequency
    if share * n_teeth >= 0.5:
        raise ValueError(
            f"a search over {share:g} of the mesh frequency reaches sidebands of {n_teeth} teeth"
        )
    if (1.0 + share) * expected >= 0.5 * sampling_rate:
        raise ValueError(
            f"the mesh frequency {expected:g} Hz lies above half the sampling rate "
            f"{sampling_rate:g} Hz"
        )
    n_bins = PADDING * x.shape[-1]
    spectrum = np.abs(np.fft.rfft(x * np.hanning(x.shape[-1]), n=n_bins, axis=-1))
    amplitude = np.sqrt(np.mean(np.square(spectrum), axis=0))
    spacing = sampling_rate / n_bins
    searched = np.arange(
        (1.0 - share) * expected, (1.0 + share) * expected, spacing / n_harmonics
    )
    bins = np.arange(amplitude.size)
    held = [
        k for k in range(1, n_harmonics + 1) if k * searched[-1] < 0.5 * sampling_rate
    ]
    lines = [np.interp(k * searched / spacing, bins, amplitude) for k in held]
    relative = [line / floor for line in lines if (floor := np.median(line)) > 0.0]
    over = np.array(relative).reshape(-1, searched.size)
    coarse = searched[np.argmax(np.sum(np.log(np.maximum(over, 1.0)), axis=0))]
    near = np.abs(searched - coarse) <= PADDING * spacing
    return float(searched[near][np.argmax(np.sum(np.square(over), axis=0)[near])])


def mesh_phase_angle(
    signal: ArrayLike,
    sampling_rate: float,
    n_teeth: int,
    mesh_frequency: float,
    *,
    harmonic: int = 1,
) -> FloatArray:
    """Angle of a shaft by the phase of one mesh harmonic, for recordings without a tachometer.

    Parameters
    ----------
    signal : (sample,)       one channel, in which the harmonic stands out
    sampling_rate : Hz
    n_teeth : teeth of the gear on that shaft
    mesh_frequency : Hz      its mean, as from `find_mesh_frequency`
    harmonic : of the mesh frequency

    Returns
    -------
    (sample,) rad    from 0

    Raises
    ------
    ValueError    where the line fades below a fifth of its median amplitude, or its phase runs
        backwards: noise does so, and teeth would be miscounted

    Notes
    -----
    The harmonic, shifted to frequency 0, is averaged over two turns with a Hann window, which is
    zero at the sidebands of whole orders of the shaft. So it follows what changes slower than once
    in four turns, and cannot see a speed that varies within a turn. A speed that drifts by more
    than the share 1 / (2 n_teeth harmonic) loses the line. At either end one turn is averaged over
    fewer samples. Where a turn begins is arbitrary.
    """
    from scipy.signal import get_window, oaconvolve

    x = np.asarray(signal, dtype=float)
    window = get_window("hann", round(2.0 * sampling_rate * n_teeth / mesh_frequency))
    steady = (
        2.0 * math.pi * harmonic * mesh_frequency / sampling_rate * np.arange(x.size)
    )
    band = oaconvolve((x - x.mean()) * np.exp(-1j * steady), window, mode="same")
    phase, magnitude = steady + np.unwrap(np.angle(band)), np.abs(band)
    is_faded = magnitude.min() <= FADED * np.median(magnitude)
    if is_faded or not np.all(np.diff(phase) > 0.0):
        raise ValueError(
            f"no steady line stands out at {harmonic * mesh_frequency:.5g} Hz; try another "
            "harmonic or channel"
        )
    return (phase - phase[0]) / (harmonic * n_teeth)
