"""Records that the page shows: waveform, spectra and spectrogram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gensig.arrays import FloatArray
from gensig.dataset.reader import Dataset
from gensig.errors import DatasetError
from gensig.report.conditions import TWIN, Shown
from gensig.report.packing import pack_amplitude, pack_signal
from gensig.report.rotation_frequencies import Rotation
from gensig.signals.envelope import envelope_spectrum
from gensig.signals.spectrum import amplitude_spectrum
from gensig.text.amounts import finite

WAVEFORM_SAMPLES = 8192
SPECTRUM_SAMPLES = 2**20  # longer records are read up to here
SPECTRUM_BINS = 20_000
ENVELOPE_BINS = 4000
ENVELOPE_MESHES = 3.2  # the envelope spectrum ends above the third harmonic of the mesh
# above the lower mesh harmonics, below the highest usable frequency, as `gensig simulate --plot`
# takes it
ENVELOPE_BAND = (5000.0 / 51200.0, 19000.0 / 51200.0)  # of the sampling rate
WINDOW_SAMPLES = 256  # of the spectrogram
SPECTROGRAM_COLUMNS = 96


def read_signals(data: Dataset, shown: Shown, channels: Sequence[str]) -> FloatArray:
    """The beginning of a record or of its healthy twin, (channel, sample).

    Raises
    ------
    DatasetError    for values that are not finite
    """
    name = "acceleration"
    if shown.is_twin:
        name = TWIN
    n_read = min(data.n_samples, SPECTRUM_SAMPLES)
    read = data.signals(shown.index, stop=n_read, channels=list(channels), name=name)
    if not np.isfinite(read).all():
        record_id = data.column("record_id")[shown.index]
        raise DatasetError(
            f"record {record_id} holds values that are not finite; run gensig verify"
        )
    return read.astype(float)


def example(
    data: Dataset, shown: Shown, signals: FloatArray, rotation: Rotation
) -> dict[str, Any]:
    """Labels and frequencies of a record or twin, and four views of each channel.

    Parameters
    ----------
    signals : (channel, sample) of `read_signals`
    """
    index = shown.index
    name, fault = str(data.column("label_name")[index]), rotation.fault_gear(index)
    severity = finite(data.column("severity")[index])
    if shown.is_twin:
        name, fault, severity = "healthy twin", "", 0.0
    rate, top, frequencies = data.sampling_rate, usable_top(data), rotation.of(index)
    return {
        "record": str(data.column("record_id")[index]),
        "class": name,
        "severity": severity,
        "unit": str(data.column("unit_id")[index]),
        "condition": str(data.column("condition_id")[index]),
        "torque": finite(data.column("torque_nm")[index]),
        "frequencies": frequencies,
        "fault": fault,
        "views": [_views(signal, rate, top, frequencies["mesh"]) for signal in signals],
    }


def usable_top(data: Dataset) -> float:
    """Upper end of the usable band, Hz."""
    half = data.sampling_rate / 2
    try:
        top = float(data.attributes["usable_band_hz"][1])
    except (KeyError, TypeError, IndexError, ValueError):
        return half
    if top > 0.0:
        return min(top, half)
    return half


def envelope_band(sampling_rate: float) -> tuple[float, float]:
    """The band whose envelope is taken, Hz."""
    return ENVELOPE_BAND[0] * sampling_rate, ENVELOPE_BAND[1] * sampling_rate


def _views(
    signal: FloatArray, rate: float, top: float, mesh: float | None
) -> dict[str, Any]:
    part = signal[:WAVEFORM_SAMPLES]
    frequency, amplitude = amplitude_spectrum(signal, rate)
    views: dict[str, Any] = {
        "wave": {**pack_signal(part), "step": 1.0 / rate},
        "spectrum": _lines(frequency, amplitude, top, SPECTRUM_BINS),
        "spectrogram": _spectrogram(part, rate, top),
    }
    if len(signal) > 100:  # the band-pass needs more samples than its ends
        highest = top / 8.0
        if mesh:
            highest = ENVELOPE_MESHES * mesh
        frequency, amplitude = envelope_spectrum(signal, rate, envelope_band(rate))
        views["envelope"] = _lines(
            frequency, amplitude, highest, ENVELOPE_BINS, first=1
        )
    return views


def _lines(
    frequency: FloatArray, amplitude: FloatArray, top: float, most: int, first: int = 0
) -> dict[str, Any]:
    """A spectrum from the bin `first` up to `top` Hz, thinned to at most `most` bins.

    A bin of the thinned spectrum is the largest of its neighbors.
    """
    end = max(int(np.searchsorted(frequency, top, side="right")), first + 2)
    amplitude = amplitude[first:end]
    each = -(-len(amplitude) // most)
    largest = np.maximum.reduceat(amplitude, np.arange(0, len(amplitude), each))
    step = float(frequency[1] - frequency[0])
    return {
        **pack_amplitude(largest),
        "start": (first + (each - 1) / 2) * step,
        "step": each * step,
    }


def _spectrogram(signal: FloatArray, rate: float, top: float) -> dict[str, Any]:
    """Amplitudes of a Hann window over time and frequency, (column, bin)."""
    from scipy.signal import get_window

    n_window = max(min(WINDOW_SAMPLES, len(signal) // 8 * 2), 2)
    hop = max((len(signal) - n_window) // (SPECTROGRAM_COLUMNS - 1), 1)
    weights = get_window("hann", n_window)
    centered = signal - signal.mean()
    windows = np.lib.stride_tricks.sliding_window_view(centered, n_window)[::hop]
    spectra = np.fft.rfft(windows * weights, axis=-1)
    amplitude = np.abs(spectra) * (2.0 / weights.sum())
    amplitude = amplitude[:, : max(int(top / rate * n_window) + 1, 2)]
    return {
        **pack_amplitude(amplitude),
        "shape": list(amplitude.shape),
        "time": 0.5 * n_window / rate,
        "time_step": hop / rate,
        "step": rate / n_window,
    }
