"""The angle domain of a shaft whose speed varies, by its angle, or without a tachometer by the phase of the mesh.

Phase demodulation as a tachometer: F. Bonnardot, M. El Badaoui, R. B. Randall, J. Daniere & F. Guillet (2005), "Use of
the acceleration signal of a gearbox in order to perform angular resampling", Mechanical Systems and Signal Processing
19 (4), 766-785.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.floating]

PADDING = 8  # bins of the searched spectrum for one of the record's


def resample_by_angle(signal: ArrayLike, angle: ArrayLike, samples_per_turn: int) -> FloatArray:
    """Cut a signal into whole turns of a shaft, sampled uniformly in its angle.

    Parameters
    ----------
    signal : (..., sample)
    angle : (sample,) rad      of the shaft at every sample, rising; its first value is where the first turn starts
    samples_per_turn : int     fewer than the samples in the fastest turn alias

    Returns
    -------
    (..., turn, sample)

    Raises
    ------
    ValueError    if the angle does not rise, has another length than the signal, or makes no whole turn

    Notes
    -----
    Cubic spline through the samples; errors as in `gensig.signals.averaging.resample_to_angle`.
    """
    from scipy.interpolate import make_interp_spline

    x, turned = np.asarray(signal, dtype=float), np.asarray(angle, dtype=float)
    if turned.shape != x.shape[-1:] or not np.all(np.diff(turned) > 0.0):
        raise ValueError("the angle must rise from sample to sample, and have a value for every sample of the signal")
    turned = (turned - turned[0]) / (2.0 * math.pi)
    n_turns = math.floor(turned[-1] + 1e-9)
    if n_turns < 1:
        raise ValueError(f"{turned.size} samples hold {turned[-1]:.3g} turns of the shaft, less than a whole one")
    wanted = np.arange(n_turns * samples_per_turn) / samples_per_turn
    place = np.interp(wanted, turned, np.arange(turned.size))
    values = make_interp_spline(np.arange(turned.size), x, k=3, axis=-1)(place)
    return values.reshape(*x.shape[:-1], n_turns, samples_per_turn)


def find_mesh_frequency(
    signal: ArrayLike,
    sampling_rate: float,
    n_teeth: int,
    rotation_frequency: float,
    *,
    share: float = 0.02,
    n_harmonics: int = 3,
) -> float:
    """Mesh frequency near the expected one: where the summed amplitudes of its harmonics are largest.

    Parameters
    ----------
    signal : (..., sample)          channels are looked at together
    sampling_rate : Hz
    n_teeth : teeth of the gear
    rotation_frequency : Hz         expected turns of that gear per second
    share : of the expected frequency, searched on either side
    n_harmonics : mesh harmonics summed, those below half the sampling rate

    Returns
    -------
    Hz; where there is no mesh it is that of the strongest other line or noise

    Raises
    ------
    ValueError    if the search reaches the sidebands one shaft order away, or half the sampling rate

    Notes
    -----
    Assumes a constant speed: a speed that drifts by more than a bin over the record blunts the peak. A tone that is
    stronger than the mesh within the searched band is taken for it.
    """
    x = np.asarray(signal, dtype=float)
    x = (x - x.mean(axis=-1, keepdims=True)).reshape(-1, x.shape[-1])
    expected = n_teeth * rotation_frequency
    if share * n_teeth >= 0.5:
        raise ValueError(f"a search over {share:g} of the mesh frequency reaches sidebands of {n_teeth} teeth")
    if (1.0 + share) * expected >= 0.5 * sampling_rate:
        raise ValueError(f"the mesh frequency {expected:g} Hz lies above half the sampling rate {sampling_rate:g} Hz")
    n_bins = PADDING * x.shape[-1]
    spectrum = np.abs(np.fft.rfft(x * np.hanning(x.shape[-1]), n=n_bins, axis=-1))
    amplitude = np.sqrt(np.mean(np.square(spectrum), axis=0))
    spacing = sampling_rate / n_bins
    searched = np.arange((1.0 - share) * expected, (1.0 + share) * expected, spacing / n_harmonics)
    score = np.zeros(searched.size)
    for harmonic in range(1, n_harmonics + 1):
        if harmonic * searched[-1] < 0.5 * sampling_rate:
            score += np.interp(harmonic * searched / spacing, np.arange(amplitude.size), amplitude)
    return float(searched[np.argmax(score)])


def mesh_phase_angle(
    signal: ArrayLike, sampling_rate: float, n_teeth: int, mesh_frequency: float, *, harmonic: int = 1
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
    ValueError    if the phase runs backwards anywhere: the harmonic is no line that stands out

    Notes
    -----
    The band is half a shaft order on either side of the harmonic. So it follows what changes slower than once in two
    turns, keeps the sidebands of the shaft out, and cannot see a speed that varies within a turn. A speed that drifts
    by more than half a turn's share, 1 / (2 n_teeth harmonic), leaves the band. About two turns at either end bend to
    each other, because the filter is periodic. Where a turn begins is arbitrary.
    """
    x = np.asarray(signal, dtype=float)
    rotation_frequency = mesh_frequency / n_teeth
    frequency = np.fft.fftfreq(x.size, 1.0 / sampling_rate)
    distance = np.abs(frequency - harmonic * mesh_frequency) / (0.5 * rotation_frequency)
    weight = np.where(distance < 1.0, 0.5 + 0.5 * np.cos(math.pi * np.minimum(distance, 1.0)), 0.0)
    band = np.fft.ifft(np.fft.fft(x - x.mean()) * weight)
    phase = np.unwrap(np.angle(band))
    if not np.all(np.diff(phase) > 0.0):
        raise ValueError(
            f"the phase at {harmonic * mesh_frequency:.5g} Hz runs backwards: no mesh line stands out there"
        )
    return (phase - phase[0]) / (harmonic * n_teeth)
