"""Envelope of a band and its spectrum: impacts that repeat show as lines at their rate.

McFadden & Smith (1984), "Vibration monitoring of rolling element bearings by the high-frequency
resonance technique", Tribology International 17 (1), 3-10; Randall & Antoni (2011), Mechanical
Systems and Signal Processing 25 (2), 485-520.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.spectrum import amplitude_spectrum


def band_pass(
    signal: ArrayLike,
    sampling_rate: float,
    band: tuple[float, float],
    *,
    order: int = 4,
) -> FloatArray:
    """Butterworth band-pass run forwards and backwards.

    It has no phase shift and twice the order in attenuation.

    Parameters
    ----------
    signal : (..., sample)
    sampling_rate : Hz
    band : (low, high) Hz, inside (0, sampling_rate / 2)

    Raises
    ------
    ValueError    if the band is empty or leaves that range
    """
    from scipy.signal import butter, sosfiltfilt

    low, high = band
    if not 0 < low < high < sampling_rate / 2:
        raise ValueError(
            f"band {low:g}-{high:g} Hz must lie inside 0-{sampling_rate / 2:g} Hz, low before high"
        )
    sections = butter(
        order, [low, high], btype="bandpass", fs=sampling_rate, output="sos"
    )
    return sosfiltfilt(sections, np.asarray(signal, dtype=float), axis=-1)


def envelope(
    signal: ArrayLike, sampling_rate: float, band: tuple[float, float] | None = None
) -> FloatArray:
    """Magnitude of the analytic signal, of a band or of the signal less its mean.

    Parameters
    ----------
    signal : (..., sample) m/s^2
    sampling_rate : Hz
    band : (low, high) Hz

    Returns
    -------
    (..., sample) m/s^2
    """
    from scipy.signal import hilbert

    x = np.asarray(signal, dtype=float)
    if band is None:
        x = x - x.mean(axis=-1, keepdims=True)
    else:
        x = band_pass(x, sampling_rate, band)
    return np.abs(hilbert(x, axis=-1))


def mesh_envelope(
    average: ArrayLike,
    n_teeth: int,
    *,
    harmonic: int = 1,
    n_sidebands: int | None = None,
) -> FloatArray:
    """Amplitude of one mesh harmonic over a turn, by demodulation of the band of its sidebands.

    Parameters
    ----------
    average : (..., sample)    time-synchronous average of one turn of the gear
    n_teeth : teeth of the gear
    harmonic : of the mesh
    n_sidebands : taken on either side; default: all that are nearer to this harmonic than to
        another

    Returns
    -------
    (..., sample) in the unit of the signal

    Raises
    ------
    ValueError    if the average has too few samples for the band, or the sidebands reach order 0

    Source: P. D. McFadden (1986), "Detecting fatigue cracks in gears by amplitude and phase
    demodulation of the meshing vibration", J. Vibration, Acoustics, Stress and Reliability in
    Design 108 (2), 165-170; here the harmonic itself stays in, so that the mean is its amplitude.
    """
    turn = np.asarray(average, dtype=float)
    n_samples = turn.shape[-1]
    reach = n_sidebands
    if reach is None:
        reach = (n_teeth - 1) // 2
    low, high = harmonic * n_teeth - reach, harmonic * n_teeth + reach
    if not 0 < low <= high < n_samples / 2:
        raise ValueError(
            f"{n_samples} samples a turn cannot hold the band of mesh orders {low} to {high}"
        )
    spectrum = np.fft.fft(turn, axis=-1)
    one_sided = np.zeros_like(spectrum)
    one_sided[..., low : high + 1] = 2.0 * spectrum[..., low : high + 1]
    return np.abs(np.fft.ifft(one_sided, axis=-1))


def envelope_spectrum(
    signal: ArrayLike,
    sampling_rate: float,
    band: tuple[float, float] | None = None,
    *,
    window: str = "hann",
) -> tuple[FloatArray, FloatArray]:
    """Amplitude spectrum of the envelope less its mean.

    Parameters
    ----------
    signal : (..., sample) m/s^2
    sampling_rate : Hz
    band : (low, high) Hz
    window : see `gensig.signals.spectrum.amplitude_spectrum`

    Returns
    -------
    frequency : (bin,) Hz
    amplitude : (..., bin) m/s^2
    """
    magnitude = envelope(signal, sampling_rate, band)
    return amplitude_spectrum(
        magnitude - magnitude.mean(axis=-1, keepdims=True), sampling_rate, window=window
    )
