"""Kinds of noise of a sensor, each at a level of its own; mixed and scaled in ``noise``."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import ClassVar

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError
from gensig.sensing.tones import Limits
from gensig.sensing.transfer_path import SETTLED, mode_section
from gensig.text.user_file import check_columns, check_rate, read_table
from gensig.units import check_limits, check_positive, unit

BLOCK = 256  # samples
# assumed; amplitude of the first pair of sidebands of another machine's tones, over the tone's
SIDEBAND = 0.5
FILE_KEY = "sensing.noise: file"
SHARED = "background"  # column of a file that stands for all sensors


@dataclass(frozen=True, slots=True, kw_only=True)
class Receiver:
    """Sensors that hear the noise of one record.

    ``through_path`` makes white noise at the bearings as the sensors hear it.
    """

    sensors: tuple[str, ...]
    n_samples: int
    sampling_rate: float
    through_path: Callable[[np.random.Generator], Array] | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """(sensor, sample)."""
        return len(self.sensors), self.n_samples

    @property
    def frequency(self) -> Array:
        """Frequencies of the record's spectrum, (line,) Hz."""
        step = 1.0 / self.sampling_rate
        return np.asarray(np.fft.rfftfreq(self.n_samples, step), dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Part(ABC):
    """One part of the noise.

    ``share`` is its power relative to the other parts. ``limits`` are those of fields that need
    not be positive only; ``is_broad`` is True where any band has some of the noise.
    """

    limits: ClassVar[Limits] = {}
    is_broad: ClassVar[bool] = True
    share: float

    def __post_init__(self) -> None:
        names = [field.name for field in fields(self) if field.name != "file"]
        check_positive(self, "", *(name for name in names if name not in self.limits))
        check_limits(self, "", **self.limits)

    @abstractmethod
    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """Noise at any level, (sensor, sample)."""

    def check(self, receiver: Receiver) -> None:  # noqa: B027  most parts have no file
        """Raise ConfigError where a user's file does not fit the sensors of a record."""


@dataclass(frozen=True, slots=True, kw_only=True)
class White(Part):
    """Gaussian, independent from sensor to sensor."""

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        return rng.standard_normal(receiver.shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pink(Part):
    """Gaussian, power density 1 / f above ``lowest``, even below."""

    lowest: float = unit("hz")

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        spectrum = np.fft.rfft(rng.standard_normal(receiver.shape), axis=1)
        pink = spectrum / np.sqrt(np.maximum(receiver.frequency, self.lowest))
        return np.fft.irfft(pink, receiver.n_samples, axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ThroughPath(Part):
    """White noise at the bearings, coloured by the transfer path; sensors hear the same sources."""

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        if receiver.through_path is None:
            raise ValueError("noise coloured by the path needs one")
        return receiver.through_path(rng)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hum(Part):
    """Mains pick-up.

    Harmonic k has the amplitude 1 / k (assumed) and a separate phase in each sensor.
    """

    is_broad = False
    mains: float = unit("hz")
    n_harmonics: int

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        harmonic = np.arange(1.0, self.n_harmonics + 1.0)
        return tones(rng, receiver, self.mains * harmonic, 1.0 / harmonic)


@dataclass(frozen=True, slots=True, kw_only=True)
class Impulsive(Part):
    """Knocks at random instants, normal in size, each ringing at one mode.

    The instants are Poisson distributed; a record has at least one.
    """

    limits: ClassVar[Limits] = {"damping_ratio": (1e-3, 1.0)}
    knocks: float = unit("hz")
    ring: float = unit("hz")
    damping_ratio: float

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        from scipy.signal import sosfilt

        rate, n_sensors = receiver.sampling_rate, len(receiver.sensors)
        settling = SETTLED / (2.0 * math.pi * self.ring * self.damping_ratio)
        n_before = math.ceil(settling * rate)
        force = np.zeros((n_sensors, n_before + receiver.n_samples))
        n_knocks = rng.poisson(self.knocks * force.shape[1] / rate)
        for instant in rng.integers(0, force.shape[1], n_knocks).tolist():
            force[:, instant] += rng.standard_normal(n_sensors)
        certain = n_before + rng.integers(receiver.n_samples)
        force[:, certain] += rng.standard_normal(n_sensors)
        section = mode_section(self.ring, self.damping_ratio, rate)
        return np.asarray(sosfilt(section, force, axis=1)[:, n_before:])


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine(Part):
    """Another machine: shaft orders, a bearing's tone family and a mesh, a third of the power each.

    Harmonic k has the amplitude 1 / k. Bearing and mesh tones have sidebands at one shaft order
    (assumed). ``frequency_scatter`` is the largest share by which its speed differs in a record.
    Tones above the usable band are left out.
    """

    is_broad = False
    limits: ClassVar[Limits] = {"frequency_scatter": (0.0, 0.5)}
    shaft: float = unit("hz")
    frequency_scatter: float
    n_shaft_orders: int
    bearing_order: float
    n_bearing_harmonics: int
    n_teeth: int
    n_mesh_harmonics: int

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        shaft = self.shaft * (1.0 + self.frequency_scatter * rng.uniform(-1.0, 1.0))
        highest = usable_band(receiver.sampling_rate)[1]
        alone = {0.0: 1.0}  # amplitude over the harmonic's, by offset in shaft orders
        modulated = {-1.0: SIDEBAND, 0.0: 1.0, 1.0: SIDEBAND}
        families = (
            (1.0, self.n_shaft_orders, alone),
            (self.bearing_order, self.n_bearing_harmonics, modulated),
            (float(self.n_teeth), self.n_mesh_harmonics, modulated),
        )
        out = np.zeros(receiver.shape)
        for order, n_harmonics, lines in families:
            harmonic = np.arange(1, n_harmonics + 1)[:, None]
            orders = (order * harmonic + list(lines)).ravel()
            amplitude = (np.array(list(lines.values())) / harmonic).ravel()
            heard = (orders > 0.0) & (orders * shaft <= highest)
            family = tones(rng, receiver, shaft * orders[heard], amplitude[heard])
            out += unit_power(family)
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class FromFile(Part):
    """Noise like that in a file of a user, in m/s2."""

    file: str

    @abstractmethod
    def power(self, receiver: Receiver, band: tuple[float, ...] | None) -> Array:
        """Mean square of the file's noise in a band, (sensor,) (m/s2)^2; None is all of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Background(FromFile):
    """Recording of a user: ``time_s`` and one column a sensor, or one column ``background``.

    A record takes a stretch that begins anywhere. With one column for all sensors, each sensor
    takes a different stretch.
    """

    def power(self, receiver: Receiver, band: tuple[float, ...] | None) -> Array:
        """As ``FromFile.power``, of the whole recording."""
        columns, _ = _background(self.file, receiver)
        return band_power(columns, receiver.sampling_rate, band)

    def check(self, receiver: Receiver) -> None:
        """As ``Part.check``."""
        _background(self.file, receiver)

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        columns, is_shared = _background(self.file, receiver)
        n_samples, n_sensors = receiver.n_samples, len(columns)
        last = columns.shape[1] - n_samples
        if is_shared:
            starts = rng.integers(0, last, n_sensors, endpoint=True).tolist()
        else:
            starts = [int(rng.integers(0, last, endpoint=True))] * n_sensors
        stretches = zip(columns, starts, strict=True)
        return np.stack([row[start : start + n_samples] for row, start in stretches])


def _background(file: str, receiver: Receiver) -> tuple[Array, bool]:
    """Recording of each sensor, (sensor, sample), and True where it is one for all."""
    time, columns, is_shared = _user_columns(
        file, "time_s", receiver.sensors, max(2, receiver.n_samples)
    )
    check_rate(FILE_KEY, file, time, receiver.sampling_rate)
    if not np.all(np.ptp(columns, axis=1) > 0.0):
        raise ConfigError(
            f"{FILE_KEY} = {file}: a column holds one value throughout; give what a sensor heard"
        )
    return columns, is_shared


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum(FromFile):
    """Gaussian noise of a given power density.

    The file has ``frequency_hz`` and one column a sensor, or ``background``, in (m/s2)^2/Hz. The
    density is linear between the lines given and held beyond them. Noise differs between records
    and sensors.
    """

    def power(self, receiver: Receiver, band: tuple[float, ...] | None) -> Array:
        """As ``FromFile.power``: the integral of the density over the lines of a record."""
        grid = receiver.frequency
        inside = grid > 0.0
        if band is not None:
            inside &= (grid >= band[0]) & (grid <= band[1])
        step = receiver.sampling_rate / receiver.n_samples
        return np.asarray(step * np.sum(self._density(receiver)[:, inside], axis=1))

    def check(self, receiver: Receiver) -> None:
        """As ``Part.check``."""
        _spectrum(self.file, receiver.sensors)

    def _density(self, receiver: Receiver) -> Array:
        """Density at the frequencies of a record's spectrum, (sensor, line)."""
        frequency, density = _spectrum(self.file, receiver.sensors)
        grid = receiver.frequency
        return np.array([np.interp(grid, frequency, row) for row in density])

    def make(self, rng: np.random.Generator, receiver: Receiver) -> Array:
        """As ``Part.make``."""
        size = np.sqrt(self._density(receiver))
        spectrum = size * np.fft.rfft(rng.standard_normal(receiver.shape), axis=1)
        return np.fft.irfft(spectrum, receiver.n_samples, axis=1)


def _spectrum(file: str, sensors: tuple[str, ...]) -> tuple[Array, Array]:
    """Frequencies (line,) in Hz and densities (sensor, line)."""
    frequency, density, _ = _user_columns(file, "frequency_hz", sensors, 2)
    if frequency[0] < 0.0 or not np.all(np.diff(frequency) > 0.0):
        raise ConfigError(
            f"{FILE_KEY} = {file}: frequency_hz must rise from line to line and not be negative"
        )
    if density.min() < 0.0 or not np.all(density.max(axis=1) > 0.0):
        raise ConfigError(
            f"{FILE_KEY} = {file}: a power density must not be negative, nor 0 throughout"
        )
    return frequency, density


@lru_cache(maxsize=4)
def _user_columns(
    file: str, axis: str, sensors: tuple[str, ...], least_rows: int
) -> tuple[Array, Array, bool]:
    """Axis (row,) and columns (sensor, row) of a file; True where sensors share one column."""
    names, values = read_table(FILE_KEY, file, least_rows=least_rows)
    is_shared = SHARED in names
    wanted = list(sensors)
    if is_shared:
        wanted = [SHARED] * len(sensors)
    check_columns(FILE_KEY, file, names, [axis, *dict.fromkeys(wanted)])
    columns = values[[names.index(name) for name in wanted]]
    return values[names.index(axis)], columns, is_shared


def tones(
    rng: np.random.Generator, receiver: Receiver, frequency: Array, amplitude: Array
) -> Array:
    """Sum of tones, each with a random phase in each sensor, (sensor, sample)."""
    n_samples = receiver.n_samples
    blocks = np.arange(-(-n_samples // BLOCK))[:, None] * BLOCK
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(receiver.sensors), len(frequency)))
    out = np.zeros(receiver.shape)
    for number, (line, size) in enumerate(zip(frequency, amplitude, strict=True)):
        step = 2j * np.pi * line / receiver.sampling_rate
        # e^(i w t) as a product: two short tables in place of as many functions as samples
        table = np.exp(step * blocks) * np.exp(step * np.arange(BLOCK))
        rotating = table.ravel()[:n_samples]
        phase = phases[:, number, None]
        out += size * (np.cos(phase) * rotating.real - np.sin(phase) * rotating.imag)
    return out


def unit_power(signal: Array) -> Array:
    """Signal without its mean at mean square 1; silence stays silence."""
    centred = signal - signal.mean(axis=1, keepdims=True)
    level = np.sqrt(np.mean(centred**2, axis=1, keepdims=True))
    silence = np.zeros_like(centred)
    return np.asarray(np.divide(centred, level, out=silence, where=level > 0.0))


def band_power(
    signal: Array, sampling_rate: float, band: tuple[float, ...] | None
) -> Array:
    """Mean square without the mean, in a band with both its ends, (sensor,).

    None is the whole band.
    """
    if band is None:
        return np.var(signal, axis=-1)
    n_samples = signal.shape[-1]
    frequency = np.fft.rfftfreq(n_samples, 1.0 / sampling_rate)
    inside = (frequency >= band[0]) & (frequency <= band[1]) & (frequency > 0.0)
    lines = np.abs(np.fft.rfft(signal, axis=-1)) ** 2 * (2.0 / n_samples**2)
    if n_samples % 2 == 0:
        lines[..., -1] *= 0.5
    return np.asarray(np.sum(lines[..., inside], axis=-1))
