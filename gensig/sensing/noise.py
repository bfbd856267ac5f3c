"""What else a sensor hears.

Parts of noise, mixed by their shares of the power and set to one level.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError
from gensig.sensing.transfer_path import SETTLED, mode_section
from gensig.text.user_file import check_columns, check_rate, read_table
from gensig.units import read, unit

Array = NDArray[np.float64]

BLOCK = 256  # samples
SIDEBAND = 0.5  # assumed; amplitude of the first pair of sidebands of another machine's tones, over the tone's


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where noise is heard.

    Names of the sensors, samples, rate, and white noise at the bearings as they hear it.
    """

    sensors: tuple[str, ...]
    n_samples: int
    sampling_rate: float
    through_path: Callable[[np.random.Generator], Array] | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """(sensor, sample)."""
        return len(self.sensors), self.n_samples


@dataclass(frozen=True, slots=True, kw_only=True)
class Part(ABC):
    """One part of the noise; ``share`` is its power beside those of the others."""

    share: float

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if (
                isinstance(value, int | float)
                and not value > 0
                and name != "frequency_scatter"
            ):
                raise ConfigError(f"{name} = {value:g} must be positive")

    @property
    def is_broad(self) -> bool:
        """Whether any band has some of it."""
        return True

    @abstractmethod
    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """The noise at any level, (sensor, sample)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class White(Part):
    """Gaussian, independent from sensor to sensor."""

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        return rng.standard_normal(place.shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pink(Part):
    """Gaussian, power density 1 / f above ``lowest``, even below."""

    lowest: float = unit("hz")

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        frequency = np.fft.rfftfreq(place.n_samples, 1.0 / place.sampling_rate)
        spectrum = np.fft.rfft(rng.standard_normal(place.shape), axis=1)
        return np.fft.irfft(
            spectrum / np.sqrt(np.maximum(frequency, self.lowest)),
            place.n_samples,
            axis=1,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ThroughPath(Part):
    """White noise at the bearings, coloured by the transfer path; sensors hear the same sources."""

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        if place.through_path is None:
            raise ValueError("noise coloured by the path needs one")
        return place.through_path(rng)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hum(Part):
    """Mains pick-up.

    Harmonic k has the amplitude 1 / k (assumed) and its own phase in each sensor.
    """

    mains: float = unit("hz")
    n_harmonics: int

    @property
    def is_broad(self) -> bool:
        """As ``Part.is_broad``."""
        return False

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        harmonic = np.arange(1.0, self.n_harmonics + 1.0)
        return tones(rng, place, self.mains * harmonic, 1.0 / harmonic)


@dataclass(frozen=True, slots=True, kw_only=True)
class Impulsive(Part):
    """Knocks at random instants (Poisson, at least one), normal in size, each ringing at one
    mode.
    """

    knocks: float = unit("hz")
    ring: float = unit("hz")
    damping_ratio: float

    def __post_init__(self) -> None:
        Part.__post_init__(self)
        if not 1e-3 <= self.damping_ratio < 1.0:
            raise ConfigError(
                f"damping_ratio = {self.damping_ratio:g} must lie in 0.001..1"
            )

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        from scipy.signal import sosfilt

        rate = place.sampling_rate
        before = math.ceil(
            SETTLED / (2.0 * math.pi * self.ring * self.damping_ratio) * rate
        )
        force = np.zeros((len(place.sensors), before + place.n_samples))
        n_knocks = rng.poisson(self.knocks * force.shape[1] / rate)
        for instant in rng.integers(0, force.shape[1], n_knocks).tolist():
            force[:, instant] += rng.standard_normal(len(force))
        force[:, before + rng.integers(place.n_samples)] += rng.standard_normal(
            len(force)
        )
        return np.asarray(
            sosfilt(mode_section(self.ring, self.damping_ratio, rate), force, axis=1)[
                :, before:
            ]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine(Part):
    """Another machine: shaft orders, a bearing's tone family and a mesh, a third of the power each.

    Harmonic k has the amplitude 1 / k, bearing and mesh tones have sidebands at one shaft order
    (assumed). ``frequency_scatter`` is the largest share by which its speed differs in a record.
    Tones above the usable band are left out.
    """

    shaft: float = unit("hz")
    frequency_scatter: float
    n_shaft_orders: int
    bearing_order: float
    n_bearing_harmonics: int
    n_teeth: int
    n_mesh_harmonics: int

    def __post_init__(self) -> None:
        Part.__post_init__(self)
        if not 0.0 <= self.frequency_scatter <= 0.5:
            raise ConfigError(
                f"frequency_scatter = {self.frequency_scatter:g} must lie in 0..0.5"
            )

    @property
    def is_broad(self) -> bool:
        """As ``Part.is_broad``."""
        return False

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        shaft = self.shaft * (1.0 + self.frequency_scatter * rng.uniform(-1.0, 1.0))
        out = np.zeros(place.shape)
        families = (
            (1.0, self.n_shaft_orders, 0.0),
            (self.bearing_order, self.n_bearing_harmonics, SIDEBAND),
            (float(self.n_teeth), self.n_mesh_harmonics, SIDEBAND),
        )
        for order, n_harmonics, sideband in families:
            harmonic = np.arange(1, n_harmonics + 1)
            offsets = np.array([-1.0, 0.0, 1.0]) if sideband else np.zeros(1)
            weight = np.where(offsets == 0.0, 1.0, sideband)
            orders = (order * harmonic[:, None] + offsets).ravel()
            amplitude = (weight / harmonic[:, None]).ravel()
            heard = (orders > 0.0) & (
                orders * shaft <= usable_band(place.sampling_rate)[1]
            )
            family = tones(rng, place, shaft * orders[heard], amplitude[heard])
            out += unit_power(family)
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class Background(Part):
    """A recording of a user: ``time_s`` and one column a sensor, or one column ``background`` for
    all.

    A record takes a stretch that begins anywhere; with one column each sensor takes its own.
    """

    file: str

    def table(self, place: Place) -> tuple[list[str], Array]:
        """The recording, (column, sample), checked against the sensors, rate and length of a
        record.
        """
        return _background(
            self.file, place.sensors, place.n_samples, place.sampling_rate
        )

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        names, values = self.table(place)
        last = values.shape[1] - place.n_samples
        if names == ["background"]:
            starts = rng.integers(0, last, len(place.sensors), endpoint=True)
            return np.stack(
                [values[0, start : start + place.n_samples] for start in starts]
            )
        start = int(rng.integers(0, last, endpoint=True))
        return np.stack(
            [
                values[names.index(name), start : start + place.n_samples]
                for name in place.sensors
            ]
        )


@lru_cache(maxsize=4)
def _background(
    file: str, sensors: tuple[str, ...], n_samples: int, sampling_rate: float
) -> tuple[list[str], Array]:
    key = "sensing.noise: file"
    names, values = read_table(key, file, least_rows=max(2, n_samples))
    wanted = ["background"] if "background" in names else list(sensors)
    check_columns(key, file, names, ["time_s", *wanted])
    check_rate(key, file, values[names.index("time_s")], sampling_rate)
    columns = np.stack([values[names.index(name)] for name in wanted])
    if not np.all(np.ptp(columns, axis=1) > 0.0):
        raise ConfigError(
            f"{key} = {file}: a column holds one value throughout; give what a sensor heard"
        )
    return wanted, columns


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum(Part):
    """Gaussian noise of a given power density: a file with ``frequency_hz`` and one column a
    sensor, or ``background``.

    Only the form of a column counts; its level is that of ``sensing.snr_db``. It is linear
    between the lines given and held beyond them. Every record and sensor has its own noise.
    """

    file: str

    def density(self, place: Place) -> tuple[Array, Array]:
        """Frequencies (line,) in Hz and densities (sensor, line), checked against the sensors of
        a record.
        """
        return _spectrum(self.file, place.sensors)

    def make(self, rng: np.random.Generator, place: Place) -> Array:
        """As ``Part.make``."""
        frequency, density = self.density(place)
        grid = np.fft.rfftfreq(place.n_samples, 1.0 / place.sampling_rate)
        size = np.sqrt([np.interp(grid, frequency, row) for row in density])
        return np.fft.irfft(
            size * np.fft.rfft(rng.standard_normal(place.shape), axis=1),
            place.n_samples,
            axis=1,
        )


@lru_cache(maxsize=4)
def _spectrum(file: str, sensors: tuple[str, ...]) -> tuple[Array, Array]:
    key = "sensing.noise: file"
    names, values = read_table(key, file, least_rows=2)
    wanted = ["background"] * len(sensors) if "background" in names else list(sensors)
    check_columns(key, file, names, ["frequency_hz", *dict.fromkeys(wanted)])
    frequency = values[names.index("frequency_hz")]
    density = values[[names.index(name) for name in wanted]]
    if frequency[0] < 0.0 or not np.all(np.diff(frequency) > 0.0):
        raise ConfigError(
            f"{key} = {file}: frequency_hz must rise from line to line and not be negative"
        )
    if density.min() < 0.0 or not np.all(density.max(axis=1) > 0.0):
        raise ConfigError(
            f"{key} = {file}: a power density must not be negative, nor 0 throughout"
        )
    return frequency, density


PARTS: dict[str, type[Part]] = {
    "white": White,
    "pink": Pink,
    "path": ThroughPath,
    "hum": Hum,
    "impulsive": Impulsive,
    "machine": Machine,
    "file": Background,
    "spectrum": Spectrum,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Parts of the noise, and the band over which the signal-to-noise ratio is meant, (low, high)
    in Hz or all.

    ``offsets`` in dB, one a sensor: that sensor's noise is so much louder than ``sensing.snr_db``
    says. None is 0 dB.
    """

    parts: tuple[Part, ...]
    band: tuple[float, ...] | None = None
    offsets: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not self.parts:
            raise ConfigError(
                "sensing.noise.parts = [] has no part; give one, or sensing.snr_db=null for no noise"
            )
        if self.band is not None and (
            len(self.band) != 2 or not 0.0 <= self.band[0] < self.band[1]
        ):
            raise ConfigError(
                f"sensing.noise.band_hz = {list(self.band)} must be [low, high], ordered, or null"
            )
        if self.band is not None and not any(part.is_broad for part in self.parts):
            raise ConfigError(
                "sensing.noise.band_hz: tones alone may miss the band; add a part such as white, or null"
            )

    @property
    def is_white(self) -> bool:
        """Whether it is white noise over the whole band and nothing else."""
        return self.band is None and all(isinstance(part, White) for part in self.parts)

    def make(self, power: Array, rng: np.random.Generator, place: Place) -> Array:
        """Noise with a mean square of ``power`` (sensor,) in the band, exactly, (sensor, sample)."""
        total = sum(part.share for part in self.parts)
        mixed = np.zeros(place.shape)
        for part in self.parts:
            mixed += math.sqrt(part.share / total) * unit_power(part.make(rng, place))
        found = band_power(mixed, place.sampling_rate, self.band)
        return np.asarray(mixed * np.sqrt(power / np.maximum(found, 1e-300))[:, None])


