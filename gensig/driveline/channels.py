"""Signals of a line's channels: motions of its gears, and speeds that toothed wheels measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.engine_line import EngineLine
from gensig.driveline.line_gears import gear_dof
from gensig.driveline.running import RunningLine
from gensig.driveline.side_by_side.line_records import LineSignals
from gensig.driveline.time.newmark import LineMotion
from gensig.sensing.encoder import Disc
from gensig.sensing.toothed_wheel import ToothedWheel, instantaneous_speed
from gensig.systems.run import Run
from gensig.units import SPEED

Array = NDArray[np.float64]


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
