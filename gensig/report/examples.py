"""Records that the page shows: their choice, waveform, spectra and spectrogram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.reader import Dataset
from gensig.errors import DatasetError
from gensig.report.packing import pack_amplitude, pack_signal
from gensig.report.rotation_frequencies import Rotation
from gensig.report.values import has_lives
from gensig.signals.envelope import envelope_spectrum
from gensig.signals.spectrum import amplitude_spectrum

FloatArray = NDArray[np.floating]

RECORDS_PER_CLASS = 3
SIGNALS_BY_DEFAULT = 48  # records times channels: about 3 MB
SIGNALS_AT_MOST = 140  # about 9 MB, plotly.js 5 MB: the page stays below 15 MB
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Records (by number) and channels (by name) that are shown.

    ``remark`` is one line on the parts that were left out, or "".
    """

    records: dict[str, list[int]]
    channels: list[str]
    remark: str

    @property
    def n_signals(self) -> int:
        """Records times channels."""
        return len(self.channels) * sum(map(len, self.records.values()))


def choose(data: Dataset, per_class: int | None) -> Choice:
    """Usable records of each class, from the least to the greatest severity.

    The healthy ones are of the same machines.

    Parameters
    ----------
    per_class : records of a class; None takes `RECORDS_PER_CLASS`, or fewer for a small page
    """
    label, usable = data.column("label_name"), data.usable
    classes = [name for name in data.class_names if np.any((label == name) & usable)]
    if not classes:
        raise DatasetError(
            f"{data.folder} has no usable record to show; gensig inspect {data.folder} says why"
        )
    limit, wanted = SIGNALS_BY_DEFAULT, RECORDS_PER_CLASS
    if per_class is not None:
        limit, wanted = SIGNALS_AT_MOST, per_class
    n_channels = min(len(data.channel_names), max(limit // len(classes), 1))
    n_shown = max(min(wanted, limit // (len(classes) * n_channels)), 1)
    chosen = {name: _spread(data, name, n_shown) for name in classes}
    if "healthy" in chosen:
        faulty = [chosen[name] for name in classes if name != "healthy"]
        chosen["healthy"] = _sound(data, faulty[::-1], n_shown)
    remarks, n_all = [], len(data.channel_names)
    small = "so that the page stays small"
    if n_shown < wanted:
        remarks.append(f"{n_shown} instead of {wanted} records a class, {small}")
    if n_channels < n_all:
        remarks.append(f"the first {n_channels} of {n_all} channels, {small}")
    return Choice(
        records=chosen,
        channels=data.channel_names[:n_channels],
        remark="; ".join(remarks),
    )


def _spread(data: Dataset, name: str, n_shown: int) -> list[int]:
    """Records of a class, or of its worst life, at even steps of the rank of their severity."""
    result = np.flatnonzero((data.column("label_name") == name) & data.usable)
    result = result[np.argsort(data.column("severity")[result], kind="stable")]
    if has_lives(data):  # the machine that gets worst, from its beginning
        life = data.column("life_id")[result]
        result = result[life == life[-1]]
    ranks = np.array([result.size // 2])
    if n_shown > 1:
        ranks = np.linspace(0, result.size - 1, n_shown)
    return list(dict.fromkeys(result[np.rint(ranks).astype(int)].tolist()))


def _sound(data: Dataset, faulty: Sequence[Sequence[int]], n_shown: int) -> list[int]:
    """Healthy records at the conditions of the middle faulty records, filled up with any."""
    condition, unit = data.column("condition_id"), data.column("unit_id")
    sound = np.flatnonzero((data.column("label_name") == "healthy") & data.usable)
    result: list[int] = []
    for records in faulty:
        middle = records[len(records) // 2]
        is_same = (condition[sound] == condition[middle]) & (
            unit[sound] == unit[middle]
        )
        result += sound[is_same][:1].tolist()
    result = list(dict.fromkeys(result))[:n_shown]
    others = _spread(data, "healthy", n_shown)
    return list(dict.fromkeys([*result, *others]))[:n_shown]


def example(
    data: Dataset, index: int, channels: Sequence[str], rotation: Rotation
) -> dict[str, Any]:
    """Labels and frequencies of a record, and four views of each channel.

    Raises
    ------
    DatasetError    for a record with values that are not finite
    """
    n_read = min(data.n_samples, SPECTRUM_SAMPLES)
    signals = data.signals(index, stop=n_read, channels=list(channels)).astype(float)
    record_id = str(data.column("record_id")[index])
    if not np.isfinite(signals).all():
        raise DatasetError(
            f"record {record_id} holds values that are not finite; run gensig verify"
        )
    rate, top, frequencies = data.sampling_rate, usable_top(data), rotation.of(index)
    return {
        "record": record_id,
        "class": str(data.column("label_name")[index]),
        "severity": _finite(data.column("severity")[index]),
        "unit": str(data.column("unit_id")[index]),
        "condition": str(data.column("condition_id")[index]),
        "torque": _finite(data.column("torque_nm")[index]),
        "frequencies": frequencies,
        "fault": rotation.fault_gear(index),
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


def _finite(value: Any) -> float | None:
    if np.isfinite(value):
        return float(value)
    return None