def read_noise(values: Any) -> Noise:
    """Noise of a configuration.

    Raises
    ------
    ConfigError    for unknown kinds, keys or values, naming the part
    """
    where = "sensing.noise"
    if not isinstance(values, Mapping) or set(values) - {"offsets_db"} != {
        "parts",
        "band_hz",
    }:
        raise ConfigError(
            f"{where} must be a group of the keys parts and band_hz, and may have offsets_db"
        )
    if not isinstance(values["parts"], list | tuple):
        raise ConfigError(
            f"{where}.parts = {values['parts']!r} must be a list, such as [{{kind: white, share: 1}}]"
        )
    parts = []
    for number, part in enumerate(values["parts"]):
        place = f"{where}.parts[{number}]"
        kind = part.get("kind") if isinstance(part, Mapping) else None
        if kind not in PARTS:
            raise ConfigError(f"{place}: kind = {kind!r}; allowed: {', '.join(PARTS)}")
        try:
            parts.append(
                read(
                    PARTS[kind],
                    {key: value for key, value in part.items() if key != "kind"},
                    place,
                )
            )
        except ConfigError as error:
            text = str(error)
            raise ConfigError(
                text if text.startswith(place) else f"{place}.{text}"
            ) from None
    band = _numbers(f"{where}.band_hz", values["band_hz"], "[low, high] in Hz")
    offsets = _numbers(
        f"{where}.offsets_db",
        values.get("offsets_db"),
        "a list of numbers, one a sensor",
    )
    return Noise(parts=tuple(parts), band=band, offsets=offsets)


