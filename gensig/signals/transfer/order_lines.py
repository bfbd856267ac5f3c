"""Separation of what turns with the gears: power at the orders of both shafts, density between."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array, Flags
from gensig.signals.mesh_motion import Teeth
from gensig.signals.resampling import PASS_SHARE

# bins to either side of a line in which a Hann window leaves 99.9 % of its power
SPREAD = 2
FINER = 2  # upsampling before the interpolation to angle, whose error grows towards half the rate
BANDS_AN_OCTAVE = 12
# octaves to either side; a mode of 5 % damping is a seventh of an octave wide
HALF_BAND = 1.0 / 12.0
LEAST_FREE = 40  # bins free of lines on which a floor rests


@dataclass(frozen=True, slots=True, kw_only=True)
class Lines:
    """Power spectrum over mesh orders of signals sampled evenly in the angle of the mesh.

    ``power`` (sensor, bin) (m/s2)^2, ``frequency`` (bin,) Hz at the mean speed, ``is_line``
    (bin,) True at the orders of either shaft, ``floor`` (sensor, bin) (m/s2)^2 the median power
    of bins without lines, as a mean.
    """

    power: Array
    floor: Array
    frequency: Array
    is_line: Flags
    n_cycles: int
    mesh_frequency: float

    @property
    def synchronous(self) -> Array:
        """Power that turns with the gears, above the floor, (sensor, bin) (m/s2)^2."""
        return np.where(self.is_line, self.power - self.floor, 0.0)

    @property
    def width(self) -> float:
        """Width of a bin, Hz."""
        return float(self.frequency[1])

    def at(self, orders: Array) -> Array:
        """Power above the floor of the lines at some mesh orders, (sensor, order) (m/s2)^2.

        It may be negative.
        """
        center = np.rint(orders * self.n_cycles).astype(np.intp)[:, None]
        bins = np.clip(
            center + np.arange(-SPREAD, SPREAD + 1), 0, len(self.frequency) - 1
        )
        return np.asarray((self.power - self.floor)[:, bins].sum(axis=2))


def find_lines(
    signal: Array, cycles: Array, sampling_rate: float, teeth: Teeth
) -> Lines:
    """Order spectrum of signals whose mesh angle is known.

    Parameters
    ----------
    signal : (sensor, sample) m/s2
    cycles : (sample,)    mesh cycles since the first sample, rising

    Source of the angle resampling: K. R. Fyfe & E. D. S. Munck (1997), Mechanical Systems and
    Signal Processing 11 (2), 187-205; orders as ``gensig.signals.spectrum.order_spectrum``, for a
    speed that wanders.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import resample

    n_samples = signal.shape[1]
    turned = cycles - cycles[0]
    n_cycles = math.floor(turned[-1])
    mesh_frequency = float(turned[-1]) * sampling_rate / (n_samples - 1)
    per_cycle = math.ceil(1.1 * sampling_rate / mesh_frequency)
    wanted = np.arange(n_cycles * per_cycle) / per_cycle
    instants = np.interp(wanted, turned, np.arange(n_samples)) * FINER
    fine = resample(signal, FINER * n_samples, axis=1)
    even = CubicSpline(np.arange(fine.shape[1]), fine, axis=1)(instants)
    window = np.hanning(even.shape[1])
    power = np.abs(np.fft.rfft(even * window, axis=1)) ** 2 * (
        2.0 / (even.shape[1] * np.sum(window**2))
    )
    order = np.arange(power.shape[1]) / n_cycles
    frequency = order * mesh_frequency
    kept = frequency <= 0.5 * sampling_rate
    power, frequency, order = power[:, kept], frequency[kept], order[kept]
    is_line = np.zeros(len(order), dtype=bool)
    for n_teeth in (teeth.driving, teeth.driven):
        turns = order * n_teeth
        distance = np.abs(turns - np.rint(turns)) * n_cycles / n_teeth  # bins
        is_line |= distance <= SPREAD + 0.5
    return Lines(
        power=power,
        floor=_floor(power, is_line),
        frequency=frequency,
        is_line=is_line,
        n_cycles=n_cycles,
        mesh_frequency=mesh_frequency,
    )


def _floor(power: Array, is_line: Flags) -> Array:
    """Mean of noise in stretches of bins without lines, (sensor, bin).

    It is the median over ln 2, which lines of others do not raise.
    """
    free = np.flatnonzero(~is_line)
    stretches = np.array_split(free, max(1, len(free) // LEAST_FREE))
    middle = np.array([stretch.mean() for stretch in stretches])
    medians = [np.median(power[:, stretch], axis=1) for stretch in stretches]
    levels = np.stack(medians, axis=1) / math.log(2.0)
    bins = np.arange(power.shape[1])
    return np.stack([np.interp(bins, middle, row) for row in levels])


def band_centers(lowest: float, sampling_rate: float) -> Array:
    """Centers of overlapping bands, twelve an octave, up to the usable band's end, (band,) Hz."""
    highest = PASS_SHARE * sampling_rate
    n_bands = max(2, math.floor(BANDS_AN_OCTAVE * math.log2(highest / lowest)) + 1)
    return np.asarray(highest * 2.0 ** (np.arange(-n_bands + 1, 1) / BANDS_AN_OCTAVE))


def band_sums(values: Array, frequency: Array, centers: Array) -> Array:
    """Sums over the sixth of an octave around each center, (row, bin) to (row, band)."""
    sums = np.pad(np.cumsum(values, axis=1), ((0, 0), (1, 0)))
    first = np.searchsorted(frequency, centers * 2.0**-HALF_BAND)
    last = np.searchsorted(frequency, centers * 2.0**HALF_BAND)
    return np.asarray(sums[:, last] - sums[:, first])
