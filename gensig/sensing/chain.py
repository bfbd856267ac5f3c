"""What stands between clean bearing accelerations and the record: transfer path, sensor, noise."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError
from gensig.sensing.accelerometer import Accelerometer
from gensig.sensing.encoder import Encoder
from gensig.sensing.measured_path import ImpulseResponses, MeasuredPath, read_responses
from gensig.sensing.noise import Background, Noise, Place, Spectrum, ThroughPath
from gensig.sensing.tachometer import Tachometer
from gensig.sensing.tones import Nuisance
from gensig.sensing.transfer_path import ModalPath
from gensig.units import TURNING, is_turning, unit

Array = NDArray[np.float64]

SNR_REFERENCES = ("healthy_twin", "record")
LONGEST_LEAD = 0.5  # s
SENSOR_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """What is simulated, what stands between it and the record, how fast and under how much noise
    that is recorded.

    ``channels`` are the simulated accelerations. Without a ``path`` they are what the sensors
    feel; else it leads from them to the ``sensors``. ``snr`` in dB; None records without noise.
    Its reference is the power of the same unit at the same condition without the fault
    (``healthy_twin``), so the floor cannot tell the class. None for ``sensor`` and ``noise``: an
    ideal one, and white noise over the whole band. ``nuisances`` shake the bearings of every
    class.
    """

    sampling_rate: float = unit("hz")
    channels: tuple[str, ...]
    snr: float | None = unit("db")
    snr_reference: str
    gain_scatter: float
    tacho: Tachometer
    encoder: Encoder
    sensors: tuple[str, ...] | None = None
    path: ModalPath | MeasuredPath | None = None
    sensor: Accelerometer | None = None
    noise: Noise | None = None
    nuisances: tuple[Nuisance, ...] = ()

    def __post_init__(self) -> None:
        if not 1000.0 <= self.sampling_rate <= 1e6:
            raise ConfigError(
                f"sensing.sampling_rate_hz = {self.sampling_rate:g} must lie in 1000..1000000"
            )
        if not self.channels or len(set(self.channels)) != len(self.channels):
            raise ConfigError(
                f"sensing.channels = {list(self.channels)} must name at least one channel, each once"
            )
        if self.snr_reference not in SNR_REFERENCES:
            raise ConfigError(
                f"sensing.snr_reference = {self.snr_reference!r}; allowed: {', '.join(SNR_REFERENCES)}"
            )
        if not 0.0 <= self.gain_scatter < 0.5:
            raise ConfigError(
                f"sensing.gain_scatter = {self.gain_scatter:g} must lie in 0..0.5"
            )
        self._check_path()
        self._check_sensor()
        if self.noise is not None:
            if (
                self.noise.band is not None
                and self.noise.band[1] > 0.5 * self.sampling_rate
            ):
                raise ConfigError(
                    f"sensing.noise.band_hz ends at {self.noise.band[1]:g} Hz, above half of "
                    f"sensing.sampling_rate_hz = {self.sampling_rate:g}; give "
                    f"'sensing.noise.band_hz=[{self.noise.band[0]:g},{0.5 * self.sampling_rate:g}]' or a higher rate"
                )
            if self.noise.offsets is not None and len(self.noise.offsets) != len(
                self.channel_names
            ):
                raise ConfigError(
                    f"sensing.noise.offsets_db has {len(self.noise.offsets)} values for {len(self.channel_names)} "
                    "sensors; give one a sensor, or null"
                )
            if self.path is None and any(
                isinstance(part, ThroughPath) for part in self.noise.parts
            ):
                raise ConfigError(
                    "sensing.noise: kind path needs a transfer path; sensing.path.kind = identity has none"
                )

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of what is recorded: the sensors, without a path the simulated channels."""
        return self.channels if self.sensors is None else self.sensors

    def noise_factor(self, snr: float) -> Array:
        """Power of the noise over that of its reference, (sensor,), at ``snr`` in dB."""
        offsets = None if self.noise is None else self.noise.offsets
        louder = (
            np.zeros(len(self.channel_names)) if offsets is None else np.array(offsets)
        )
        return 10.0 ** (-snr / 10.0) * 10.0 ** (louder / 10.0)

    @property
    def n_lead(self) -> int:
        """Samples before a record in which path and sensor settle."""
        memory = self.sensor.memory if self.sensor is not None else 0.0
        if isinstance(self.path, ModalPath):
            memory = max(memory, self.path.memory)
        elif self.path is not None:
            memory = max(memory, self._responses().memory)
        return math.ceil(min(memory, LONGEST_LEAD) * self.sampling_rate)

    @property
    def has_white_noise(self) -> bool:
        """Whether the noise is white over the whole band."""
        return self.noise is None or self.noise.is_white

    def place(self, n_samples: int) -> Place:
        """Where noise is heard."""
        return Place(
            sensors=self.channel_names,
            n_samples=n_samples,
            sampling_rate=self.sampling_rate,
        )

    def check(self, duration: float) -> None:
        """Read what users gave as files; ConfigError where they do not fit."""
        if isinstance(self.path, MeasuredPath):
            self._responses()
        for part in self.noise.parts if self.noise is not None else ():
            if isinstance(part, Background):
                part.table(self.place(round(duration * self.sampling_rate)))
            elif isinstance(part, Spectrum):
                part.density(self.place(round(duration * self.sampling_rate)))

    def _responses(self) -> ImpulseResponses:
        if not isinstance(self.path, MeasuredPath):
            raise ValueError("only a measured path has responses of a file")
        return read_responses(
            self.path, self.channels, self.channel_names, self.sampling_rate
        )

    def _check_path(self) -> None:
        if (self.path is None) != (self.sensors is None):
            raise ConfigError(
                "sensing.sensors names the places that a transfer path leads to: "
                + (
                    "leave it null with sensing.path.kind = identity"
                    if self.path is None
                    else "give at least one"
                )
            )
        if self.sensors is None:
            return
        if not self.sensors or len(set(self.sensors)) != len(self.sensors):
            raise ConfigError(
                f"sensing.sensors = {list(self.sensors)} must name at least one sensor, each once"
            )
        for name in self.sensors:
            if not SENSOR_NAME.fullmatch(name) or is_turning(name):
                raise ConfigError(
                    f"sensing.sensors: {name!r}; give letters, digits and _, at most 32, not ending in "
                    f"{', '.join(map(repr, TURNING))}"
                )
        if turning := [name for name in self.channels if is_turning(name)]:
            raise ConfigError(
                f"sensing.channels: {turning[0]} is no bearing; a transfer path takes bearing channels"
            )
        highest = usable_band(self.sampling_rate)[1]
        lowest = (
            self.path.natural_frequency[0] if isinstance(self.path, ModalPath) else 0.0
        )
        if (
            isinstance(self.path, ModalPath)
            and self.path.natural_frequency[1] > highest
        ):
            raise ConfigError(
                f"sensing.path.natural_frequency_hz reaches {self.path.natural_frequency[1]:g} Hz, above the usable "
                f"band of {highest:g} Hz at sensing.sampling_rate_hz = {self.sampling_rate:g}; give "
                + (
                    f"'sensing.path.natural_frequency_hz=[{lowest:g},{highest:g}]' or "
                    if lowest < highest
                    else ""
                )
                + f"a rate of at least {math.ceil(self.path.natural_frequency[1] / usable_band(1.0)[1])} Hz"
            )

    def _check_sensor(self) -> None:
        if self.sensor is None:
            return
        if (
            self.sensor.low_cutoff is not None
            and self.sensor.low_cutoff > 0.1 * self.sampling_rate
        ):
            raise ConfigError(
                f"sensing.sensor.low_cutoff_hz = {self.sensor.low_cutoff:g} is too near the sampling rate"
            )
        if not self.sensor.transverse_sensitivity:
            return
        if isinstance(self.path, MeasuredPath):
            raise ConfigError(
                "sensing.sensor.transverse_sensitivity: a measured path tells no transverse motion; give 0"
            )
        lonely = [
            name
            for name in self.channels
            if transverse_channel(name) not in self.channels
        ]
        if self.path is None and lonely:
            raise ConfigError(
                f"sensing.sensor.transverse_sensitivity: sensing.channels has {lonely[0]} without the other axis; "
                "add it, or give 0"
            )


