"""Nuisances in a record.

Their forces follow its shafts' angles, its linear machine answers, bearings hear it.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import pairwise

import numpy as np

from gensig.arrays import Array, Complex
from gensig.dynamics.decimation import usable_band
from gensig.dynamics.response import LinearMachine
from gensig.operation.setpoint import Nominal
from gensig.sensing.nuisance import draw_tones
from gensig.sensing.tones import TURN, Tones
from gensig.systems.base import Machine
from gensig.systems.run import CleanRecord, Run, Start
from gensig.units import SPEED

# rad of the fastest tone from one made sample to the next: a cubic spline leaves 0.3^4 / 384
SPLINE_PHASE = 0.3
BLOCK = 2048  # samples over which amplitudes go straight: 40 ms at 51.2 kHz


def with_nuisances(
    run: Run[Machine],
    record: CleanRecord,
    units: Mapping[str, np.random.Generator],
    record_rng: np.random.Generator,
) -> CleanRecord:
    """A record whose bearings also feel what ``sensing.nuisances`` lists; without any, the record
    itself.

    The machine that answers is the healthy one whatever the run's faults: nothing but the shaft's
    own angle, which the forces follow, differs from one class to another. ``units`` has a
    generator a level, see ``draw_tones``.
    """
    nuisances = run.system.sensing.nuisances
    if not nuisances:
        return record
    machine = run.system.linear_machine(run)
    tones = draw_tones(nuisances, machine, units, record_rng)
    gain = np.ones((len(record.acceleration), 1))
    if run.gearbox is not None:
        # a toothed wheel counts time: it has no gain
        counted = [name.endswith(SPEED) for name in run.system.sensing.channels]
        gain = np.where(counted, 1.0, run.gearbox.gain)[:, None]
    heard = nuisance_acceleration(run, machine, tones, record.shaft_angle)
    # left alone, NumPy takes the order of one or the other, by their size
    shaken = np.add(record.acceleration, gain * heard, order="C")
    return replace(record, acceleration=shaken)


def nuisance_acceleration(
    run: Run[Machine],
    machine: LinearMachine,
    tones: Sequence[Tones],
    shaft_angle: Array,
) -> Array:
    """Accelerations of a run's channels under some tones, ``n_lead`` samples before the record too.

    Parameters
    ----------
    machine : the one that answers
    shaft_angle : (sample,) rad    of the pinion from its nominal angle at the first sample on,
        as a record has it

    Returns
    -------
    (channel, n_lead + sample) m/s2, rad/s2 for a rotation, rad/s for a toothed wheel

    Every tone has the amplitude and phase lag of steady turning at the nominal speed of the
    instant (assumed; taken once a block, straight in between) and the phase of the shaft's actual
    angle. Tones above the usable band are left out. Before the record the shaft turns as the
    nominal course says. The sum is made at every few samples of its fastest tone and goes by
    cubic splines in between, which leaves less than 1e-4 of it but at the last few samples.
    """
    from scipy.interpolate import CubicSpline

    sensing, operating = run.system.sensing, run.system.operating
    n_lead, rate = sensing.n_lead, sensing.sampling_rate
    before = operating.nominal(np.arange(-n_lead, 0) / rate).angle + shaft_angle[0]
    turned = np.concatenate([before, shaft_angle])
    begin_at = run.start or Start()
    gears = list(dict.fromkeys(part.gear for part in tones))
    first = {
        gear: float(run.system.gear_angle(gear, begin_at, np.zeros(1))[0])
        for gear in gears
    }
    ratio = {gear: machine.shaft(gear).speed_ratio for gear in gears}
    channels = sensing.channels

    n_samples = len(turned)
    edges = np.arange(0, n_samples + BLOCK, BLOCK)
    nominal = operating.nominal((edges - n_lead) / rate)
    answers = [
        _answers(run, machine, part, nominal, TURN * usable_band(rate)[1])
        for part in tones
    ]
    factors = np.concatenate(
        [part for answer in answers for part in (answer.real, -answer.imag)], axis=1
    )  # on cosines, sines
    fastest = max(
        float(
            np.max(
                np.abs(_frequencies(machine, part, nominal.speed)) * answer.any(axis=2)
            )
        )
        for part, answer in zip(tones, answers, strict=True)
    )
    every = max(1, min(BLOCK, int(SPLINE_PHASE * rate / max(fastest, 1.0))))
    made = np.unique(np.append(np.arange(0, n_samples, every), n_samples - 1))

    coarse = np.empty((len(channels), len(made)))
    ends = np.searchsorted(made, edges)
    for block, (start, stop) in enumerate(pairwise(ends.tolist())):
        samples = made[start:stop]
        waves = _waves(
            tones, {gear: first[gear] + ratio[gear] * turned[samples] for gear in gears}
        )
        # einsum, not @: its bits depend on no thread count
        coarse[:, start:stop] = np.einsum("tc,ts->cs", factors[block], waves)
        change = factors[block + 1] - factors[block]
        if change.any():
            coarse[:, start:stop] += (
                (samples - edges[block]) / BLOCK * np.einsum("tc,ts->cs", change, waves)
            )
    if every == 1 or len(made) < 4:
        return coarse
    return np.asarray(CubicSpline(made, coarse, axis=1)(np.arange(n_samples)))


def _frequencies(machine: LinearMachine, tones: Tones, speed: Array) -> Array:
    """Circular frequencies at speeds of the pinion in rad/s, (speed, tone) rad/s.

    Below 0 against the shaft's sense.
    """
    return np.asarray(
        speed[:, None] * machine.shaft(tones.gear).speed_ratio * tones.order
    )


def _answers(
    run: Run[Machine],
    machine: LinearMachine,
    tones: Tones,
    nominal: Nominal,
    highest: float,
) -> Complex:
    """Answers of the channels to steady turning, (time, tone, channel).

    0 for tones above ``highest`` in rad/s.
    """
    frequency = _frequencies(machine, tones, nominal.speed)
    share = nominal.speed / run.system.operating.speed
    growth = {
        "speed_squared": share**2,
        "torque": nominal.torque_factor * share**run.system.load_exponent,
        "nothing": np.ones(len(frequency)),
    }
    force = growth[tones.follows][:, None, None] * tones.force
    channels = run.system.sensing.channels
    answer = machine.accelerations(
        tones.gear, frequency.ravel(), force.reshape(-1, 3), channels
    ).reshape(*frequency.shape, len(channels))
    return answer * (np.abs(frequency) <= highest)[:, :, None]


def _waves(tones: Sequence[Tones], angle: Mapping[str, Array]) -> Array:
    """Cosines, then sines of every part's phases, (2 tone, sample), from products of powers.

    A power costs a fiftieth of a cosine, and parts share those of the angles that they share.
    """
    powers: dict[tuple[str, float], _Powers] = {}
    out = np.empty(
        (2 * sum(len(part.multiple) for part in tones), len(next(iter(angle.values()))))
    )
    row = 0
    for part in tones:
        n_tones = len(part.multiple)
        for tone, multiples in enumerate(part.multiple.tolist(), start=row):
            factors = []
            for order, multiple in zip(part.base.tolist(), multiples, strict=True):
                if multiple:
                    key = (part.gear, order)
                    if key not in powers:
                        powers[key] = _Powers(np.exp(1j * order * angle[part.gear]))
                    factors.append(powers[key](multiple))
            phasor = reduce(operator.mul, factors)
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
