"""Transfer path and sensors of one gearbox.

From its bearings' accelerations to what is recorded of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

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
from gensig.sensing.measured_path import ImpulseResponses, read_responses
from gensig.sensing.noise import band_power
from gensig.sensing.transfer_path import Housing, ModalPath, draw_housing

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Instrument:
    """What was drawn for one gearbox; None where its part of the chain changes nothing."""

    sensing: Sensing
    path: Housing | ImpulseResponses | None
    sensors: SensorSet | None

    def measure(self, source: Array) -> Array:
        """What the sensors put out before noise and conversion.

        Linear. Filters start from rest and settle in the first ``sensing.n_lead`` samples, which
        are left out.

        Parameters
        ----------
        source : (channel, n_lead + sample) m/s2    accelerations at the bearings

        Returns
        -------
        (sensor, sample) m/s2
        """
        sensor = self.sensing.sensor
        filters = sensor is not None and not sensor.is_ideal
        if self.path is None and not filters:
            return source
        lines = self._at_sensors(source)
        n_sensors = len(self.sensing.channel_names)
        signal = lines[:n_sensors]
        if filters and sensor is not None and self.sensors is not None:
            if sensor.transverse_sensitivity:
                signal = signal + self.sensors.transverse[:, None] * lines[n_sensors:]
            signal = sensor.filtered(
                self.sensors.gain[:, None] * signal, self.sensing.sampling_rate
            )
        return np.ascontiguousarray(signal[:, self.sensing.n_lead :])

    def drift(self, n_samples: int, rng: np.random.Generator) -> Array:
        """Factor of each sensor's gain over one record, (sensor, sample), or (1, 1) of 1 where
        none drifts.
        """
        sensor, n_sensors = self.sensing.sensor, len(self.sensing.channel_names)
        if sensor is None or not sensor.drift_scatter:
            return np.ones((1, 1))
        rate = self.sensing.sampling_rate
        return draw_drift(
            rng, sensor.drift_scatter, sensor.drift_time, n_sensors, n_samples, rate
        )

    def power(self, signal: Array) -> Array:
        """Mean square without the mean in the band of the signal-to-noise ratio, (sensor,)
        (m/s2)^2.
        """
        noise = self.sensing.noise
        return (
            power(signal)
            if noise is None
            else band_power(signal, self.sensing.sampling_rate, noise.band)
        )

    def record(
        self, clean: Array, noise_power: Array, rng: np.random.Generator
    ) -> tuple[Array, float]:
        """Noise of the given power in the band added, offset and converter applied.

        And the share that clips.
        """
        noise, sensor = self.sensing.noise, self.sensing.sensor
        if noise is None or noise.is_white:
            noisy = add_noise(clean, noise_power, rng)
        elif np.any(noise_power > 0.0):
            place = self.sensing.place(clean.shape[1])
            if self.path is not None:
                place = replace(
                    place, through_path=lambda own: self._coloured(own, clean.shape[1])
                )
            noisy = clean + noise.make(noise_power, rng, place)
        else:
            noisy = clean
        if sensor is None:
            return noisy, 0.0
        if sensor.dc_offset_m_per_s2 and self.sensors is not None:
            noisy = noisy + self.sensors.offset[:, None]
        return sensor.digitised(noisy)

    def sent(self, signal: Array, rng: np.random.Generator) -> tuple[Array, float]:
        """What of a record, (sensor, sample), reaches the file, losses filled.

        And the share of samples that do not.
        """
        sensor = self.sensing.sensor
        if sensor is None or not sensor.dropped_fraction:
            return signal, 0.0
        dropped = draw_dropped(
            rng, sensor.dropped_fraction, sensor.dropped_run_samples, signal.shape[1]
        )
        return filled(signal, dropped, sensor.dropped_fill), float(np.mean(dropped))

    def _at_sensors(self, source: Array) -> Array:
        """Motion along the sensors' own axes, then, where it is known, across them, (line,
        sample).
        """
        if self.path is not None:
            return self.path.apply(source, self.sensing.sampling_rate)
        sensor, names = self.sensing.sensor, self.sensing.channels
        if sensor is None or not sensor.transverse_sensitivity:
            return source
        return np.concatenate(
            [source, source[[names.index(transverse_channel(name)) for name in names]]]
        )

    def _coloured(self, rng: np.random.Generator, n_samples: int) -> Array:
        if self.path is None:
            raise ValueError("noise coloured by the path needs one")
        n_lead = math.ceil(
            min(self.path.memory, LONGEST_LEAD) * self.sensing.sampling_rate
        )
        source = rng.standard_normal((len(self.sensing.channels), n_lead + n_samples))
        lines = self.path.apply(source, self.sensing.sampling_rate)
        return lines[: len(self.sensing.channel_names), n_lead:]


def draw_instrument(
    sensing: Sensing, path_rng: np.random.Generator, sensor_rng: np.random.Generator
) -> Instrument:
    """Transfer path and sensors of one gearbox, each from its own random numbers."""
    n_sensors = len(sensing.channel_names)
    path: Housing | ImpulseResponses | None = None
    if isinstance(sensing.path, ModalPath):
        path = draw_housing(path_rng, sensing.path, len(sensing.channels), n_sensors)
    elif sensing.path is not None:
        path = read_responses(
            sensing.path, sensing.channels, sensing.channel_names, sensing.sampling_rate
        )
    sensors = (
        None
        if sensing.sensor is None
        else draw_sensors(sensor_rng, sensing.sensor, n_sensors)
    )
    return Instrument(sensing=sensing, path=path, sensors=sensors)
