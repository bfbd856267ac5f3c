"""Noise of a sensor: parts mixed by their shares of the power and set to one level."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.sensing.noise_parts import (
    Background,
    FromFile,
    Hum,
    Impulsive,
    Machine,
    Part,
    Pink,
    Receiver,
    Spectrum,
    ThroughPath,
    White,
    band_power,
    unit_power,
)
from gensig.signals.recording import STANDARD_GRAVITY
from gensig.units import is_number, read_kind

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

# keys that set the level of the noise whatever the signal is
LEVELS = ("level_m_per_s2", "density_ug_per_sqrt_hz", "file_level")


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Parts of the noise, the band in which its power counts, and its level.

    Attributes
    ----------
    parts : kinds of noise with their shares of the power
    band : (low, high) in Hz in which the power of the noise counts; None is the whole band
    offsets : dB, one a sensor, by which the noise of that sensor is louder; None is 0 dB
    level_m_per_s2 : RMS in the band
    density_ug_per_sqrt_hz : root of the mean power density over the band, in 1e-6 g / sqrt(Hz)
    file_level : True for the level of the file of its only part

    At most one of the last three is given. Without any, the noise follows the signal by
    ``sensing.snr_db``.
    """

    parts: tuple[Part, ...]
    band: tuple[float, ...] | None = None
    offsets: tuple[float, ...] | None = None
    level_m_per_s2: float | None = None
    density_ug_per_sqrt_hz: float | None = None
    file_level: bool = False

    def __post_init__(self) -> None:
        if not self.parts:
            raise ConfigError(
                "sensing.noise.parts = [] has no part; "
                "give one, or sensing.snr_db=null for no noise"
            )
        self._check_level()
        if self.band is None:
            return
        if len(self.band) != 2 or not 0.0 <= self.band[0] < self.band[1]:
            raise ConfigError(
                f"sensing.noise.band_hz = {list(self.band)} must be [low, high], ordered, or null"
            )
        if not any(part.is_broad for part in self.parts):
            raise ConfigError(
                "sensing.noise.band_hz: tones alone may miss the band; "
                "add a part such as white, or null"
            )

    def _check_level(self) -> None:
        given = [key for key in LEVELS if getattr(self, key) not in (None, False)]
        if len(given) > 1:
            raise ConfigError(
                f"sensing.noise: {' and '.join(given)} both set the level; give one"
            )
        for key in LEVELS[:2]:
            value = getattr(self, key)
            if value is not None and not (value > 0.0 and math.isfinite(value)):
                raise ConfigError(
                    f"sensing.noise.{key} = {value:g} must be positive, or null"
                )
        is_of_file = len(self.parts) == 1 and isinstance(self.parts[0], FromFile)
        if self.file_level and not is_of_file:
            raise ConfigError(
                "sensing.noise.file_level: the level of a file needs one part of kind "
                "file or spectrum, and no other"
            )

    @property
    def level_key(self) -> str:
        """Key that sets the level whatever the signal is; empty where none does."""
        for key in LEVELS:
            if getattr(self, key) not in (None, False):
                return key
        return ""

    def absolute_power(self, receiver: Receiver) -> Array | None:
        """Mean square in the band whatever the signal is, (sensor,) (m/s2)^2.

        None where the noise follows the signal.
        """
        power = self._power_before_offsets(receiver)
        if power is None or self.offsets is None:
            return power
        return np.asarray(power * 10.0 ** (np.array(self.offsets) / 10.0))

    def _power_before_offsets(self, receiver: Receiver) -> Array | None:
        part = self.parts[0]
        if self.file_level and isinstance(part, FromFile):
            return part.power(receiver, self.band)
        if self.level_m_per_s2 is not None:
            return np.full(len(receiver.sensors), self.level_m_per_s2**2)
        if self.density_ug_per_sqrt_hz is None:
            return None
        low, high = self.band or (0.0, 0.5 * receiver.sampling_rate)
        root_density = 1e-6 * STANDARD_GRAVITY * self.density_ug_per_sqrt_hz
        return np.full(len(receiver.sensors), root_density**2 * (high - low))

    @property
    def is_white(self) -> bool:
        """True for white noise over the whole band and nothing else."""
        return self.band is None and all(isinstance(part, White) for part in self.parts)

    def make(self, power: Array, rng: np.random.Generator, receiver: Receiver) -> Array:
        """Noise with exactly the mean square ``power`` (sensor,) in the band, (sensor, sample)."""
        total = sum(part.share for part in self.parts)
        mixed = np.zeros(receiver.shape)
        for part in self.parts:
            signal = unit_power(part.make(rng, receiver))
            mixed += math.sqrt(part.share / total) * signal
        made = band_power(mixed, receiver.sampling_rate, self.band)
        return np.asarray(mixed * np.sqrt(power / np.maximum(made, 1e-300))[:, None])


def read_noise(values: Any) -> Noise:
    """Noise of a configuration.

    Raises
    ------
    ConfigError    for unknown kinds, keys or values, naming the part
    """
    where = "sensing.noise"
    optional = {"offsets_db", *LEVELS}
    needed = {"parts", "band_hz"}
    if not isinstance(values, Mapping) or set(values) - optional != needed:
        raise ConfigError(
            f"{where} must be a group of the keys parts and band_hz, and may have "
            f"{', '.join(sorted(optional))}"
        )
    parts = values["parts"]
    if not isinstance(parts, list | tuple):
        raise ConfigError(
            f"{where}.parts = {parts!r} must be a list, such as [{{kind: white, share: 1}}]"
        )
    return Noise(
        parts=tuple(
            read_kind(PARTS, part, f"{where}.parts[{index}]")
            for index, part in enumerate(parts)
        ),
        band=_numbers(f"{where}.band_hz", values["band_hz"], "[low, high] in Hz"),
        offsets=_numbers(
            f"{where}.offsets_db",
            values.get("offsets_db"),
            "a list of numbers, one a sensor",
        ),
        level_m_per_s2=_number(values, "level_m_per_s2"),
        density_ug_per_sqrt_hz=_number(values, "density_ug_per_sqrt_hz"),
        file_level=_flag(values, "file_level"),
    )


def _number(values: Mapping[str, Any], key: str) -> float | None:
    value = values.get(key)
    if value is None:
        return None
    if not is_number(value):
        raise ConfigError(f"sensing.noise.{key} = {value!r} must be a number, or null")
    return float(value)


def _flag(values: Mapping[str, Any], key: str) -> bool:
    value = values.get(key, False)
    if not isinstance(value, bool):
        raise ConfigError(f"sensing.noise.{key} = {value!r} must be true or false")
    return value


def _numbers(key: str, value: Any, what: str) -> tuple[float, ...] | None:
    if value is None:
        return None
    if not isinstance(value, list | tuple) or not all(map(is_number, value)):
        raise ConfigError(f"{key} = {value!r} must be {what}, or null")
    return tuple(map(float, value))
