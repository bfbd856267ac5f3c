"""Nuisances in a record: forces that follow the shafts' angles, on the linear machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, reduce
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import usable_band
from gensig.dynamics.pair import PairDynamics
from gensig.dynamics.response import accelerations
from gensig.operation.setpoint import Nominal
from gensig.sensing.nuisance import draw_tones
from gensig.sensing.tones import SENSE, TURN, Tones, shaft
from gensig.systems.pair_machine import PairRun, pair_dynamics
from gensig.systems.run import CleanRecord, Start
from gensig.systems.shaft_sensors import gear_angle

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# rad of the fastest tone between computed samples: the error of a cubic spline is 0.3^4 / 384
SPLINE_PHASE = 0.3
BLOCK = 2048  # samples over which amplitudes are linear: 40 ms at 51.2 kHz


def with_nuisances(
    run: PairRun,
    record: CleanRecord,
    units: Mapping[str, np.random.Generator],
    record_rng: np.random.Generator,
) -> CleanRecord:
    """A record with the nuisances of ``sensing.nuisances``; without any, the record itself.

    The responding machine is the sound one for all faults: only the angle of the shaft, which the
    forces follow, differs between classes. ``units`` has a generator a level, see ``draw_tones``.
    """
    nuisances = run.system.sensing.nuisances
    if not nuisances:
        return record
    dynamics = pair_dynamics(replace(run, faults=(), specimen=None))
    tones = draw_tones(nuisances, dynamics, units, record_rng)
    added = nuisance_acceleration(run, dynamics, tones, record.shaft_angle)
    if run.gearbox is not None:
        added = run.gearbox.gain[:, None] * added
    return replace(record, acceleration=record.acceleration + added)


def nuisance_acceleration(
    run: PairRun, dynamics: PairDynamics, tones: Sequence[Tones], shaft_angle: Array
) -> Array:
    """Accelerations of a run's channels under tones, also ``n_lead`` samples before the record.

    Parameters
    ----------
    dynamics : the responding machine
    shaft_angle : (sample,) rad    of the pinion from its nominal angle at the first sample on

    Returns
    -------
    (channel, n_lead + sample) m/s2, or rad/s2 for a rotation

    Every tone has the amplitude and phase lag of steady rotation at the nominal speed of the
    instant (assumed; computed once a block, linear in between) and the phase of the shaft's actual
    angle. Tones above the usable band are left out. Before the record the shaft follows its
    nominal course. The sum is computed at every few samples, by the fastest tone, and interpolated
    by cubic splines, with an error below 1e-4 except at the last few samples.
    """
    from scipy.interpolate import CubicSpline

    sensing, operating = run.system.sensing, run.system.operating
    n_lead, rate = sensing.n_lead, sensing.sampling_rate
    before = operating.nominal(np.arange(-n_lead, 0) / rate).angle + shaft_angle[0]
    turned = np.concatenate([before, shaft_angle])
    start, zero = run.start or Start(), np.zeros(1)
    angle = {
        gear: float(gear_angle(run.system, gear, start, zero)[0])
        + shaft(dynamics, gear).speed_ratio * turned
        for gear in SENSE
    }
    channels = [dynamics.dofs.index(name) for name in sensing.channels]

    n_samples = len(turned)
    edges = np.arange(0, n_samples + BLOCK, BLOCK)
    nominal = operating.nominal((edges - n_lead) / rate)
    highest = TURN * usable_band(rate)[1]
    factors: list[Array] = []  # on cosines, then sines, of every part
    fastest = 1.0
    for part in tones:
        response = _responses(dynamics, part, nominal, highest)[:, :, channels]
        factors += [response.real, -response.imag]
        frequency = np.abs(_frequencies(dynamics, part, nominal.speed))
        fastest = max(fastest, float(np.max(frequency * response.any(axis=2))))
    factor = np.concatenate(factors, axis=1)
    every = max(1, min(BLOCK, int(SPLINE_PHASE * rate / fastest)))
    samples = np.unique(np.append(np.arange(0, n_samples, every), n_samples - 1))

    coarse = np.empty((len(channels), len(samples)))
    ends = np.searchsorted(samples, edges)
    for block, (begin, end) in enumerate(pairwise(ends.tolist())):
        in_block = samples[begin:end]
        waves = _waves(tones, {gear: angle[gear][in_block] for gear in SENSE})
        # einsum, not @: its bits depend on no thread count
        coarse[:, begin:end] = np.einsum("tc,ts->cs", factor[block], waves)
        change = factor[block + 1] - factor[block]
        if change.any():
            share = (in_block - edges[block]) / BLOCK
            coarse[:, begin:end] += share * np.einsum("tc,ts->cs", change, waves)
    if every == 1 or len(samples) < 4:
        return coarse
    return np.asarray(CubicSpline(samples, coarse, axis=1)(np.arange(n_samples)))


def _frequencies(dynamics: PairDynamics, tones: Tones, speed: Array) -> Array:
    """Circular frequencies at speeds of the pinion in rad/s, (speed, tone) rad/s.

    Negative against the shaft's sense.
    """
    ratio = shaft(dynamics, tones.gear).speed_ratio
    return np.asarray(speed[:, None] * ratio * tones.order)


def _responses(
    dynamics: PairDynamics, tones: Tones, nominal: Nominal, highest: float
) -> Complex:
    """Accelerations (time, tone, dof) of steady rotation; 0 for tones above ``highest`` rad/s."""
    frequency = _frequencies(dynamics, tones, nominal.speed)
    growth = {
        "speed_squared": (nominal.speed / dynamics.operating.speed) ** 2,
        "torque": nominal.torque_factor,
        "nothing": np.ones(len(frequency)),
    }
    force = np.zeros((*frequency.shape, len(dynamics.dofs)), dtype=np.complex128)
    axes = [f"{tones.gear}_{axis}" for axis in ("x", "y", "rotation")]
    dofs = [dynamics.dofs.index(name) for name in axes]
    force[:, :, dofs] = growth[tones.follows][:, None, None] * tones.force
    by_tone = force.reshape(-1, force.shape[2])
    response = accelerations(dynamics, frequency.ravel(), by_tone).reshape(force.shape)
    return response * (np.abs(frequency) <= highest)[:, :, None]


def _waves(tones: Sequence[Tones], angle: Mapping[str, Array]) -> Array:
    """Cosines, then sines of every part's phases, (2 tone, sample), from products of powers.

    A power costs a fiftieth of a cosine, and parts share the powers of common angles.
    """

    @cache
    def power(gear: str, order: float, exponent: int) -> Complex:
        if exponent == 1:
            return np.asarray(np.exp(1j * order * angle[gear]))
        if exponent < 0:
            return power(gear, order, -exponent).conj()
        half = exponent // 2
        return power(gear, order, half) * power(gear, order, exponent - half)

    rows: list[Array] = []
    for part in tones:
        phasors = []
        for multiples in part.multiple.tolist():
            factors = [
                power(part.gear, order, multiple)
                for order, multiple in zip(part.base.tolist(), multiples, strict=True)
                if multiple
            ]
            if not factors:
                raise ValueError("a tone follows at least one angle")
            phasors.append(reduce(np.multiply, factors))
        rows += [phasor.real for phasor in phasors]
        rows += [phasor.imag for phasor in phasors]
    return np.array(rows)
