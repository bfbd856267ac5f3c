"""Sensing chain between clean bearing accelerations and the record: path, sensor, noise."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError
from gensig.sensing.accelerometer import Accelerometer
from gensig.sensing.encoder import Encoder
from gensig.sensing.measured_path import ImpulseResponses, MeasuredPath, read_responses
from gensig.sensing.noise import Noise
from gensig.sensing.noise_parts import Receiver, ThroughPath
from gensig.sensing.tachometer import Tachometer
from gensig.sensing.tones import Nuisance
from gensig.sensing.transfer_path import ModalPath
from gensig.units import (
    TURNING,
    channel_unit,
    check_choice,
    check_limits,
    is_turning,
    unit,
)

SNR_REFERENCES = ("healthy_twin", "record")
LONGEST_LEAD = 0.5  # s
HIGHEST_GAIN = 1e3  # of what faults add, 60 dB; assumed
SENSOR_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
CROSSED = {"x": "y", "y": "x"}
EVERY_BEARING = "bearings"  # in place of the channels: x and y of every gear
EVERY_Y = (
    "bearings_y"  # in place of the channels: y of every gear, along its line of action
)
IN_PLACE = {EVERY_BEARING: ("_x", "_y"), EVERY_Y: ("_y",)}


def stands_for_channels(channels: Sequence[str]) -> bool:
    """True for a single key of ``IN_PLACE``, which stands for channels of every gear."""
    return len(channels) == 1 and channels[0] in IN_PLACE


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Simulated channels, the chain from them to the record, its rate and its noise.

    ``channels`` are the simulated accelerations; a key of ``IN_PLACE`` alone stands for such
    of every gear until the machine is known (``of_machine``). Without a ``path`` the sensors feel
    these; a path leads from them to the ``sensors``. ``snr`` in dB; None records without noise,
    or with noise of a level that ``noise`` sets. Its reference is the power of the same unit at
    the same condition without the fault (``healthy_twin``), so the floor does not reveal the
    class. None for ``sensor`` is an ideal one, None for ``noise`` is white noise over the whole
    band. ``nuisances`` shake the bearings
    of every class. ``fault_gain`` is the factor of what faults add to the accelerations, a law of
    domain randomisation and no physics: 1 is the simulation, 0 the machine without its faults.
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
    # Came after 0.14.0: configurations of earlier data sets lack it.
    fault_gain: float = 1.0

    def __post_init__(self) -> None:
        check_limits(
            self,
            "sensing.",
            sampling_rate=(1e3, 1e6),
            gain_scatter=(0.0, 0.5),
            fault_gain=(0.0, HIGHEST_GAIN),
        )
        check_choice("sensing.snr_reference", self.snr_reference, SNR_REFERENCES)
        if not self.channels or len(set(self.channels)) != len(self.channels):
            raise ConfigError(
                f"sensing.channels = {list(self.channels)} must name at least one channel, "
                "each once"
            )
        self._check_path()
        self._check_sensor()
        if self.noise is not None:
            self._check_noise(self.noise)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the recorded channels: the sensors, or without a path the simulated ones."""
        if self.sensors is None:
            return self.channels
        return self.sensors

    def noise_factor(self, snr: float) -> Array:
        """Power of the noise over that of its reference, (sensor,), at ``snr`` in dB."""
        louder = np.zeros(len(self.channel_names))
        if self.noise is not None and self.noise.offsets is not None:
            louder = np.array(self.noise.offsets)
        return 10.0 ** (-snr / 10.0) * 10.0 ** (louder / 10.0)

    @property
    def has_noise(self) -> bool:
        """True where a record gets any noise."""
        is_absolute = self.noise is not None and self.noise.level_key != ""
        return self.snr is not None or is_absolute

    @property
    def noise_follows_twin(self) -> bool:
        """True where the healthy twin of a record decides the level of its noise."""
        return self.snr is not None and self.snr_reference == "healthy_twin"

    def noise_power(self, reference: Array, n_samples: int) -> Array:
        """Mean square of the noise in its band, (sensor,) (m/s2)^2.

        Parameters
        ----------
        reference : (sensor,) (m/s2)^2    power that the ratio ``snr`` refers to
        n_samples : samples of a record
        """
        if self.snr is not None:
            return np.asarray(reference * self.noise_factor(self.snr))
        absolute = None
        if self.noise is not None:
            absolute = self.noise.absolute_power(self.receiver(n_samples))
        if absolute is None:
            return np.zeros(len(self.channel_names))
        return absolute

    @property
    def n_lead(self) -> int:
        """Samples before a record in which path and sensor settle."""
        memory = 0.0
        if self.sensor is not None:
            memory = self.sensor.memory
        if isinstance(self.path, ModalPath):
            memory = max(memory, self.path.memory)
        elif self.path is not None:
            memory = max(memory, self.responses(self.path).memory)
        return math.ceil(min(memory, LONGEST_LEAD) * self.sampling_rate)

    @property
    def has_white_noise(self) -> bool:
        """True where the noise is white over the whole band."""
        return self.noise is None or self.noise.is_white

    def receiver(self, n_samples: int) -> Receiver:
        """Sensors of a record, as noise needs them."""
        return Receiver(
            sensors=self.channel_names,
            n_samples=n_samples,
            sampling_rate=self.sampling_rate,
        )

    def responses(self, path: MeasuredPath) -> ImpulseResponses:
        """Impulse responses of a measured path; ConfigError where its file does not fit."""
        return read_responses(
            path, self.channels, self.channel_names, self.sampling_rate
        )

    def of_machine(self, channels: Sequence[str]) -> Sensing:
        """The same with the channels of a machine in place of a key of ``IN_PLACE``.

        Raises
        ------
        ConfigError    for a machine without bearing channels
        """
        if not stands_for_channels(self.channels):
            return self
        (key,) = self.channels
        bearings = [
            name
            for name in channels
            if transverse_channel(name) in channels
            and not is_turning(name)
            and name.endswith(IN_PLACE[key])
        ]
        if not bearings:
            raise ConfigError(
                f"sensing.channels = [{key}]: no gear of this machine moves on "
                "bearings; take system.lateral=true"
            )
        return replace(self, channels=tuple(bearings))

    def check_gears(self, gears: Collection[str]) -> None:
        """Raise ConfigError for shaft sensors and nuisances of a gear that is none of ``gears``."""
        check_choice("sensing.tacho.shaft", self.tacho.shaft, gears)
        check_choice("sensing.encoder.shaft", self.encoder.shaft, gears)
        for index, part in enumerate(self.nuisances):
            check_choice(f"sensing.nuisances[{index}].gear", part.gear, gears)

    def check(self, duration: float) -> None:
        """Read the files of users; ConfigError where they do not fit."""
        if isinstance(self.path, MeasuredPath):
            self.responses(self.path)
        if self.noise is not None:
            receiver = self.receiver(round(duration * self.sampling_rate))
            for part in self.noise.parts:
                part.check(receiver)

    def _check_path(self) -> None:
        if self.path is None and self.sensors is not None:
            raise ConfigError(
                "sensing.sensors names the places that a transfer path leads to: "
                "leave it null with sensing.path.kind = identity"
            )
        if self.path is None:
            return
        if self.sensors is None:
            raise ConfigError(
                "sensing.sensors names the places that a transfer path leads to: "
                "give at least one"
            )
        if not self.sensors or len(set(self.sensors)) != len(self.sensors):
            raise ConfigError(
                f"sensing.sensors = {list(self.sensors)} must name at least one sensor, each once"
            )
        for name in self.sensors:
            if not SENSOR_NAME.fullmatch(name) or is_turning(name):
                raise ConfigError(
                    f"sensing.sensors: {name!r}; give letters, digits and _, at most 32, "
                    f"not ending in {', '.join(map(repr, TURNING))}"
                )
        turning = [name for name in self.channels if channel_unit(name) != "m/s^2"]
        if turning:
            raise ConfigError(
                f"sensing.channels: {turning[0]} is no bearing; "
                "a transfer path takes bearing channels"
            )
        if isinstance(self.path, ModalPath):
            self._check_band(*self.path.natural_frequency)

    def _check_band(self, lowest: float, highest: float) -> None:
        usable = usable_band(self.sampling_rate)[1]
        if highest <= usable:
            return
        advice = f"a rate of at least {math.ceil(highest / usable_band(1.0)[1])} Hz"
        if lowest < usable:
            ends = f"[{lowest:g},{usable:g}]"
            advice = f"'sensing.path.natural_frequency_hz={ends}' or {advice}"
        raise ConfigError(
            f"sensing.path.natural_frequency_hz reaches {highest:g} Hz, above the usable "
            f"band of {usable:g} Hz at sensing.sampling_rate_hz = {self.sampling_rate:g}; "
            f"give {advice}"
        )

    def _check_sensor(self) -> None:
        if self.sensor is None:
            return
        cutoff = self.sensor.low_cutoff
        if cutoff is not None and cutoff > 0.1 * self.sampling_rate:
            raise ConfigError(
                f"sensing.sensor.low_cutoff_hz = {cutoff:g} is too near the sampling rate"
            )
        if not self.sensor.transverse_sensitivity:
            return
        if isinstance(self.path, MeasuredPath):
            raise ConfigError(
                "sensing.sensor.transverse_sensitivity: "
                "a measured path tells no transverse motion; give 0"
            )
        for name in self.channels:
            is_alone = transverse_channel(name) not in self.channels
            if self.path is None and name != EVERY_BEARING and is_alone:
                raise ConfigError(
                    f"sensing.sensor.transverse_sensitivity: sensing.channels has {name} "
                    "without the other axis; add it, or give 0"
                )

    def _check_noise(self, noise: Noise) -> None:
        if noise.level_key and self.snr is not None:
            raise ConfigError(
                f"sensing.snr_db = {self.snr:g} and sensing.noise.{noise.level_key} both "
                "set the level of the noise: add sensing.snr_db=null"
            )
        half = 0.5 * self.sampling_rate
        if noise.band is not None and noise.band[1] > half:
            raise ConfigError(
                f"sensing.noise.band_hz ends at {noise.band[1]:g} Hz, above half of "
                f"sensing.sampling_rate_hz = {self.sampling_rate:g}; give "
                f"'sensing.noise.band_hz=[{noise.band[0]:g},{half:g}]' or a higher rate"
            )
        n_sensors = len(self.channel_names)
        if noise.offsets is not None and len(noise.offsets) != n_sensors:
            raise ConfigError(
                f"sensing.noise.offsets_db has {len(noise.offsets)} values for {n_sensors} "
                "sensors; give one a sensor, or null"
            )
        if self.path is None and any(
            isinstance(part, ThroughPath) for part in noise.parts
        ):
            raise ConfigError(
                "sensing.noise: kind path needs a transfer path; "
                "sensing.path.kind = identity has none"
            )