def transverse_channel(name: str) -> str:
    """The channel across another at the same bearing: pinion_y for pinion_x.

    '' where there is none.
    """
    gear, _, axis = name.rpartition("_")
    return f"{gear}_{'y' if axis == 'x' else 'x'}" if axis in ("x", "y") else ""


def power(signal: Array) -> Array:
    """Mean square without the mean, (channel,) (m/s2)^2."""
    return np.var(signal, axis=-1)


def detectability(residual: Array, noise_power: Array) -> float:
    """How far the best possible detector tells a known residual from white noise: d' of a matched
    filter.

    Square root of the residual's energy over the noise power, summed over channels; NaN where a
    channel has no noise. With d' the detector is right in a share Phi(d' / 2) of equally many
    records with and without the fault: 0.69 at 1, 0.93 at 3. It knows unit, phase, load and speed
    of the record, and the fault; no classifier can do better.

    Parameters
    ----------
    residual : (channel, sample) m/s2    what the fault adds
    noise_power : (channel,) (m/s2)^2    variance of a sample's noise
    """
    if not np.all(noise_power > 0.0):
        return math.nan
    return math.sqrt(float(np.sum(np.sum(residual**2, axis=-1) / noise_power)))


def add_noise(clean: Array, noise_power: Array, rng: np.random.Generator) -> Array:
    """Add white Gaussian noise of the given power to each channel, (channel, sample)."""
    noisy = np.empty_like(clean)
    for own, signal, power_of_noise in zip(
        noisy, clean, noise_power, strict=True
    ):  # a channel stays in the cache
        rng.standard_normal(out=own)
        own *= math.sqrt(power_of_noise)
        own += signal
    return noisy