def _numbers(key: str, value: Any, what: str) -> tuple[float, ...] | None:
    if value is None:
        return None
    if not isinstance(value, list | tuple) or not all(
        isinstance(one, int | float)
        and not isinstance(one, bool)
        and math.isfinite(one)
        for one in value
    ):
        raise ConfigError(f"{key} = {value!r} must be {what}, or null")
    return tuple(float(one) for one in value)


def tones(
    rng: np.random.Generator, place: Place, frequency: Array, amplitude: Array
) -> Array:
    """Sum of tones, each with a random phase in each sensor, (sensor, sample)."""
    blocks = np.arange(-(-place.n_samples // BLOCK))[:, None] * BLOCK
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(place.sensors), len(frequency)))
    out = np.zeros(place.shape)
    for number, (one, size) in enumerate(zip(frequency, amplitude, strict=True)):
        step = 2j * np.pi * one / place.sampling_rate
        # e^(i w t) as a product: two short tables in place of as many functions as samples
        turning = (np.exp(step * blocks) * np.exp(step * np.arange(BLOCK))).ravel()[
            : place.n_samples
        ]
        phase = phases[:, number, None]
        out += size * (np.cos(phase) * turning.real - np.sin(phase) * turning.imag)
    return out


def unit_power(signal: Array) -> Array:
    """The signal without its mean at mean square 1; one that is still stays so."""
    centred = signal - signal.mean(axis=1, keepdims=True)
    level = np.sqrt(np.mean(centred**2, axis=1, keepdims=True))
    return np.asarray(
        np.divide(centred, level, out=np.zeros_like(centred), where=level > 0.0)
    )


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
