"""Gain of the path from a simulated bearing to a sensor, and its response of least delay."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gensig.arrays import Array, Complex, Flags
from gensig.errors import ConfigError
from gensig.signals.recording import Recording
from gensig.signals.transfer.order_lines import Lines, band_centers, band_sums

SURE = 3.0  # standard deviations above the floor from which the power of lines counts


def fit_path(
    measured: Lines, simulated: Sequence[Lines], recording: Recording
) -> tuple[Array, Array, Flags]:
    """Gain from the simulated bearing to each sensor, from half the mesh frequency up.

    It is the root of the measured over the simulated power of the shafts' orders, in sixths of an
    octave. Where the orders do not stand out, the gain is interpolated, but not above the level
    at which they would.

    Returns
    -------
    frequency (band,) Hz, gain (sensor, band), heard (sensor, band)
    """
    bins = measured.frequency
    centers = band_centers(0.5 * measured.mesh_frequency, recording.sampling_rate)
    power = band_sums(measured.synchronous, bins, centers)
    n_bins = band_sums(measured.is_line[None].astype(float), bins, centers)
    line_floor = np.where(measured.is_line, measured.floor, 0.0)
    # two bins of a Hann window are about one independent bin
    independent = np.maximum(n_bins, 1.0) / 2.0
    spread = band_sums(line_floor, bins, centers) / np.sqrt(independent)
    model = np.mean(
        [
            band_sums(lines.synchronous, lines.frequency, centers)[0]
            for lines in simulated
        ],
        axis=0,
    )
    heard = (power > SURE * spread) & (model > 0.0)
    gain = np.empty_like(power)
    logs = np.log(centers)
    for sensor, known in enumerate(heard):
        if not known.any():
            name = recording.sensors[sensor]
            raise ConfigError(
                f"{name} hears nothing of the gears; leave it out with --channels"
            )
        squared = np.log(power[sensor][known] / model[known])
        filled = np.exp(np.interp(logs, logs[known], squared))
        limit = np.maximum(power[sensor], 0.0) + SURE * spread[sensor]
        most = limit / np.maximum(model, 1e-300)
        gain[sensor] = np.sqrt(np.where(known, filled, np.minimum(filled, most)))
    return centers, gain, heard


def gain_at(wanted: Array, frequency: Array, gain: Array) -> Array:
    """Gain between the frequencies at which it is known.

    It is straight in the logarithms and held beyond them.
    """
    axis = np.log(np.maximum(wanted, 1e-3))
    logarithm = np.log(np.maximum(gain, 1e-300))
    return np.asarray(np.exp(np.interp(axis, np.log(frequency), logarithm)))


def minimum_phase(
    frequency: Array, gain: Array, sampling_rate: float, step: float
) -> tuple[Array, Complex]:
    """Causal response with the given gain and the least delay.

    Its frequencies are even from 0 to half the rate.

    Returns
    -------
    frequency (line,) Hz, response (line,)

    Source: A. V. Oppenheim & R. W. Schafer, "Discrete-time signal processing", real cepstrum
    folded to positive times.
    """
    half = 0.5 * sampling_rate
    n_lines = math.floor(half / step)
    # eight lines between those given, so that the cepstrum does not fold
    n_fft = 2 * 8 * n_lines
    fine = np.arange(n_fft // 2 + 1) * half / (n_fft // 2)
    logarithm: Array = np.log(gain_at(fine, frequency, gain))
    cepstrum: Array = np.fft.irfft(logarithm, n_fft)
    fold = np.zeros(n_fft)
    fold[0] = fold[n_fft // 2] = 1.0
    fold[1 : n_fft // 2] = 2.0
    response = np.exp(np.fft.rfft(cepstrum * fold))[::8]
    even: Array = np.arange(n_lines + 1, dtype=np.float64) * (half / n_lines)
    return even, np.asarray(response, dtype=np.complex128)
