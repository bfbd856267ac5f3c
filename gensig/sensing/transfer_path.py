"""Transfer paths from the bearings to the sensors, and modes of the housing.

A path is none, a bank of housing modes (here), or one that a user measured (``measured_path``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.units import check_limits, check_positive, check_ranges, unit

GROUP = "sensing.path."
MOST_MODES = 200
SETTLED = 5.0  # time constants after which 0.7 % of a transient is left


@dataclass(frozen=True, slots=True, kw_only=True)
class ModalPath:
    """Ranges from which the housing of a gearbox is drawn, [low, high] each.

    The number of modes is uniform over whole numbers. Frequencies and damping ratios are uniform
    in their logarithm. ``transmissibility`` is the RMS gain from one bearing channel to a sensor
    well below all modes.
    """

    n_modes: tuple[int, ...]
    natural_frequency: tuple[float, ...] = unit("hz")
    damping_ratio: tuple[float, ...]
    transmissibility: float

    def __post_init__(self) -> None:
        check_ranges(
            self,
            GROUP,
            n_modes=(1, MOST_MODES),
            natural_frequency=(1.0, 1e6),
            damping_ratio=(1e-4, 0.5),
        )
        check_positive(self, GROUP, "transmissibility")
        check_limits(self, GROUP, transmissibility=(0.0, 1e3))

    @property
    def memory(self) -> float:
        """Time after which 0.7 % of the slowest mode that can be drawn is left, s."""
        return SETTLED / (
            2.0 * math.pi * self.natural_frequency[0] * self.damping_ratio[0]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Housing:
    """Modes of one housing.

    ``natural_frequency`` (mode,) Hz, ``damping_ratio`` (mode,). ``from_bearings`` (mode, channel)
    and ``to_sensors`` (line, mode) are the participations. The lines are the sensors' main axes,
    then their transverse axes.
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
        """Accelerations at the sensors from those at the bearings.

        (channel, sample) to (line, sample). Each mode is the ramp-invariant form of
        w^2 / (s^2 + 2 zeta w s + w^2): exact for inputs that go straight from sample to sample,
        with poles where the continuous ones are. Linear and causal.
        """
        from scipy.signal import sosfilt

        out = np.zeros((len(self.to_sensors), source.shape[1]))
        modes = zip(self.natural_frequency, self.damping_ratio, strict=True)
        for mode, (frequency, damping) in enumerate(modes):
            section = mode_section(float(frequency), float(damping), sampling_rate)
            response = sosfilt(section, self.from_bearings[mode] @ source)
            out += self.to_sensors[:, mode, None] * response
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
    """Modes of one gearbox, sorted by frequency.

    Participations are normal in sign and size.
    """
    n_modes = int(rng.integers(path.n_modes[0], path.n_modes[1], endpoint=True))

    def logarithmic(ends: tuple[float, ...]) -> Array:
        return np.exp(rng.uniform(math.log(ends[0]), math.log(ends[1]), n_modes))

    frequency = np.sort(logarithmic(path.natural_frequency))
    damping = logarithmic(path.damping_ratio)
    scale = path.transmissibility / math.sqrt(n_modes)
    return Housing(
        natural_frequency=frequency,
        damping_ratio=damping,
        from_bearings=rng.standard_normal((n_modes, n_channels)),
        to_sensors=scale * rng.standard_normal((2 * n_sensors, n_modes)),
    )
