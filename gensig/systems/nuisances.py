"""Nuisances in a record: their forces follow its shafts' angles, its linear machine answers, bearings hear it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import usable_band
from gensig.dynamics.pair import PairDynamics
from gensig.dynamics.response import accelerations
from gensig.sensing.nuisance import draw_tones
from gensig.sensing.tones import SENSE, TURN, Tones, shaft
from gensig.systems.shaft_sensors import gear_angle
from gensig.systems.spur_pair import CleanRecord, Run, Start

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

BLOCK = 2048  # samples over which amplitudes go straight: 40 ms at 51.2 kHz


def with_nuisances(
    run: Run, record: CleanRecord, units: Mapping[str, np.random.Generator], record_rng: np.random.Generator
) -> CleanRecord:
    """A record whose bearings also feel what ``sensing.nuisances`` lists; without any, the record itself.

    The machine that answers is the sound one whatever the run's faults: nothing but the shaft's own angle, which the
    forces follow, differs from one class to another. ``units`` has a generator a level, see ``draw_tones``.
    """
    nuisances = run.system.sensing.nuisances
    if not nuisances:
        return record
    dynamics = replace(run, faults=(), specimen=None).dynamics()
    tones = draw_tones(nuisances, dynamics, units, record_rng)
    gain = 1.0 if run.gearbox is None else run.gearbox.gain[:, None]
    heard = nuisance_acceleration(run, dynamics, tones, record.shaft_angle)
    return replace(record, acceleration=record.acceleration + gain * heard)


def nuisance_acceleration(run: Run, dynamics: PairDynamics, tones: Sequence[Tones], shaft_angle: Array) -> Array:
    """Accelerations of a run's channels under some tones, ``n_lead`` samples before the record too.

    Parameters
    ----------
    dynamics : the machine that answers
    shaft_angle : (sample,) rad    of the pinion from its nominal place at the first sample on, as a record has it

    Returns
    -------
    (channel, n_lead + sample) m/s2, or rad/s2 for a rotation

    Every tone has the amplitude and phase lag of steady turning at the nominal speed of the instant (assumed; taken
    once a block, straight in between) and the phase of the shaft's actual angle. Tones above the usable band are left
    out. Before the record the shaft turns as the nominal course says.
    """
    sensing, operating = run.system.sensing, run.system.operating
    n_lead, rate = sensing.n_lead, sensing.sampling_rate
    before = operating.nominal(np.arange(-n_lead, 0) / rate).angle + shaft_angle[0]
    turned = np.concatenate([before, shaft_angle])
    begin_at = run.start or Start(tooth_pinion=0, tooth_wheel=0, phase=0.0)
    first = {gear: float(gear_angle(run.system, gear, begin_at, np.zeros(1))[0]) for gear in SENSE}
    ratio = {gear: shaft(dynamics, gear).speed_ratio for gear in SENSE}
    channels = [dynamics.dofs.index(name) for name in sensing.channels]
    edges = np.arange(0, len(turned) + BLOCK, BLOCK)
    nominal = operating.nominal((edges - n_lead) / rate)
    course = list(zip(nominal.speed.tolist(), nominal.torque_factor.tolist(), strict=True))
    highest = TURN * usable_band(rate)[1]

    def amplitudes(speed: float, torque_factor: float) -> Array:
        """Factors (channel, 2 tone) on cosines and sines."""
        answers = [_amplitudes(dynamics, part, speed, torque_factor, highest)[:, channels] for part in tones]
        return np.concatenate([part for one in answers for part in (one.real.T, -one.imag.T)], axis=1)

    out = np.empty((len(channels), len(turned)))
    begin = amplitudes(*course[0])
    for place, start in enumerate(edges[:-1].tolist()):
        own = turned[start : start + BLOCK]
        angle = {gear: first[gear] + ratio[gear] * own for gear in SENSE}
        waves = _waves(tones, angle)
        # einsum, not @: its bits depend on no thread count
        out[:, start : start + BLOCK] = np.einsum("ct,ts->cs", begin, waves)
        if course[place + 1] != course[place]:
            end = amplitudes(*course[place + 1])
            share = np.arange(len(own)) / BLOCK
            out[:, start : start + BLOCK] += share * np.einsum("ct,ts->cs", end - begin, waves)
            begin = end
    return out


def _amplitudes(dynamics: PairDynamics, tones: Tones, speed: float, torque_factor: float, highest: float) -> Complex:
    """Accelerations (tone, dof) of steady turning at a speed of the pinion in rad/s."""
    frequency = tones.order * speed * shaft(dynamics, tones.gear).speed_ratio
    growth = {"speed_squared": (speed / dynamics.operating.speed) ** 2, "torque": torque_factor, "nothing": 1.0}
    force = np.zeros((len(frequency), len(dynamics.dofs)), dtype=np.complex128)
    places = [dynamics.dofs.index(f"{tones.gear}_{axis}") for axis in ("x", "y", "rotation")]
    force[:, places] = growth[tones.follows] * tones.force
    return accelerations(dynamics, frequency, force) * (np.abs(frequency) <= highest)[:, None]


def _waves(tones: Sequence[Tones], angle: Mapping[str, Array]) -> Array:
    """Cosines, then sines of every part's phases, (2 tone, sample), from products of powers.

    A power costs a fiftieth of a cosine, and parts share those of the angles that they share.
    """
    powers: dict[tuple[str, float], _Powers] = {}
    out = np.empty((2 * sum(len(part.multiple) for part in tones), len(next(iter(angle.values())))))
    row = 0
    for part in tones:
        n_tones = len(part.multiple)
        for tone, multiples in enumerate(part.multiple.tolist(), start=row):
            phasor: Complex | None = None
            for order, multiple in zip(part.base.tolist(), multiples, strict=True):
                if multiple:
                    key = (part.gear, order)
                    if key not in powers:
                        powers[key] = _Powers(np.exp(1j * order * angle[part.gear]))
                    one = powers[key](multiple)
                    phasor = one if phasor is None else phasor * one
            if phasor is None:
                raise ValueError("a tone follows at least one angle")
            out[tone], out[tone + n_tones] = phasor.real, phasor.imag
        row += 2 * n_tones
    return out


class _Powers:
    """Whole powers of unit numbers, each made once."""

    def __init__(self, base: Complex) -> None:
        self.made: dict[int, Complex] = {1: base}

    def __call__(self, exponent: int) -> Complex:
        if exponent not in self.made:
            if exponent < 0:
                self.made[exponent] = self(-exponent).conj()
            else:
                half = exponent // 2
                self.made[exponent] = self(half) * self(exponent - half)
        return self.made[exponent]
