"""Signals of a line's channels: motions of its gears, and speeds that toothed wheels measure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.line_gears import gear_dof
from gensig.driveline.running import RunningLine
from gensig.driveline.time.newmark import LineMotion
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.sensing.encoder import Disc
from gensig.sensing.toothed_wheel import ToothedWheel, instantaneous_speed
from gensig.systems.run import Run
from gensig.units import SPEED

Channel = tuple[str, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineSignals:
    """Signals of a line by channel, (sample,), and the nominal motion of its reference.

    A channel is a kind, ``acceleration`` or ``angle``, and a degree of freedom; signals are
    deviations from nominal rotation in m/s2, rad/s2 or rad.
    """

    signals: dict[Channel, Array]
    nominal_angle: Array
    nominal_speed: Array


def line_signals(
    line: Dynamics, dofs: Sequence[str], acceleration: Array, angle: Array, rate: float
) -> LineSignals:
    """Signals of a motion of the two-evaluation core; angles are deviations.

    ``acceleration`` (dof, sample) of the degrees of freedom named, ``angle`` (angle, sample) of
    those that the line gives out, ``rate`` Hz.
    """
    nominal_angle, nominal_speed = line.nominal.over(np.arange(angle.shape[1]) / rate)
    signals: dict[Channel, Array] = {
        ("acceleration", line.dofs.index(name)): row
        for name, row in zip(dofs, acceleration, strict=True)
    }
    for dof, turned in zip(line.system.angles, angle, strict=True):
        signals["angle", dof] = turned - line.system.rotation[dof] * nominal_angle
    return LineSignals(
        signals=signals, nominal_angle=nominal_angle, nominal_speed=nominal_speed
    )


def channel(line: RunningLine, followed: int, name: str) -> tuple[str, int]:
    """Signal of the integration for a channel: a kind and a degree of freedom.

    ``followed`` is the number of the followed mesh.
    """
    if name.endswith(SPEED):
        return "angle", line.dof(wheel_of(line.machine, name)[1].node)
    return "acceleration", gear_dof(line, followed, name)


def channel_rows(
    run: Run[Any], line: RunningLine, motion: LineMotion | LineSignals, followed: int
) -> Array:
    """Signals of the channels with the gains of a run's gearbox, (channel, sample)."""
    sensing = run.system.sensing
    gains = np.ones(len(sensing.channels))
    if run.gearbox is not None:
        gains = run.gearbox.gain
    rows = []
    for name, gain in zip(sensing.channels, gains, strict=True):
        kind = channel(line, followed, name)
        if kind[0] == "angle":
            rate = sensing.sampling_rate
            rows.append(wheel_speed(run.discs, line, motion, name, rate))
        else:
            rows.append(gain * motion.signals[kind])
    return np.array(rows)


def wheel_of(engine: EngineLine, name: str) -> tuple[int, ToothedWheel]:
    """Number of a toothed wheel among those of the line, and the wheel, by its channel."""
    wanted = name.removesuffix(SPEED)
    return list(engine.wheels).index(wanted), engine.wheels[wanted]


def wheel_speed(
    discs: Sequence[Disc],
    line: RunningLine,
    motion: LineMotion | LineSignals,
    name: str,
    sampling_rate: float,
) -> Array:
    """Deviation from the nominal speed that a toothed wheel measures, (sample,) rad/s.

    Parameters
    ----------
    discs : the toothed wheels with their errors; perfect ones if there is none
    name : of the channel
    """
    number, wheel = wheel_of(line.machine, name)
    disc = Disc(index=0.0, line_angles=wheel.spacing * np.arange(float(wheel.n_teeth)))
    if discs:
        disc = discs[number]
    ratio = line.machine.ratios[wheel.node]
    deviation = motion.signals["angle", line.dof(wheel.node)]
    angle = ratio * (line.dynamics.turned + motion.nominal_angle) + deviation
    speed = instantaneous_speed(wheel, disc, angle, sampling_rate)
    return np.asarray(speed - ratio * motion.nominal_speed)
