"""Doubts on a plan: speeds, loads and noise that no machine has, and labels of one signal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gensig.dataset.plan import Plan
from gensig.dynamics.decimation import usable_band
from gensig.errors import GensigError
from gensig.life.root.root_stress import root_factors
from gensig.life.root.strength import Strength
from gensig.plan.equal_classes import equal_classes
from gensig.record.inputs import InputReader
from gensig.systems.base import Machine
from gensig.units import from_si

# dB; below, the machine is not heard even in an average over a thousand turns; above, the noise
# is smaller than the last digit of a float32
SNR_RANGE = (-40.0, 140.0)


def plan_doubts(reader: InputReader, plan: Plan) -> list[str]:
    """A line for each kind of value of a plan that makes no sense; the worst record is named."""
    columns = plan.columns

    def machine_of(column: str) -> Machine:
        """The machine of the record with the largest value of a column."""
        return reader.inputs(plan.record(int(np.argmax(columns[column])))).machine

    return [
        *_above_the_band(machine_of("speed_set_rpm")),
        *_too_strong(reader.strength, machine_of("torque_nm")),
        *_absurd_noise(columns["snr_db"]),
        *equal_classes(reader, plan),
    ]


def _above_the_band(machine: Machine) -> Iterator[str]:
    """A mesh that is faster than what a record of this rate can hold."""
    turns = machine.pinion_turns
    teeth = {name: gear.n_teeth for name, gear in machine.gears.items()}
    fastest = max(teeth[name] / turns[name] for name in teeth)
    mesh = fastest * machine.operating.speed / (2.0 * np.pi)
    rate = machine.sensing.sampling_rate
    highest = usable_band(rate)[1]
    if mesh > highest:
        speed = from_si("speed_rpm", machine.operating.speed)
        yield (
            f"at {speed:,.0f} r/min the mesh frequency is {mesh:,.0f} Hz, above the usable band "
            f"of {highest:,.0f} Hz at sensing.sampling_rate_hz = {rate:g}: no record holds it"
        )


def _too_strong(strength: Strength, machine: Machine) -> Iterator[str]:
    """A nominal root stress that no tooth bears."""
    bears = strength.bending_limit * strength.test_gear_stress_correction
    try:
        factors = root_factors(machine.pair, allow_extrapolation=True).values()
    except GensigError:
        return
    worst = max(factor.stress_per_force for factor in factors)
    stress = worst * machine.mesh_force * strength.load_factor
    if stress > bears:
        yield (
            f"at {machine.operating.torque:,.4g} N m the root of the teeth has "
            f"{1e-6 * stress:,.0f} MPa, and strength={strength.name} bears {1e-6 * bears:,.0f}: "
            "no such gears run; lower operating.torque_nm"
        )


def _absurd_noise(snr: np.ndarray) -> Iterator[str]:
    """Noise that drowns the machine, or that no record can hold."""
    low, high = SNR_RANGE
    known = snr[np.isfinite(snr)]
    for value in {*known[known < low][:1], *known[known > high][:1]}:
        yield (
            f"sensing.snr_db = {value:.4g}: usual are 0 to 40; below {low:g} nothing of the "
            f"machine is left, and above {high:g} a float32 holds none of the noise"
        )
