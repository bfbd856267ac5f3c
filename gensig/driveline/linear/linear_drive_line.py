"""A drive line as nuisances meet it: its meshes closed, each at its mean stiffness."""

from __future__ import annotations

import math

import numpy as np

from gensig.driveline.line_gears import gear_dof, gear_names, line_bodies, meshes_of
from gensig.driveline.running import RunningLine
from gensig.dynamics.linear_system import LinearSystem
from gensig.dynamics.response import GEAR_AXES, GearShaft, LinearMachine
from gensig.units import SPEED


def linear_line(
    running: RunningLine,
    followed: int,
    speed: float,
    channels: tuple[str, ...],
) -> LinearMachine:
    """A drive line whose meshes never part, losses viscous.

    Parameters
    ----------
    running : the line of a run, with its supports and its governor, at the set-point
    followed : number of the followed mesh
    speed : rad/s    of the shaft whose speed the configuration gives
    channels : names of all channels
    """
    matrices, system = running.matrices, running.dynamics.system
    stiffness, damping = system.closed(matrices.mesh_stiffness, matrices.mesh_damping)
    return LinearMachine(
        system=LinearSystem(
            mass=np.diag(system.mass),
            stiffness=stiffness,
            loss=matrices.loss_stiffness,
            damping=damping,
        ),
        shafts={
            gear: _shaft(running, followed, speed, gear)
            for gear in gear_names(running.machine.drive, followed)
        },
        channels={name: _dof(running, followed, name) for name in channels},
    )


def _shaft(running: RunningLine, followed: int, speed: float, gear: str) -> GearShaft:
    """Shaft of a gear.

    A gear drives where it drives its first mesh. The frames of the gears are right-handed, so that
    x turns to y as angles count.
    """
    drive, ratios = running.machine.drive, running.machine.ratios
    number = gear_names(drive, followed).index(gear)
    here = drive.line.gears[number]
    set_ratio = ratios[drive.numbers[here.node]]
    driving = drive.line.gears[drive.line.meshes[followed].driving]
    meshes = meshes_of(drive, number)
    force = max(abs(float(running.mesh_force[mesh])) for mesh in meshes)
    x, y, rotation = (gear_dof(running, followed, f"{gear}_{a}") for a in GEAR_AXES)
    return GearShaft(
        speed=set_ratio * speed,
        speed_ratio=set_ratio / ratios[drive.numbers[driving.node]],
        set_ratio=set_ratio,
        torque=force * here.base_radius,
        mesh_force=force,
        sense=math.copysign(1.0, float(drive.line.speed_ratio[here.node])),
        drives=drive.line.meshes[meshes[0]].driving == number,
        body=line_bodies(drive, followed)[gear],
        dofs=(x, y, rotation),
    )


def _dof(running: RunningLine, followed: int, channel: str) -> int:
    """Degree of freedom that a channel is of."""
    if not channel.endswith(SPEED):
        return gear_dof(running, followed, channel)
    wheel = running.machine.wheels[channel.removesuffix(SPEED)]
    return running.dof(wheel.node)
