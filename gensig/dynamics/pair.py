"""A gear pair on its supports as a lumped system: six equations, one mesh, a soft speed source."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._mesh_kernels import FAR_NEAR
from gensig.dynamics.system import LumpedSystem
from gensig.errors import ConfigError
from gensig.mesh.load_distribution import PairStates, pair_states, static_mesh
from gensig.mesh.pair_table import PairTable
from gensig.operating import Operating
from gensig.units import split_unit, unit

Array = NDArray[np.float64]

DOFS = ("pinion_x", "pinion_y", "pinion_rotation", "wheel_x", "wheel_y", "wheel_rotation")
APPROACH_SIGN = (0.0, -1.0, 1.0, 0.0, 1.0, -1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """Bearings and shaft under one gear: x across the line of action, y along it."""

    stiffness_x: float = unit("n_per_m")
    stiffness_y: float = unit("n_per_m")
    damping_x: float = unit("ns_per_m")
    damping_y: float = unit("ns_per_m")

    def __post_init__(self) -> None:
        for key in ("stiffness_x_n_per_m", "stiffness_y_n_per_m", "damping_x_ns_per_m", "damping_y_ns_per_m"):
            value = getattr(self, split_unit(key)[0])
            if value < 0.0:
                raise ConfigError(f"support.{key} = {value:g} must not be negative")


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """What a gear weighs and how it is held."""

    mass: float
    inertia: float
    support: Support


def solid_disc(radius: float, bore_radius: float, width: float, density: float) -> tuple[float, float]:
    """Mass in kg and moment of inertia in kg m2 of a disc with a bore: for gears whose source prints none."""
    mass = density * math.pi * (radius**2 - bore_radius**2) * width
    return mass, 0.5 * mass * (radius**2 + bore_radius**2)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairDynamics:
    """Everything that decides the motion of one gear pair."""

    table: PairTable
    pinion: Body
    wheel: Body
    operating: Operating
    pinion_error: Array
    wheel_error: Array
    start_tooth_pinion: int
    start_tooth_wheel: int
    start_phase: float

    @property
    def equivalent_mass(self) -> float:
        """Both inertias reduced to the line of action, kg."""
        pair = self.table.pair
        return 1.0 / (pair.pinion.base_radius**2 / self.pinion.inertia + pair.wheel.base_radius**2 / self.wheel.inertia)

    @property
    def mesh_force(self) -> float:
        """Mean normal force of the set torque, N."""
        return self.operating.torque / self.table.pair.pinion.base_radius

    @property
    def start_roll(self) -> float:
        """Roll along the line of action at time 0, the first recorded sample, m."""
        return self.start_phase * self.table.pair.base_pitch

    @property
    def mesh_frequency(self) -> float:
        """Tooth meshing frequency at the set speed, Hz."""
        return self.operating.speed / (2.0 * math.pi) * self.table.pair.pinion.n_teeth

    def system(self) -> LumpedSystem:
        """Equations (1) of the spur paper with the signs put right, without the mesh.

        Action and reaction on both gears, mesh force driving the wheel: ``docs/theory/spur_dynamics.md``. The soft
        speed source acts on the deviation from the set rotation, so it is a spring and a damper there; its set angle
        leads by what the mean friction torque winds up, so that the mean deviation is about 0.
        """
        ratio = self.table.pair.ratio
        reduced = self.pinion.inertia + self.wheel.inertia / ratio**2
        omega = 2.0 * math.pi * self.operating.drive_frequency
        drive_stiffness = reduced * omega**2
        drive_damping = 2.0 * self.operating.drive_damping_ratio * reduced * omega
        p, w = self.pinion, self.wheel
        torque = self.operating.torque
        return LumpedSystem(
            names=DOFS,
            mass=np.array([p.mass, p.mass, p.inertia, w.mass, w.mass, w.inertia]),
            stiffness=np.diag(
                [
                    p.support.stiffness_x,
                    p.support.stiffness_y,
                    drive_stiffness,
                    w.support.stiffness_x,
                    w.support.stiffness_y,
                    0.0,
                ]
            ),
            damping=np.diag(
                [p.support.damping_x, p.support.damping_y, drive_damping, w.support.damping_x, w.support.damping_y, 0.0]
            ),
            force=np.array([0.0, 0.0, torque + self.friction_torque(), 0.0, 0.0, -torque * ratio]),
        )

    def approach_direction(self) -> Array:
        """Gradient of the approach along the line of action, (dof,)."""
        radii = np.array([1.0, 1.0, self.table.pair.pinion.base_radius, 1.0, 1.0, self.table.pair.wheel.base_radius])
        return np.array(APPROACH_SIGN) * radii

    def mean_mesh_stiffness(self) -> float:
        """Mean tangent stiffness of sound teeth over one base pitch under the set torque, N/m."""
        # tooth pairs away from a faulty tooth are the sound ones: average where most pairs are
        roll = self.table.pair.base_pitch * (np.arange(self.table.pair.pinion.n_teeth * 32) + 0.5) / 32
        return float(
            np.median(
                static_mesh(self.table, pair_states(self.table, roll), self.mesh_force).stiffness.reshape(-1, 32),
                axis=0,
            ).mean()
        )

    def numbers(self, step: float) -> tuple[float, ...]:
        """The mesh as numbers, in the order of the rows of ``_mesh_kernels.Group.numbers``."""
        table, options, pair = self.table, self.table.options, self.table.pair
        viscous = 2.0 * options.damping_ratio * math.sqrt(self.mean_mesh_stiffness() * self.equivalent_mass)
        return (
            pair.pinion.base_radius,
            pair.wheel.base_radius,
            pair.base_pitch,
            1.0 / pair.base_pitch,
            options.points_per_pitch / pair.base_pitch,
            pair.path_of_contact,
            pair.pitch_point,
            pair.start_curvature_radius,
            pair.tangent_length,
            table.shared_compliance,
            viscous / self.mesh_force if options.law == "one_sided" else viscous,
            options.friction_coefficient,
            2.0 / (options.friction_transition * pair.base_pitch),
            2.0 / (pair.pinion.base_radius * self.operating.speed * step),
            pair.backlash,
            self.start_roll,
            self.operating.speed,
            *self._near_positions(),
        )

    def _near_positions(self) -> tuple[float, float]:
        """Positions s outside of which no pair comes within ``FAR_NEAR`` of touching, m."""
        table = self.table
        nearest = [
            side.gap[side.present].min(axis=0) + error.min()
            for side, error in ((table.pinion, self.pinion_error), (table.wheel, self.wheel_error))
        ]
        near = np.flatnonzero(nearest[0] + nearest[1] < FAR_NEAR)
        first, last = max(near[0] - 1, 0), min(near[-1] + 1, len(table.position) - 1)
        return float(table.position[first]), float(table.position[last])

    def friction_torque(self) -> float:
        """Mean friction torque reduced to the pinion, from the static loads over one base pitch, N m."""
        pair = self.table.pair
        states = self._states(pair.base_pitch * (np.arange(64) + 0.5) / 64)
        loads = static_mesh(self.table, states, self.mesh_force).load
        arm = pair.start_curvature_radius + np.clip(states.position, 0.0, pair.path_of_contact)
        loss_arm = np.sign(states.position - pair.pitch_point) * (arm - (pair.tangent_length - arm) / pair.ratio)
        return self.table.options.friction_coefficient * float(np.mean((loads * loss_arm).sum(axis=1)))

    def static_start(self, time: float) -> Array:
        """Static equilibrium at a nominal time: deflected supports and the approach of the pairs in contact, (dof,)."""
        pair, force, system = self.table.pair, self.mesh_force, self.system()
        roll = self.start_roll + pair.pinion.base_radius * self.operating.speed * time
        approach = float(static_mesh(self.table, self._states(np.array([roll])), force).approach[0])
        start = np.zeros(len(system.mass))
        for dof, direction in ((1, 1.0), (4, -1.0)):
            if system.stiffness[dof, dof] > 0.0:
                start[dof] = direction * force / system.stiffness[dof, dof]
        closed = approach if math.isfinite(approach) else 0.0
        start[5] = (start[4] - start[1] - closed) / pair.wheel.base_radius
        return start

    def _states(self, roll: Array) -> PairStates:
        return pair_states(
            self.table, roll, start_tooth_pinion=self.start_tooth_pinion, start_tooth_wheel=self.start_tooth_wheel
        )