def transverse_channel(name: str) -> str:
    """Channel of the other axis of the same bearing: pinion_y for pinion_x; '' if none."""
    gear, _, axis = name.rpartition("_")
    if axis not in CROSSED:
        return ""
    return f"{gear}_{CROSSED[axis]}"


def power(signal: Array) -> Array:
    """Mean square without the mean, (channel,) (m/s2)^2."""
    return np.var(signal, axis=-1)


def detectability(residual: Array, noise_power: Array) -> float:
    """Detectability d' of a known residual in white noise, that of a matched filter.

    It is the square root of the residual's energy over the noise power, summed over channels;
    NaN where a channel has no noise. With d' the detector is right in a share Phi(d' / 2) of
    equally many records with and without the fault: 0.69 at 1, 0.93 at 3. It knows unit, phase,
    load and speed of the record, and the fault; no classifier can do better.

    Parameters
    ----------
    residual : (channel, sample) m/s2    what the fault adds
    noise_power : (channel,) (m/s2)^2    variance of a sample's noise
    """
    if not np.all(noise_power > 0.0):
        return math.nan
    return math.sqrt(float(np.sum(np.sum(residual**2, axis=-1) / noise_power)))


def add_noise(clean: Array, noise_power: Array, rng: np.random.Generator) -> Array:
    """Add white Gaussian noise of the given power to each channel, (channel, sample).

    The result is in C order, whatever the order of the input in memory.
    """
    noisy = np.empty(clean.shape)
    # channel by channel: each stays in the cache
    for row, signal, variance in zip(noisy, clean, noise_power, strict=True):
        rng.standard_normal(out=row)
        row *= math.sqrt(variance)
        row += signal
    return noisy
