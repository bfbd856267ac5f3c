"""Accelerometers on their mounts, and the converter behind them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.sensing.dropped import FILLS
from gensig.sensing.transfer_path import SETTLED
from gensig.units import check_choice, check_limits, check_positive, unit

LONGEST_LOW = 0.1  # s
GROUP = "sensing.sensor."
LIMITS = {
    "sensitivity_tolerance": (0.0, 0.5),
    "transverse_sensitivity": (0.0, 0.5),
    "mounted_resonance": (1e3, 1e6),
    "resonance_damping_ratio": (1e-3, 1.0),
    "low_cutoff": (0.01, 100.0),
    "dc_offset_m_per_s2": (0.0, 1e6),
    "adc_bits": (4, 24),
    "max_clipped_fraction": (0.0, 1.0),
    "drift_scatter": (0.0, 0.5),
    "drift_time": (0.1, 1e6),
    "dropped_fraction": (0.0, 0.5),
    "dropped_run_samples": (1, 1_000_000),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Accelerometer:
    """Properties of all sensors of a data set; null or 0 leaves one out.

    ``sensitivity_tolerance`` and ``transverse_sensitivity`` are the largest shares,
    ``dc_offset_m_per_s2`` is the largest offset. Each sensor of a gearbox draws its values
    within them. A record is marked when more than ``max_clipped_fraction`` of its samples lie at
    the ends of the converter's range. Gains drift over a record by ``drift_scatter``, see
    ``gain_drift``. Samples get lost in runs of ``dropped_run_samples``, see ``dropped``.
    """

    sensitivity_tolerance: float
    transverse_sensitivity: float
    mounted_resonance: float | None = unit("hz")
    resonance_damping_ratio: float
    low_cutoff: float | None = unit("hz")
    dc_offset_m_per_s2: float
    adc_range_m_per_s2: float | None
    adc_bits: int | None
    max_clipped_fraction: float
    drift_scatter: float
    drift_time: float = unit("s")
    dropped_fraction: float
    dropped_run_samples: int
    dropped_fill: str

    def __post_init__(self) -> None:
        check_limits(self, GROUP, **LIMITS)
        check_positive(self, GROUP, "adc_range_m_per_s2")
        check_choice(f"{GROUP}dropped_fill", self.dropped_fill, FILLS)
        if (self.adc_range_m_per_s2 is None) != (self.adc_bits is None):
            raise ConfigError(
                "sensing.sensor: give both adc_range_m_per_s2 and adc_bits, or null for both"
            )

    @property
    def is_ideal(self) -> bool:
        """True where it reports the motion unchanged, offset and converter apart."""
        filters = self.mounted_resonance is not None or self.low_cutoff is not None
        return not (
            filters or self.sensitivity_tolerance or self.transverse_sensitivity
        )

    @property
    def memory(self) -> float:
        """Time in which filters settle, s; 0 where nothing is filtered.

        The low cut-off takes at most ``LONGEST_LOW``: accelerations hold next to nothing so low.
        """
        longest = self.memory_of_resonance
        if self.low_cutoff is not None:
            slowest = SETTLED / (2.0 * math.pi * self.low_cutoff)
            longest = max(min(slowest, LONGEST_LOW), longest)
        return longest

    @property
    def memory_of_resonance(self) -> float:
        """Time after which 0.7 % of the mounted resonance's ringing is left, s."""
        if self.mounted_resonance is None:
            return 0.0
        return SETTLED / (
            2.0 * math.pi * self.mounted_resonance * self.resonance_damping_ratio
        )

    def filtered(self, signal: Array, sampling_rate: float) -> Array:
        """Mounted resonance and low cut-off, (sensor, sample).

        The resonance may lie above half the sampling rate, where no recursive filter has it. So
        the spectrum is multiplied by w^2 / (w^2 - W^2 + 2 i zeta w W), exact at every frequency
        that the signal has.
        """
        from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
        from scipy.signal import butter, sosfilt

        if self.mounted_resonance is not None:
            n_samples = signal.shape[1]
            n_tail = math.ceil(self.memory_of_resonance * sampling_rate)
            n_padded = next_fast_len(n_samples + n_tail, real=True)
            ratio = rfftfreq(n_padded, 1.0 / sampling_rate) / self.mounted_resonance
            response = 1.0 / (
                1.0 - ratio**2 + 2j * self.resonance_damping_ratio * ratio
            )
            padded = irfft(rfft(signal, n_padded, axis=1) * response, n_padded, axis=1)
            signal = padded[:, :n_samples]
        if self.low_cutoff is not None:
            sections = butter(
                1, self.low_cutoff, "highpass", fs=sampling_rate, output="sos"
            )
            signal = sosfilt(sections, signal, axis=1)
        return signal

    def digitised(self, signal: Array) -> tuple[Array, float]:
        """Converter output, (sensor, sample), and share of samples outside its range."""
        if self.adc_range_m_per_s2 is None or self.adc_bits is None:
            return signal, 0.0
        half = 2 ** (self.adc_bits - 1)
        step = self.adc_range_m_per_s2 / half
        counts = np.rint(signal / step)
        outside = (counts < -half) | (counts > half - 1)
        return step * np.clip(counts, -half, half - 1), float(np.mean(outside))


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSet:
    """Sensors of one gearbox, (sensor,) each.

    Gain, share of the transverse motion, offset in m/s2.
    """

    gain: Array
    transverse: Array
    offset: Array


def draw_sensors(
    rng: np.random.Generator, sensor: Accelerometer, n_sensors: int
) -> SensorSet:
    """Sensors drawn uniformly within the limits of the data sheet."""
    gain, transverse, offset = rng.uniform(-1.0, 1.0, (3, n_sensors))
    return SensorSet(
        gain=1.0 + sensor.sensitivity_tolerance * gain,
        transverse=sensor.transverse_sensitivity * transverse,
        offset=sensor.dc_offset_m_per_s2 * offset,
    )
