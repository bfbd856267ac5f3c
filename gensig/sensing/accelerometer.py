"""The accelerometer on its mount, and the converter behind it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.sensing.dropped import FILLS
from gensig.sensing.transfer_path import SETTLED
from gensig.units import unit

Array = NDArray[np.float64]

LONGEST_LOW = 0.1  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Accelerometer:
    """Properties of all sensors of a data set; null or 0 leaves one out.

    ``sensitivity_tolerance`` and ``transverse_sensitivity`` are the largest shares,
    ``dc_offset_m_per_s2`` the largest offset; each sensor of a gearbox has its own. A record
    whose share of samples at the ends of the converter's range is above ``max_clipped_fraction``
    is marked. Gains drift over a record by ``drift_scatter``, see ``drift``; samples get lost in
    runs of ``dropped_run_samples``, see ``dropped``.
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
        for key in ("sensitivity_tolerance", "transverse_sensitivity"):
            if not 0.0 <= getattr(self, key) <= 0.5:
                raise ConfigError(
                    f"sensing.sensor.{key} = {getattr(self, key):g} must lie in 0..0.5"
                )
        if (
            self.mounted_resonance is not None
            and not 1e3 <= self.mounted_resonance <= 1e6
        ):
            raise ConfigError(
                f"sensing.sensor.mounted_resonance_hz = {self.mounted_resonance:g} must lie in 1e3..1e6, or be null"
            )
        if not 1e-3 <= self.resonance_damping_ratio < 1.0:
            raise ConfigError(
                f"sensing.sensor.resonance_damping_ratio = {self.resonance_damping_ratio:g} must lie in 0.001..1"
            )
        if self.low_cutoff is not None and not 0.01 <= self.low_cutoff <= 100.0:
            raise ConfigError(
                f"sensing.sensor.low_cutoff_hz = {self.low_cutoff:g} must lie in 0.01..100 Hz, or be null"
            )
        if not 0.0 <= self.dc_offset_m_per_s2 <= 1e6:
            raise ConfigError(
                f"sensing.sensor.dc_offset_m_per_s2 = {self.dc_offset_m_per_s2:g} must not be negative"
            )
        if (self.adc_range_m_per_s2 is None) != (self.adc_bits is None):
            raise ConfigError(
                "sensing.sensor: give both adc_range_m_per_s2 and adc_bits, or null for both"
            )
        if self.adc_range_m_per_s2 is not None and not self.adc_range_m_per_s2 > 0.0:
            raise ConfigError(
                f"sensing.sensor.adc_range_m_per_s2 = {self.adc_range_m_per_s2:g} must be positive"
            )
        if self.adc_bits is not None and not 4 <= self.adc_bits <= 24:
            raise ConfigError(
                f"sensing.sensor.adc_bits = {self.adc_bits} must lie in 4..24"
            )
        if not 0.0 <= self.max_clipped_fraction <= 1.0:
            raise ConfigError(
                f"sensing.sensor.max_clipped_fraction = {self.max_clipped_fraction:g} must lie in 0..1"
            )
        self._check_drift_and_loss()

    def _check_drift_and_loss(self) -> None:
        for key, value, low, high in (
            ("drift_scatter", self.drift_scatter, 0.0, 0.5),
            ("drift_time_s", self.drift_time, 0.1, 1e6),
            ("dropped_fraction", self.dropped_fraction, 0.0, 0.5),
            ("dropped_run_samples", self.dropped_run_samples, 1, 1_000_000),
        ):
            if not low <= value <= high:
                raise ConfigError(
                    f"sensing.sensor.{key} = {value:g} must lie in {low:g}..{high:g}"
                )
        if self.dropped_fill not in FILLS:
            raise ConfigError(
                f"sensing.sensor.dropped_fill = {self.dropped_fill!r}; allowed: {', '.join(FILLS)}"
            )

    @property
    def is_ideal(self) -> bool:
        """Whether it reports the motion at its place as it is, offset and converter apart."""
        filters = self.mounted_resonance is not None or self.low_cutoff is not None
        return not (
            filters or self.sensitivity_tolerance or self.transverse_sensitivity
        )

    @property
    def memory(self) -> float:
        """Time in which filters settle, s; 0 where nothing is filtered.

        The low cut-off would take long, but has little to settle from: accelerations hold next to
        nothing so low.
        """
        slowest = (
            0.0
            if self.low_cutoff is None
            else SETTLED / (2.0 * math.pi * self.low_cutoff)
        )
        return max(min(slowest, LONGEST_LOW), self.memory_of_resonance)

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

        The resonance may lie above half the sampling rate, where no recursive filter has it: the
        spectrum is multiplied by w^2 / (w^2 - W^2 + 2 i zeta w W), exact at every frequency that
        the signal has.
        """
        from scipy.signal import butter, sosfilt

        if self.mounted_resonance is not None:
            from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

            n_samples = signal.shape[1]
            n_padded = next_fast_len(
                n_samples + math.ceil(self.memory_of_resonance * sampling_rate),
                real=True,
            )
            ratio = rfftfreq(n_padded, 1.0 / sampling_rate) / self.mounted_resonance
            response = 1.0 / (
                1.0 - ratio**2 + 2j * self.resonance_damping_ratio * ratio
            )
            signal = irfft(rfft(signal, n_padded, axis=1) * response, n_padded, axis=1)[
                :, :n_samples
            ]
        if self.low_cutoff is not None:
            signal = sosfilt(
                butter(1, self.low_cutoff, "highpass", fs=sampling_rate, output="sos"),
                signal,
                axis=1,
            )
        return signal

    def digitised(self, signal: Array) -> tuple[Array, float]:
        """What the converter gives, and the share of samples that lie outside its range.

        (sensor, sample).
        """
        if self.adc_range_m_per_s2 is None or self.adc_bits is None:
            return signal, 0.0
        half = 2 ** (self.adc_bits - 1)
        step = self.adc_range_m_per_s2 / half
        counts = np.rint(signal / step)
        outside = (counts < -half) | (counts > half - 1)
        return step * np.clip(counts, -half, half - 1), float(np.mean(outside))


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSet:
    """The sensors of one gearbox, (sensor,) each.

    Gain, share of the transverse motion, offset in m/s2.
    """

    gain: Array
    transverse: Array
    offset: Array


def draw_sensors(
    rng: np.random.Generator, sensor: Accelerometer, n_sensors: int
) -> SensorSet:
    """Uniform within what the data sheet allows."""
    gain, transverse, offset = rng.uniform(-1.0, 1.0, (3, n_sensors))
    return SensorSet(
        gain=1.0 + sensor.sensitivity_tolerance * gain,
        transverse=sensor.transverse_sensitivity * transverse,
        offset=sensor.dc_offset_m_per_s2 * offset,
    )
