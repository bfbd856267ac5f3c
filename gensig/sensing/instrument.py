"""Instrument of one gearbox: its transfer path and sensors, from bearings to the record."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from gensig.arrays import Array
from gensig.sensing.accelerometer import SensorSet, draw_sensors
from gensig.sensing.chain import (
    LONGEST_LEAD,
    Sensing,
    add_noise,
    power,
    transverse_channel,
)
from gensig.sensing.dropped import draw_dropped, filled
from gensig.sensing.gain_drift import draw_drift
from gensig.sensing.measured_path import ImpulseResponses
from gensig.sensing.noise_parts import band_power
from gensig.sensing.transfer_path import Housing, ModalPath, draw_housing


@dataclass(frozen=True, slots=True, kw_only=True)
class Instrument:
    """Drawn path and sensors of one gearbox; None where its part of the chain changes nothing."""

    sensing: Sensing
    path: Housing | ImpulseResponses | None
    sensors: SensorSet | None

    def measure(self, source: Array) -> Array:
        """Output of the sensors before noise and conversion.

        Linear. Filters start from rest and settle in the first ``sensing.n_lead`` samples, which
        are left out.

        Parameters
        ----------
        source : (channel, n_lead + sample) m/s2    accelerations at the bearings, in any order
            in memory

        Returns
        -------
        (sensor, sample) m/s2    in C order, as sums along it need for equal bits
        """
        sensor, sensors = self.sensing.sensor, self.sensors
        filters = sensor is not None and sensors is not None and not sensor.is_ideal
        source = np.ascontiguousarray(source)
        if self.path is None and not filters:
            return source
        lines = self._at_sensors(source)
        n_sensors = len(self.sensing.channel_names)
        signal = lines[:n_sensors]
        if sensor is not None and sensors is not None and filters:
            if sensor.transverse_sensitivity:
                signal = signal + sensors.transverse[:, None] * lines[n_sensors:]
            signal = sensor.filtered(
                sensors.gain[:, None] * signal, self.sensing.sampling_rate
            )
        return np.ascontiguousarray(signal[:, self.sensing.n_lead :])

    def drifted(self, signal: Array, rng: np.random.Generator) -> Array:
        """Output of sensors whose gain drifts over one record, (sensor, sample) m/s2.

        The signal itself where none drifts.
        """
        sensor, rate = self.sensing.sensor, self.sensing.sampling_rate
        if sensor is None or not sensor.drift_scatter:
            return signal
        n_sensors, n_samples = signal.shape
        scatter, lasting = sensor.drift_scatter, sensor.drift_time
        return signal * draw_drift(rng, scatter, lasting, n_sensors, n_samples, rate)

    def power(self, signal: Array) -> Array:
        """Mean square without the mean in the band of the signal-to-noise ratio.

        (sensor,) (m/s2)^2.
        """
        noise = self.sensing.noise
        if noise is None:
            return power(signal)
        return band_power(signal, self.sensing.sampling_rate, noise.band)

    def record(
        self, clean: Array, noise_power: Array, rng: np.random.Generator
    ) -> tuple[Array, float]:
        """Record with noise of the given power in the band, offset and converter.

        Returns the signal, (sensor, sample), and the share of samples that clip.
        """
        noise, sensor = self.sensing.noise, self.sensing.sensor
        noisy = clean
        if noise is None or noise.is_white:
            noisy = add_noise(clean, noise_power, rng)
        elif np.any(noise_power > 0.0):
            receiver = self.sensing.receiver(clean.shape[1])
            if self.path is not None:
                coloured = partial(self._coloured, self.path, clean.shape[1])
                receiver = replace(receiver, through_path=coloured)
            noisy = clean + noise.make(noise_power, rng, receiver)
        if sensor is None:
            return noisy, 0.0
        if sensor.dc_offset_m_per_s2 and self.sensors is not None:
            noisy = noisy + self.sensors.offset[:, None]
        return sensor.digitised(noisy)

    def transmitted(
        self, signal: Array, rng: np.random.Generator
    ) -> tuple[Array, float]:
        """Record as it reaches the file, (sensor, sample), and the share of lost samples.

        Losses are filled.
        """
        sensor = self.sensing.sensor
        if sensor is None or not sensor.dropped_fraction:
            return signal, 0.0
        dropped = draw_dropped(
            rng, sensor.dropped_fraction, sensor.dropped_run_samples, signal.shape[1]
        )
        return filled(signal, dropped, sensor.dropped_fill), float(np.mean(dropped))

    def _at_sensors(self, source: Array) -> Array:
        """Motion along the sensors' main axes, then, where known, across them, (line, sample)."""
        if self.path is not None:
            return self.path.apply(source, self.sensing.sampling_rate)
        sensor, names = self.sensing.sensor, self.sensing.channels
        if sensor is None or not sensor.transverse_sensitivity:
            return source
        across = [names.index(transverse_channel(name)) for name in names]
        return np.concatenate([source, source[across]])

    def _coloured(
        self,
        path: Housing | ImpulseResponses,
        n_samples: int,
        rng: np.random.Generator,
    ) -> Array:
        """White noise at the bearings as the sensors hear it through the path."""
        rate, n_channels = self.sensing.sampling_rate, len(self.sensing.channels)
        n_lead = math.ceil(min(path.memory, LONGEST_LEAD) * rate)
        source = rng.standard_normal((n_channels, n_lead + n_samples))
        lines = path.apply(source, rate)
        return lines[: len(self.sensing.channel_names), n_lead:]


def draw_instrument(
    sensing: Sensing, path_rng: np.random.Generator, sensor_rng: np.random.Generator
) -> Instrument:
    """Transfer path and sensors of one gearbox, each from separate random numbers."""
    n_sensors = len(sensing.channel_names)
    path: Housing | ImpulseResponses | None = None
    if isinstance(sensing.path, ModalPath):
        path = draw_housing(path_rng, sensing.path, len(sensing.channels), n_sensors)
    elif sensing.path is not None:
        path = sensing.responses(sensing.path)
    sensors = None
    if sensing.sensor is not None:
        sensors = draw_sensors(sensor_rng, sensing.sensor, n_sensors)
    return Instrument(sensing=sensing, path=path, sensors=sensors)
