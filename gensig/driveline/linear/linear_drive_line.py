"""A drive line as nuisances meet it: its meshes closed, each at its mean stiffness."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.line_gears import gear_dof, gear_names, line_bodies, meshes_of
from gensig.driveline.running import RunningLine, single_thread
from gensig.dynamics.linear_system import LinearSystem
from gensig.dynamics.response import GEAR_AXES, GearShaft, LinearMachine
from gensig.units import SPEED, check_choice

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class LinearDriveLine(LinearMachine):
    """A drive line whose meshes never part. No slots: its matrices are kept once they are made.

    Parameters
    ----------
    running : the line of a run, with its supports and its governor
    followed : number of the followed mesh
    speed : rad/s    of the shaft whose speed the configuration gives
    mesh_forces : (mesh,) N    mean ones at the set-point
    """

    running: RunningLine
    followed: int
    speed: float
    mesh_forces: Array

    @cached_property
    def closed(self) -> LinearSystem:
        """The line with a spring and a damper in every mesh, losses viscous."""
        matrices, system = self.running.matrices, self.running.dynamics.system
        stiffness, damping = system.closed(
            matrices.mesh_stiffness, matrices.mesh_damping
        )
        return LinearSystem(
            mass=np.diag(system.mass),
            stiffness=stiffness,
            loss=matrices.loss_stiffness,
            damping=damping,
        )

    def shaft(self, gear: str) -> GearShaft:
        """As ``LinearMachine.shaft``.

        A gear drives where it drives its first mesh. The frames of the gears are right-handed, so
        that x turns to y as angles count.
        """
        drive = self.running.machine.drive
        names = gear_names(drive, self.followed)
        check_choice("gear", gear, names)
        number = names.index(gear)
        here = drive.line.gears[number]
        ratios = self.running.machine.ratios
        set_ratio = ratios[drive.numbers[here.node]]
        driving = drive.line.gears[drive.line.meshes[self.followed].driving]
        meshes = meshes_of(drive, number)
        force = max(abs(float(self.mesh_forces[mesh])) for mesh in meshes)
        return GearShaft(
            speed=set_ratio * self.speed,
            speed_ratio=set_ratio / ratios[drive.numbers[driving.node]],
            set_ratio=set_ratio,
            torque=force * here.base_radius,
            mesh_force=force,
            sense=math.copysign(1.0, float(drive.line.speed_ratio[here.node])),
            drives=drive.line.meshes[meshes[0]].driving == number,
            body=line_bodies(drive, self.followed)[gear],
        )

    @single_thread
    def accelerations(
        self, gear: str, frequency: Array, force: Complex, channels: Sequence[str]
    ) -> Complex:
        """As ``LinearMachine.accelerations``.

        A toothed wheel answers with its speed, without the errors of its teeth.
        """
        once, place = np.unique(frequency, return_inverse=True)
        dofs = [gear_dof(self.running, self.followed, f"{gear}_{a}") for a in GEAR_AXES]
        unit = np.zeros((len(once), len(self.closed.mass)), dtype=np.complex128)
        answer = np.zeros((len(frequency), len(channels)), dtype=np.complex128)
        rows = [self._row(name) for name in channels]
        is_speed = np.array([name.endswith(SPEED) for name in channels])
        for axis, dof in enumerate(dofs):
            unit[:] = 0.0
            unit[:, dof] = 1.0
            motion = self.closed.response(unit, once)[:, rows]
            rate = 1j * once[:, None] * motion
            seen = np.where(is_speed, rate, 1j * once[:, None] * rate)
            answer += force[:, axis, None] * seen[place]
        return answer

    def _row(self, channel: str) -> int:
        """Degree of freedom that a channel is of."""
        if not channel.endswith(SPEED):
            return gear_dof(self.running, self.followed, channel)
        wheel = self.running.machine.wheels[channel.removesuffix(SPEED)]
        return self.running.dof(wheel.node)
