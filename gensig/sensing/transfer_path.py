"""From the bearings to the sensor positions.

Nothing, a bank of housing modes, or what a user measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.units import unit

Array = NDArray[np.float64]

MOST_MODES = 200
SETTLED = 5.0  # time constants after which 0.7 % of a transient is left


@dataclass(frozen=True, slots=True, kw_only=True)
class ModalPath:
    """Ranges from which the housing of a gearbox is drawn, [low, high] each.

    The number of modes is uniform over whole numbers, frequencies and damping ratios are uniform
    in their logarithm. ``transmissibility`` is the RMS gain from one bearing channel to a sensor
    well below all modes.
    """

    n_modes: tuple[int, ...]
    natural_frequency: tuple[float, ...] = unit("hz")
    damping_ratio: tuple[float, ...]
    transmissibility: float

    def __post_init__(self) -> None:
        _check_range("n_modes", self.n_modes, 1, MOST_MODES)
        _check_range("natural_frequency_hz", self.natural_frequency, 1.0, 1e6)
        _check_range("damping_ratio", self.damping_ratio, 1e-4, 0.5)
        if not 0.0 < self.transmissibility <= 1e3:
            raise ConfigError(
                f"sensing.path.transmissibility = {self.transmissibility:g} must lie in 0..1000"
            )

    @property
    def memory(self) -> float:
        """Time after which 0.7 % of the slowest mode that can be drawn is left, s."""
        return SETTLED / (
            2.0 * math.pi * self.natural_frequency[0] * self.damping_ratio[0]
        )


def _check_range(key: str, ends: tuple[float, ...], least: float, most: float) -> None:
    if len(ends) != 2 or not least <= ends[0] <= ends[1] <= most:
        raise ConfigError(
            f"sensing.path.{key} = {list(ends)} must be two ordered numbers, [low, high], in {least:g}..{most:g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Housing:
    """The modes of one housing.

    ``natural_frequency`` (mode,) Hz, ``damping_ratio`` (mode,), ``from_bearings`` (mode, channel)
    and ``to_sensors`` (line, mode), the participations; the lines are the sensors' own axes, then
    their transverse axes.
    """

    natural_frequency: Array
    damping_ratio: Array
    from_bearings: Array
    to_sensors: Array

    @property
    def memory(self) -> float:
        """Time after which 0.7 % of the slowest mode is left, s."""
        return SETTLED / float(
            np.min(2.0 * np.pi * self.natural_frequency * self.damping_ratio)
        )

    def apply(self, source: Array, sampling_rate: float) -> Array:
        """Accelerations at the sensors from those at the bearings, (channel, sample) to (line,
        sample).

        Each mode is the ramp-invariant form of w^2 / (s^2 + 2 zeta w s + w^2): exact for inputs
        that go straight from sample to sample, poles where the continuous ones are. Linear and
        causal.
        """
        from scipy.signal import sosfilt

        out = np.zeros((len(self.to_sensors), source.shape[1]))
        for mode, (frequency, damping) in enumerate(
            zip(self.natural_frequency, self.damping_ratio, strict=True)
        ):
            section = mode_section(float(frequency), float(damping), sampling_rate)
            out += self.to_sensors[:, mode, None] * sosfilt(
                section, self.from_bearings[mode] @ source
            )
        return out


@lru_cache(maxsize=4096)
def mode_section(
    natural_frequency: float, damping_ratio: float, sampling_rate: float
) -> Array:
    """Second-order section of one mode with gain 1 at rest, (1, 6).

    Source: ramp invariance as in Smallwood (1981), which shock response spectra use (ISO 18431-4).
    """
    from scipy.signal import cont2discrete

    angular = 2.0 * math.pi * natural_frequency
    continuous = ([angular**2], [1.0, 2.0 * damping_ratio * angular, angular**2])
    numerator, denominator, _ = cont2discrete(
        continuous, 1.0 / sampling_rate, method="foh"
    )
    return np.concatenate([np.ravel(numerator), denominator])[None]


def draw_housing(
    rng: np.random.Generator, path: ModalPath, n_channels: int, n_sensors: int
) -> Housing:
    """The modes of one gearbox.

    Modes are sorted by frequency, signs and sizes of participations are normal.
    """
    n_modes = int(rng.integers(path.n_modes[0], path.n_modes[1], endpoint=True))

    def logarithmic(ends: tuple[float, ...]) -> Array:
        return np.exp(rng.uniform(math.log(ends[0]), math.log(ends[1]), n_modes))

    frequency, damping = (
        np.sort(logarithmic(path.natural_frequency)),
        logarithmic(path.damping_ratio),
    )
    scale = path.transmissibility / math.sqrt(n_modes)
    return Housing(
        natural_frequency=frequency,
        damping_ratio=damping,
        from_bearings=rng.standard_normal((n_modes, n_channels)),
        to_sensors=scale * rng.standard_normal((2 * n_sensors, n_modes)),
    )
