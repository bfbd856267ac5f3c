"""Machines drawn anew from stored records with healthy twins: one simulation, many machines.

A record at the bearings is its healthy twin, the carrier, and what the fault adds, the residual. A
re-draw is carrier plus gain times residual through another housing, with other noise and tones of
other parts. Housing and tones are those of a machine, the same for a record and the healthy records
that it is compared with; noise and gain are those of a record. All laws are the same for every
class, so that a re-draw tells none. Domain randomisation: Tobin et al. (2017), IROS.

It acts on turns (`gensig.signals.separation`), where a steady machine is periodic and a housing is
one factor an order: a re-draw costs milliseconds, and no transient of a filter is in it. What does
not repeat with a turn of a gear is in the noise alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from gensig.signals.separation import FloatArray, GearTurns

Range = tuple[float, float]
Spectrum = NDArray[np.complexfloating]

LEAST_FREQUENCY = 20.0  # Hz, below which the color of noise is flat; assumed
COLOR_POINTS = 512  # frequencies at which the power of a color is summed
RESONANCE_DAMPING = 0.02  # of a mounted accelerometer; assumed, as sensing=housing
REFERENCE_FREQUENCY = 1e3  # Hz, at which a color is 1


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Redraws:
    """Ranges from which machines are drawn, (low, high) each; all assumed.

    Attributes
    ----------
    fault_gain : factor of the residual, uniform in its logarithm
    n_modes : of the housing, whole numbers
    lowest_frequency, highest_frequency : Hz    ends of the band in which the modes of a machine
        lie, log-uniform, as the modes are within it
    damping_ratio : of the modes, log-uniform
    mounted_resonance : Hz    of the sensors, log-uniform
    snr_db : mean square of the carrier over that of the noise, dB
    color : exponent of frequency of the amplitude of noise; 0 is white, -0.5 pink
    tone_level : RMS of tones at low orders of each shaft and of a further mesh on one of them,
        over that of the carrier, log-uniform
    """

    fault_gain: Range = (1.0, 4.0)
    n_modes: tuple[int, int] = (4, 24)
    lowest_frequency: Range = (80.0, 1500.0)
    highest_frequency: Range = (4e3, 14e3)
    damping_ratio: Range = (0.005, 0.06)
    mounted_resonance: Range = (6e3, 30e3)
    snr_db: Range = (8.0, 32.0)
    color: Range = (-1.0, 0.3)
    tone_level: Range = (0.003, 0.3)

    def machine(
        self, n_sources: int, n_sensors: int, rng: np.random.Generator
    ) -> RedrawnMachine:
        """Housing, sensors, color of noise and tones of a machine.

        Parameters
        ----------
        n_sources : channels at the bearings
        n_sensors : channels of a re-drawn record
        """
        n_modes = int(rng.integers(self.n_modes[0], self.n_modes[1], endpoint=True))
        low = logarithmic(self.lowest_frequency, rng)
        high = logarithmic(self.highest_frequency, rng)
        return RedrawnMachine(
            ranges=self,
            frequency=_many((low, high), n_modes, rng),
            damping=_many(self.damping_ratio, n_modes, rng),
            from_bearings=rng.standard_normal((n_modes, n_sources)),
            to_sensors=rng.standard_normal((n_sensors, n_modes)) / math.sqrt(n_modes),
            resonance=logarithmic(self.mounted_resonance, rng),
            color=rng.uniform(*self.color, n_sensors),
            tones=(_tones(self, n_sensors, rng), _tones(self, n_sensors, rng)),
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Tones:
    """Tones at whole orders of a shaft, relative to the RMS of the carrier at each sensor.

    Attributes
    ----------
    order : (tone,) of the shaft
    amplitude : (sensor, tone) complex, with the shaft at tooth 0
    """

    order: NDArray[np.int64]
    amplitude: Spectrum

    def spectrum(self, n_teeth: int, n_samples: int, tooth: float) -> Spectrum:
        """(sensor, order) spectrum of a turn that begins at a tooth; none at orders of the mesh."""
        values = np.zeros((len(self.amplitude), n_samples // 2 + 1), dtype=complex)
        inside = (self.order < n_samples // 2) & (self.order % n_teeth != 0)
        order = self.order[inside]
        turned = np.exp(2j * math.pi * order * tooth / n_teeth)
        np.add.at(values.T, order, (self.amplitude[:, inside] * turned).T)
        return np.asarray(0.5 * n_samples * values)


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RedrawnMachine:
    """A machine of `Redraws`.

    Attributes
    ----------
    frequency, damping : (mode,) of the housing, Hz and ratio
    from_bearings, to_sensors : (mode, source) and (sensor, mode) participations
    resonance : Hz of the mounted sensors
    color : (sensor,) exponent of frequency
    tones : of the driving and the driven shaft
    """

    ranges: Redraws
    frequency: FloatArray
    damping: FloatArray
    from_bearings: FloatArray
    to_sensors: FloatArray
    resonance: float
    color: FloatArray
    tones: tuple[Tones, Tones]

    def path(self, frequency: FloatArray) -> Spectrum:
        """(sensor, source, frequency) accelerations at the sensors over those at the bearings.

        The modes of equation (S.1) of docs/theory/sensing.md, times a mounted resonance.
        """
        square, mode = np.square(frequency), self.frequency[:, None]
        answer = mode**2 / (
            mode**2 - square + 2j * self.damping[:, None] * mode * frequency
        )
        pairs = (
            self.to_sensors[:, None] * self.from_bearings.T
        )  # (sensor, source, mode)
        share = frequency / self.resonance
        sensor = 1.0 / (1.0 - share**2 + 2j * RESONANCE_DAMPING * share)
        return np.asarray((pairs @ answer) * sensor)

    def noise_shape(self, frequency: FloatArray) -> FloatArray:
        """(sensor, frequency) amplitude density of the noise, 1 at `REFERENCE_FREQUENCY`."""
        ratio = np.maximum(frequency, LEAST_FREQUENCY) / REFERENCE_FREQUENCY
        return np.asarray(ratio ** self.color[:, None])

    def record(
        self,
        carrier: GearTurns,
        residual: GearTurns | None,
        *,
        mesh_frequency: float,
        sampling_rate: float,
        n_samples: int,
        teeth: tuple[float, float],
        rng: np.random.Generator,
    ) -> GearTurns:
        """Turns of a record of this machine.

        Parameters
        ----------
        carrier : at the bearings, (source, sample) m/s2, without the fault
        residual : what the fault adds; None for a healthy record. Its gain is drawn all the same
        mesh_frequency : Hz
        sampling_rate : Hz; there is neither signal nor noise above half of it
        n_samples : of the record, over which noise is averaged
        teeth : of the driving and the driven gear at the first sample, with their fraction
        rng : of the record
        """
        gain = logarithmic(self.ranges.fault_gain, rng)
        snr = 10.0 ** (rng.uniform(*self.ranges.snr_db) / 10.0)
        parts = (carrier.driving, carrier.driven, carrier.mesh)
        added = None
        if residual is not None:
            added = (residual.driving, residual.driven, residual.mesh)
        counts = [part.shape[-1] // carrier.mesh.shape[-1] for part in parts]
        spectra, shapes, power = [], [], np.zeros(len(self.to_sensors))
        for index, (part, n_teeth) in enumerate(zip(parts, counts, strict=True)):
            frequency = np.arange(part.shape[-1] // 2 + 1) * mesh_frequency / n_teeth
            inside = frequency < 0.5 * sampling_rate
            path = self.path(frequency) * inside
            sound = _through(path, part)
            power += 2.0 * np.sum(np.abs(sound[:, 1:]) ** 2, 1) / part.shape[-1] ** 2
            if added is not None:
                sound = sound + gain * _through(path, added[index])
            spectra.append(sound)
            shapes.append(self.noise_shape(frequency) * inside)
        band = np.linspace(LEAST_FREQUENCY, 0.5 * sampling_rate, COLOR_POINTS)
        density = np.mean(self.noise_shape(band) ** 2, axis=-1)
        level = np.sqrt(power / (snr * density * n_samples))[:, None]
        for index, (part, shape) in enumerate(zip(parts, shapes, strict=True)):
            spectra[index] += part.shape[-1] * level * shape * _normal(shape.shape, rng)
        rms = np.sqrt(power)[:, None]
        for index, (tones, tooth) in enumerate(zip(self.tones, teeth, strict=True)):
            length = parts[index].shape[-1]
            spectra[index] += rms * tones.spectrum(counts[index], length, tooth)
        driving, driven, mesh = (
            np.fft.irfft(spectrum, n=part.shape[-1])
            for spectrum, part in zip(spectra, parts, strict=True)
        )
        return GearTurns(driving=driving, driven=driven, mesh=mesh)


def logarithmic(ends: Range, rng: np.random.Generator) -> float:
    """A number that is uniform in its logarithm between two positive ends."""
    return float(np.exp(rng.uniform(math.log(ends[0]), math.log(ends[1]))))


def difference(turns: GearTurns, other: GearTurns) -> GearTurns:
    """Turns less other ones of the same gears."""
    return GearTurns(
        driving=turns.driving - other.driving,
        driven=turns.driven - other.driven,
        mesh=turns.mesh - other.mesh,
    )


def _many(ends: Range, number: int, rng: np.random.Generator) -> FloatArray:
    low, high = np.log(ends)
    return np.asarray(np.exp(rng.uniform(low, high, number)))


def _tones(ranges: Redraws, n_sensors: int, rng: np.random.Generator) -> Tones:
    """Orders 1 to 6 of a shaft, and a mesh of 8 to 120 teeth on it with sidebands."""
    low = np.arange(1, 7)
    teeth = int(rng.integers(8, 120, endpoint=True))
    mesh = teeth * np.arange(1, 5)
    side = np.concatenate([mesh - 1, mesh + 1])
    sizes = [
        logarithmic(ranges.tone_level, rng) / low,
        logarithmic(ranges.tone_level, rng) * teeth / mesh,
    ]
    sizes.append(rng.uniform(0.05, 0.3) * np.tile(sizes[1], 2))
    size = math.sqrt(2.0) * np.concatenate(sizes)
    return Tones(
        order=np.concatenate([low, mesh, side]),
        amplitude=size * _normal((n_sensors, size.size), rng),
    )


def _through(path: Spectrum, turn: FloatArray) -> Spectrum:
    """(sensor, order) spectrum of a turn (source, sample) behind a path."""
    return np.asarray(np.sum(path * np.fft.rfft(turn)[None], axis=1))


def _normal(shape: tuple[int, ...], rng: np.random.Generator) -> Spectrum:
    """Complex normal numbers of mean square 1."""
    real, imaginary = rng.standard_normal((2, *shape))
    return np.asarray((real + 1j * imaginary) * math.sqrt(0.5))
