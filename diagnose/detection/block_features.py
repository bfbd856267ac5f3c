"""Levels and shapes of a time block: what is compared with healthy ones.

All features are in dB or grow as such, so that one spread serves all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.gear_stages import GearStages
from diagnose.detection.shaft_turns import separate_shafts
from gensig.signals.averaging import remove_orders
from gensig.signals.indicators import crest_factor, kurtosis
from gensig.signals.resampling import PASS_SHARE

FloatArray = NDArray[np.floating]

BROADBAND, MESH, SIDEBANDS, TEETH, IMPULSES = (
    "broadband",
    "mesh",
    "sidebands",
    "teeth",
    "impulses",
)
N_BANDS = 10  # of equal ratio
LOWEST_HZ = 20.0
MOST_HARMONICS = 5  # of each mesh
SIDEBAND_HARMONICS = 3  # of each mesh whose sidebands are looked at
N_SIDEBANDS = 3  # on either side; and shaft orders, and lines of the envelope
PADDING = 4  # of the spectrum: a line between bins loses 0.1 dB
ENVELOPE_SHARE = 0.5  # of the usable band, from where on the envelope is taken
TINY = 1e-30


@dataclass(frozen=True, slots=True, kw_only=True)
class Feature:
    """Name of a feature.

    Attributes
    ----------
    name : in words
    group : kind of change that it shows
    part : number of its stage or shaft; 0 where it has none
    is_level : True if speed, load or the sensor's mounting change it
    """

    name: str
    group: str
    part: int
    is_level: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Geometry of the features, the same for all recordings of a machine.

    Attributes
    ----------
    stages : of the machine
    sensors : names of the channels
    highest : Hz, end of the band that is looked at
    edges : (band + 1,) Hz
    n_harmonics : of each stage's mesh below `highest` at the highest speed
    n_orders : of each shaft below it
    """

    stages: GearStages
    sensors: tuple[str, ...]
    highest: float
    edges: tuple[float, ...]
    n_harmonics: tuple[int, ...]
    n_orders: tuple[int, ...]

    def mesh_orders_of(self, shaft: int) -> list[int]:
        """Orders of a shaft at which its meshes have their harmonics."""
        most = self.n_orders[shaft]
        gears = self.stages.gears(shaft)
        return [o for gear in gears for o in range(gear.n_teeth, most, gear.n_teeth)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A time block by its features.

    Attributes
    ----------
    features : names of the values
    values : (feature,)
    turns : for each shaft (channel, sample), without mesh lines and lowest orders
    """

    features: tuple[Feature, ...]
    values: FloatArray
    turns: tuple[FloatArray, ...]


def layout_of(
    stages: GearStages,
    sensors: tuple[str, ...],
    sampling_rate: float,
    speeds_rpm: tuple[float, float],
) -> Layout:
    """Geometry for recordings of a rate, from a lowest to a highest speed of the input shaft."""
    highest = PASS_SHARE * sampling_rate
    fast = speeds_rpm[1] / 60.0
    harmonics = tuple(
        min(MOST_HARMONICS, int(highest / (order * fast)))
        for order in stages.mesh_orders
    )
    lowest = min(LOWEST_HZ, speeds_rpm[0] / 60.0)
    return Layout(
        stages=stages,
        sensors=sensors,
        highest=highest,
        edges=tuple(np.geomspace(lowest, highest, N_BANDS + 1)),
        n_harmonics=harmonics,
        n_orders=tuple(
            max(int(highest / (order * fast)), 8) for order in stages.shaft_orders
        ),
    )


def measure_block(
    signal: FloatArray, samples_per_turn: int, speed_rpm: float, start: int, to: Layout
) -> Block:
    """Features of a block.

    Parameters
    ----------
    signal : (channel, sample) m/s2, evenly sampled in the angle of the input shaft
    samples_per_turn : of the input shaft
    speed_rpm : r/min of it
    start : samples of the recording before the block
    """
    stages = to.stages
    separated = separate_shafts(
        signal,
        samples_per_turn,
        stages.shaft_orders,
        start=start,
        n_orders=to.n_orders,
    )
    turns = tuple(
        remove_orders(turn, {0, 1, 2, *to.mesh_orders_of(shaft)})
        for shaft, turn in enumerate(separated.turns)
    )
    spectra = _Spectra.of(signal, separated.rest, samples_per_turn, speed_rpm, to)
    pairs = list(_features(spectra, signal, separated.rest, to))
    return Block(
        features=tuple(
            _of_sensor(feature, sensor, len(to.sensors))
            for feature, _ in pairs
            for sensor in to.sensors
        ),
        values=np.concatenate([value for _, value in pairs]),
        turns=turns,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spectra:
    """Power over the orders of the input shaft.

    Attributes
    ----------
    order : (bin,) of the input shaft
    power, rest_power : (channel, bin) of the block and of what repeats with no shaft
    envelope : (channel, bin) of the squared envelope of the upper band, over its mean
    speed : Hz, of the input shaft
    """

    order: FloatArray
    power: FloatArray
    rest_power: FloatArray
    envelope: FloatArray
    speed: float

    @classmethod
    def of(
        cls,
        signal: FloatArray,
        rest: FloatArray,
        samples_per_turn: int,
        speed_rpm: float,
        to: Layout,
    ) -> _Spectra:
        """Spectra of a block."""
        speed = speed_rpm / 60.0
        length = PADDING * signal.shape[-1]
        highest = to.highest / speed
        band = (ENVELOPE_SHARE * highest, highest)
        squared = _squared_envelope(signal, samples_per_turn, band)
        return cls(
            order=np.fft.rfftfreq(length, 1.0 / samples_per_turn),
            power=_power(signal, length),
            rest_power=_power(rest, length),
            envelope=_power(squared, length),
            speed=speed,
        )

    def at(self, power: FloatArray, orders: list[float]) -> FloatArray:
        """(channel,) sum of the power of lines."""
        bins = np.rint(np.array(orders) / self.order[1]).astype(int)
        inside = bins[(bins >= 0) & (bins < self.order.size)]
        return power[:, inside].sum(axis=-1)

    def between(self, power: FloatArray, low: float, high: float) -> FloatArray:
        """(channel,) power between two frequencies, Hz."""
        frequency = self.order * self.speed
        inside = (frequency >= low) & (frequency < high)
        return power[:, inside].sum(axis=-1)


def _features(
    spectra: _Spectra, signal: FloatArray, rest: FloatArray, to: Layout
) -> Iterator[tuple[Feature, FloatArray]]:
    """Features of a block with their values, (channel,)."""
    yield from _levels(spectra, to)
    for shaft, order in enumerate(to.stages.shaft_orders):
        yield from _of_shaft(spectra, shaft, order, to)

    def impulsive(name: str, value: FloatArray) -> tuple[Feature, FloatArray]:
        feature = Feature(name=name, group=IMPULSES, part=0, is_level=False)
        return feature, value

    yield impulsive("kurtosis", _db(kurtosis(signal)))
    yield impulsive("kurtosis of the rest", _db(kurtosis(rest)))
    yield impulsive("crest factor of the rest", 2.0 * _db(crest_factor(rest)))
    feature = Feature(
        name="highest foreign line of the envelope",
        group=IMPULSES,
        part=0,
        is_level=True,
    )
    yield feature, _foreign(spectra, to)


def _levels(spectra: _Spectra, to: Layout) -> Iterator[tuple[Feature, FloatArray]]:
    """Levels of bands and mesh harmonics."""
    kinds = (("", spectra.power), (" of the rest", spectra.rest_power))
    for low, high in zip(to.edges[:-1], to.edges[1:], strict=True):
        for kind, power in kinds:
            feature = Feature(
                name=f"{low:.0f} to {high:.0f} Hz{kind}",
                group=BROADBAND,
                part=0,
                is_level=True,
            )
            yield feature, _db(spectra.between(power, low, high))
    for stage, order in enumerate(to.stages.mesh_orders):
        for harmonic in range(1, to.n_harmonics[stage] + 1):
            feature = Feature(
                name=f"harmonic {harmonic}", group=MESH, part=stage, is_level=True
            )
            yield feature, _db(spectra.at(spectra.power, [harmonic * order]))


def _of_shaft(
    spectra: _Spectra, shaft: int, order: float, to: Layout
) -> Iterator[tuple[Feature, FloatArray]]:
    """Sidebands, orders and lines of the envelope of a shaft."""
    steps = range(1, N_SIDEBANDS + 1)
    for gear in to.stages.gears(shaft):
        mesh = to.stages.mesh_orders[gear.stage]
        most = min(SIDEBAND_HARMONICS, to.n_harmonics[gear.stage])
        for harmonic in range(1, most + 1):
            lines = [
                harmonic * mesh + side * order
                for side in (*steps, *(-s for s in steps))
            ]
            feature = Feature(
                name=f"sidebands of harmonic {harmonic} of stage {gear.stage + 1}",
                group=SIDEBANDS,
                part=shaft,
                is_level=True,
            )
            yield feature, _db(spectra.at(spectra.power, lines))
    for step in steps:
        feature = Feature(
            name=f"order {step}", group=SIDEBANDS, part=shaft, is_level=True
        )
        yield feature, _db(spectra.at(spectra.power, [step * order]))
    feature = Feature(
        name="lines of the envelope", group=SIDEBANDS, part=shaft, is_level=True
    )
    lines = [step * order for step in steps]
    yield feature, _db(spectra.at(spectra.envelope, lines))


def _foreign(spectra: _Spectra, to: Layout) -> FloatArray:
    """Highest line of the envelope at no order of a shaft, over the median, dB."""
    highest = to.stages.mesh_orders[0] / 2.0
    step = spectra.order[1]
    own = np.zeros(spectra.order.size, dtype=bool)
    width = 2 * PADDING
    for order in to.stages.shaft_orders:
        for multiple in range(int(highest / order) + 2):
            middle = round(multiple * order / step)
            own[max(middle - width, 0) : middle + width + 1] = True
    looked_at = (spectra.order <= highest) & ~own
    if not np.any(looked_at):
        return np.zeros(spectra.envelope.shape[0])
    lines = spectra.envelope[:, looked_at]
    return _db(lines.max(axis=-1)) - _db(np.median(lines, axis=-1))


def _squared_envelope(
    signal: FloatArray, samples_per_turn: int, band: tuple[float, float]
) -> FloatArray:
    """Squared envelope of a band of orders over its mean, less 1."""
    n_samples = signal.shape[-1]
    spectrum = np.fft.fft(signal, axis=-1)
    order = np.fft.fftfreq(n_samples, 1.0 / samples_per_turn)
    spectrum[:, (order < band[0]) | (order >= band[1])] = 0.0
    squared = np.square(np.abs(np.fft.ifft(spectrum, axis=-1)))
    return squared / (squared.mean(axis=-1, keepdims=True) + TINY) - 1.0


def _power(signal: FloatArray, length: int) -> FloatArray:
    """(channel, bin) power of a Hann-windowed signal, padded to a length."""
    window = np.hanning(signal.shape[-1])
    spectrum = np.fft.rfft(signal * window, n=length, axis=-1)
    return np.square(np.abs(spectrum) * (2.0 / window.sum()))


def _of_sensor(feature: Feature, sensor: str, n_sensors: int) -> Feature:
    """A feature with its sensor named, where there are several."""
    if n_sensors == 1:
        return feature
    return replace(feature, name=f"{feature.name} of {sensor}")


def _db(power: FloatArray) -> FloatArray:
    return 10.0 * np.log10(np.maximum(np.nan_to_num(power), TINY))
