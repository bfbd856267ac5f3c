"""Decimation from the internal rate to the output rate, without aliases in the usable band."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.dynamics._record_kernels import TOGETHER, low_pass
from gensig.dynamics._vector import LANES

# of the output rate: the pass band ends at 20 kHz of 51.2 kHz, the stop band begins
PASS_SHARE, STOP_SHARE = 0.390625, 0.5
ATTENUATION_DB = 100.0  # in the stop band
LOWEST_HZ = 20.0
# first halves of symmetric taps, by oversampling
STORED = Path(__file__).with_name("low_pass.json")


def usable_band(sampling_rate: float) -> tuple[float, float]:
    """Band in Hz in which the recorded signal is flat to 0.01 dB.

    All aliases are below -100 dB.
    """
    return 0.0, PASS_SHARE * sampling_rate


@dataclass(frozen=True, slots=True)
class Decimator:
    """Linear-phase low-pass and the reach of its taps to either side, in output samples."""

    taps: Array
    oversampling: int
    margin: int

    def padded(self, precision: str) -> NDArray[Any]:
        """Taps as the compiled low-pass takes them."""
        return np.pad(self.taps, (TOGETHER - 1) * self.oversampling).astype(precision)

    def apply(self, means: Array) -> Array:
        """Mean values over internal steps to samples at the output rate.

        Parameters
        ----------
        means : (step, channel, lane)    the first step ends ``margin`` output samples before
            the first output sample

        Returns
        -------
        (lane, channel, sample)
        """
        n_steps, n_channels, n_lanes = means.shape
        n_samples = (n_steps - 1) // self.oversampling - 2 * self.margin
        out = np.empty((n_samples, n_channels, n_lanes), dtype=means.dtype)
        taps = self.padded(means.dtype.name)
        flat, step = means.ravel(), self.oversampling
        low_pass(flat, 1, taps, step, n_channels, n_samples, out.ravel(), 0)
        return np.ascontiguousarray(out.transpose(2, 1, 0), dtype=np.float64)

    def apply_to_columns(self, means: Array) -> Array:
        """The same for a plain table: means (step, column) to samples (sample, column)."""
        n_steps, n_columns = means.shape
        n_groups = -(-n_columns // LANES)
        padded = np.zeros((n_steps, n_groups, LANES))
        padded.reshape(n_steps, -1)[:, :n_columns] = means
        samples = self.apply(padded).transpose(2, 1, 0)
        return samples.reshape(len(samples), -1)[:, :n_columns]


@lru_cache(maxsize=16)
def decimator(oversampling: int) -> Decimator:
    """The low-pass of ``design``.

    Those of the default are stored, because the import of scipy.signal takes longer than a record.
    """
    stored = json.loads(STORED.read_text("utf-8")).get(str(oversampling))
    if stored is None:
        return design(oversampling)
    taps = np.array([*stored, *reversed(stored)])
    return Decimator(taps, oversampling, len(stored) // oversampling)


def design(oversampling: int) -> Decimator:
    """Kaiser-window design: pass to 0.39 of the output rate, stop from half of it.

    An even number of taps puts samples at the ends of steps, whose means are centred half a step
    earlier. The pass band compensates the attenuation of the mean over a step (0.03 dB at 20 kHz
    for 8 steps a sample). A stop band from where aliases reach the pass band would need half the
    taps. But it would leave mesh harmonics of 20 to 31 kHz in 20 to 25.6 kHz, between the mesh
    lines, where residuals show them.
    """
    from scipy.signal import firwin2, kaiserord

    nyquist = 0.5 * oversampling  # in units of the output rate
    n_taps, beta = kaiserord(ATTENUATION_DB, (STOP_SHARE - PASS_SHARE) / nyquist)
    margin = math.ceil(0.5 * n_taps / oversampling)
    middle = 0.5 * (PASS_SHARE + STOP_SHARE)
    frequency = np.append(np.linspace(0.0, middle, 65), [middle, nyquist])
    gain = np.append(1.0 / np.sinc(frequency[:65] / oversampling), [0.0, 0.0])
    n_grid = max(16385, 1 + 2 ** math.ceil(math.log2(256 * oversampling)))
    window = ("kaiser", beta)
    length, rate = 2 * margin * oversampling, 2.0 * nyquist
    taps = firwin2(length, frequency, gain, nfreqs=n_grid, window=window, fs=rate)
    return Decimator(taps, oversampling, margin)


def in_band_error(signal: Array, exact: Array, sampling_rate: float) -> Array:
    """Largest relative error of a channel's spectrum, (lane,).

    From 20 Hz to the end of the usable band, under a Hann window; 0 for channels without any
    signal. A value does not depend on the other lanes.

    Parameters
    ----------
    signal, exact : (lane, channel, sample)
    """
    if exact.shape[:2] == (1, 1):
        # numpy sums a single spectrum in another order than several side by side
        twice = np.repeat(signal, 2, axis=0), np.repeat(exact, 2, axis=0)
        return in_band_error(*twice, sampling_rate)[:1]
    n_samples = exact.shape[-1]
    frequency = np.fft.rfftfreq(n_samples, 1.0 / sampling_rate)
    inside = (frequency >= LOWEST_HZ) & (frequency <= usable_band(sampling_rate)[1])
    window = np.hanning(n_samples)
    spectra = [
        np.fft.rfft(values * window, axis=-1)[..., inside]
        for values in (signal - exact, exact)
    ]
    off, level = (np.linalg.norm(spectrum, axis=-1) for spectrum in spectra)
    ratio = np.divide(off, level, out=np.zeros_like(off), where=level != 0.0)
    return np.asarray(ratio.max(axis=-1))
