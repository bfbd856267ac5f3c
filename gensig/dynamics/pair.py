"""A gear pair on its supports as a lumped system.

One mesh, a soft speed source, a motor and a load if there are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._layout import FAR_NEAR
from gensig.dynamics.helical import AXIAL_DOFS, axial_reach, half_lag, pitches
from gensig.dynamics.mesh_statics import least_gaps, loss_arm, mean_mesh_stiffness
from gensig.dynamics.system import LumpedSystem, eigenvalues
from gensig.errors import ConfigError
from gensig.mesh.load_distribution import (
    PairStates,
    StaticMesh,
    pair_states,
    static_mesh,
)
from gensig.mesh.pair_table import PairTable
from gensig.mesh.sliced.sliced_statics import chord_equilibrium, chord_states
from gensig.mesh.sliced.sliced_table import SlicedTable
from gensig.operation.setpoint import Nominal, Operating
from gensig.units import split_unit, unit

Array = NDArray[np.float64]

PAIR_DOFS = (
    "pinion_x",
    "pinion_y",
    "pinion_rotation",
    "wheel_x",
    "wheel_y",
    "wheel_rotation",
)
# all that a machine may have; ``PairDynamics.dofs`` says which
DOFS = (*PAIR_DOFS, *AXIAL_DOFS, "motor_rotation", "load_rotation")
APPROACH_SIGN = (0.0, -1.0, 1.0, 0.0, 1.0, -1.0)
# a prime: no tooth is looked at where the last one was, so that few places a tooth show all of
# its path
FRICTION_PLACES = 509
PINION_X, PINION_Y, PINION_ROTATION, WHEEL_X, WHEEL_Y, WHEEL_ROTATION = range(
    6
)  # places in PAIR_DOFS
PINION_Z, WHEEL_Z = 6, 9  # of helical gears, each with its tilts behind it


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """Bearings and shaft under one gear: x across the line of action, y along it, and for helical
    gears z along the axis and tilts about x and y."""

    stiffness_x: float = unit("n_per_m")
    stiffness_y: float = unit("n_per_m")
    damping_x: float = unit("ns_per_m")
    damping_y: float = unit("ns_per_m")
    stiffness_z: float = unit("n_per_m", default=0.0)
    damping_z: float = unit("ns_per_m", default=0.0)
    stiffness_tilt: float = unit("nm_per_rad", default=0.0)
    damping_tilt: float = unit("nms_per_rad", default=0.0)

    def __post_init__(self) -> None:
        for name, suffixes in (
            ("stiffness", ("n_per_m", "nm_per_rad")),
            ("damping", ("ns_per_m", "nms_per_rad")),
        ):
            keys = [
                f"{name}_{axis}_{suffixes[axis == 'tilt']}"
                for axis in ("x", "y", "z", "tilt")
            ]
            for key in keys:
                value = getattr(self, split_unit(key)[0])
                if value < 0.0:
                    raise ConfigError(f"support.{key} = {value:g} must not be negative")

    def damped(self, body: Body, ratio_x: float, ratio_y: float) -> Support:
        """The support with c = 2 zeta sqrt(k m) for a gear on it alone; along the axis and
        against tilting with the mean of the two ratios."""
        mean = 0.5 * (ratio_x + ratio_y)
        return replace(
            self,
            damping_x=2.0 * ratio_x * math.sqrt(self.stiffness_x * body.mass),
            damping_y=2.0 * ratio_y * math.sqrt(self.stiffness_y * body.mass),
            damping_z=2.0 * mean * math.sqrt(self.stiffness_z * body.mass),
            damping_tilt=2.0
            * mean
            * math.sqrt(self.stiffness_tilt * body.tilt_inertia),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """What a gear weighs and how it is held.

    ``tilt_inertia`` about a diameter in kg m2 is asked of helical gears.
    """

    mass: float
    inertia: float
    support: Support
    tilt_inertia: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotor:
    """A motor or a load.

    A disc that a coupling, a torsional spring and damper, holds to the shaft of its gear.
    """

    inertia: float = unit("kg_m2")
    coupling_stiffness: float = unit("nm_per_rad")
    coupling_damping_ratio: float

    def __post_init__(self) -> None:
        for key in (
            "inertia_kg_m2",
            "coupling_stiffness_nm_per_rad",
            "coupling_damping_ratio",
        ):
            value = getattr(self, split_unit(key)[0])
            if not value > 0.0:
                raise ConfigError(f"rotor.{key} = {value:g} must be positive")

    def coupling_damping(self, gear_inertia: float) -> float:
        """Damping of the coupling for its ratio on the two inertias it joins, N m s/rad."""
        joined = self.inertia * gear_inertia / (self.inertia + gear_inertia)
        return (
            2.0
            * self.coupling_damping_ratio
            * math.sqrt(self.coupling_stiffness * joined)
        )


def solid_disc(
    radius: float, bore_radius: float, width: float, density: float
) -> tuple[float, float]:
    """Mass in kg and moment of inertia in kg m2 of a disc with a bore.

    For gears whose source prints none.
    """
    mass = density * math.pi * (radius**2 - bore_radius**2) * width
    return mass, 0.5 * mass * (radius**2 + bore_radius**2)


@dataclass(frozen=True, kw_only=True, eq=False)
class PairDynamics:
    """Everything that decides the motion of one gear pair. No slots: the equations are kept once
    they are made.

    ``pinion_error``, ``wheel_error`` (tooth,) m open the gaps of their teeth at the pitch point,
    ``pinion_tilt``, ``wheel_tilt`` (tooth,) m/m by as much more for every metre that the contact
    is further along the path.
    """

    table: PairTable | SlicedTable
    pinion: Body
    wheel: Body
    operating: Operating
    pinion_error: Array
    wheel_error: Array
    pinion_tilt: Array
    wheel_tilt: Array
    start_tooth_pinion: int
    start_tooth_wheel: int
    start_phase: float
    motor: Rotor | None = None
    load: Rotor | None = None

    def __post_init__(self) -> None:
        pitches(self.table)
        if not self.is_helical:
            return
        for name, body in (("pinion", self.pinion), ("wheel", self.wheel)):
            support = body.support
            if not (
                body.tilt_inertia > 0.0
                and support.stiffness_z > 0.0
                and support.stiffness_tilt > 0.0
            ):
                raise ConfigError(
                    f"gear.{name}: a helical pair needs support.stiffness_z_n_per_m = {support.stiffness_z:g}, "
                    f"stiffness_tilt_nm_per_rad = {support.stiffness_tilt:g} and the inertia of tilting "
                    f"{body.tilt_inertia:g} kg m2 to be positive"
                )

    @property
    def is_helical(self) -> bool:
        """Whether the gears move along their axes and tilt."""
        return isinstance(self.table, SlicedTable)

    @property
    def gear_dofs(self) -> tuple[str, ...]:
        """The first degrees of freedom: those that the mesh may push."""
        return (*PAIR_DOFS, *AXIAL_DOFS) if self.is_helical else PAIR_DOFS

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, in the order of every (dof,) array."""
        rotors = (("motor_rotation", self.motor), ("load_rotation", self.load))
        return (*self.gear_dofs, *[name for name, rotor in rotors if rotor is not None])

    @property
    def _ends(self) -> tuple[int, int]:
        """Degrees of freedom that the drive and the load torque act on."""
        driver = (
            PINION_ROTATION if self.motor is None else self.dofs.index("motor_rotation")
        )
        return driver, WHEEL_ROTATION if self.load is None else self.dofs.index(
            "load_rotation"
        )

    @property
    def equivalent_mass(self) -> float:
        """Inertias of the two gears reduced to the line of action, kg."""
        pair = self.table.pair
        return 1.0 / (
            pair.pinion.base_radius**2 / self.pinion.inertia
            + pair.wheel.base_radius**2 / self.wheel.inertia
        )

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

    @property
    def driven_inertia(self) -> float:
        """Inertia of the wheel and its load, kg m2."""
        return self.wheel.inertia + (0.0 if self.load is None else self.load.inertia)

    @property
    def reduced_inertia(self) -> float:
        """Inertia of all that turns, reduced to the pinion, kg m2."""
        driving = self.pinion.inertia + (
            0.0 if self.motor is None else self.motor.inertia
        )
        return driving + self.driven_inertia / self.table.pair.ratio**2

    @property
    def drive_stiffness(self) -> float:
        """Torsional spring of the soft speed source, N m/rad."""
        return self.reduced_inertia * self._drive_rate**2

    @property
    def _drive_rate(self) -> float:
        """Circular frequency of the soft speed source on all that turns, rad/s."""
        return 2.0 * math.pi * self.operating.drive_frequency

    def system(self) -> LumpedSystem:
        """Equations (1) of the spur paper with the signs put right, without the mesh, and those
        of motor and load.

        Action and reaction on both gears, mesh force driving the wheel:
        ``docs/theory/spur_dynamics.md``. The soft speed source acts on the deviation from the set
        rotation, so it is a spring and a damper there, of the motor if there is one, else of the
        pinion; its set angle leads by what the mean torque winds up, so that the mean deviation
        of the pinion is about 0.
        """
        return self._system

    @cached_property
    def _system(self) -> LumpedSystem:
        dofs, p, w, ratio = self.dofs, self.pinion, self.wheel, self.table.pair.ratio
        mass, rotation, force = np.zeros((3, len(dofs)))
        stiffness, damping = np.zeros((2, len(dofs), len(dofs)))
        mass[: len(PAIR_DOFS)] = p.mass, p.mass, p.inertia, w.mass, w.mass, w.inertia
        rotation[PINION_ROTATION], rotation[WHEEL_ROTATION] = 1.0, 1.0 / ratio
        for x, support in ((PINION_X, p.support), (WHEEL_X, w.support)):
            stiffness[[x, x + 1], [x, x + 1]] = support.stiffness_x, support.stiffness_y
            damping[[x, x + 1], [x, x + 1]] = support.damping_x, support.damping_y
        for z, body in ((PINION_Z, p), (WHEEL_Z, w)) if self.is_helical else ():
            mass[z : z + 3] = body.mass, body.tilt_inertia, body.tilt_inertia
            held, axes = body.support, np.arange(z, z + 3)
            stiffness[axes, axes] = (
                held.stiffness_z,
                held.stiffness_tilt,
                held.stiffness_tilt,
            )
            damping[axes, axes] = held.damping_z, held.damping_tilt, held.damping_tilt
        driver, driven = self._ends
        for rotor, place, gear in (
            (self.motor, driver, PINION_ROTATION),
            (self.load, driven, WHEEL_ROTATION),
        ):
            if rotor is not None:
                mass[place], rotation[place] = rotor.inertia, rotation[gear]
                _couple(stiffness, place, gear, rotor.coupling_stiffness)
                _couple(damping, place, gear, rotor.coupling_damping(mass[gear]))
        drive_stiffness, reduced = self.drive_stiffness, self.reduced_inertia
        stiffness[driver, driver] += drive_stiffness
        damping[driver, driver] += (
            2.0 * self.operating.drive_damping_ratio * reduced * self._drive_rate
        )
        force[driver] = self.operating.torque + self.friction_torque()
        if self.motor is not None:
            force[driver] += (
                drive_stiffness * force[driver] / self.motor.coupling_stiffness
            )
        force[driven] = -self.operating.torque * ratio
        return LumpedSystem(
            names=dofs,
            mass=mass,
            stiffness=stiffness,
            damping=damping,
            force=force,
            rotation=rotation,
        )

    def nominal(self, times: Array) -> Nominal:
        """Nominal motion of the pinion and share of the set torque at times in s, (time,)."""
        return self.operating.nominal(times)

    def approach_direction(self) -> Array:
        """Gradient of the approach along the line of action, (dof,)."""
        direction = np.zeros(len(self.dofs))
        radii = np.array(
            [
                1.0,
                1.0,
                self.table.pair.pinion.base_radius,
                1.0,
                1.0,
                self.table.pair.wheel.base_radius,
            ]
        )
        direction[: len(PAIR_DOFS)] = np.array(APPROACH_SIGN) * radii
        if self.is_helical:
            direction[len(PAIR_DOFS) : len(self.gear_dofs)] = axial_reach(
                self.table.pair
            )
        return direction

    @cached_property
    def mean_mesh_stiffness(self) -> float:
        """Mean tangent stiffness of sound teeth over one base pitch under the set torque, N/m."""
        return mean_mesh_stiffness(self.table, self.mesh_force)

    @property
    def mesh_damping(self) -> float:
        """Damper along the line of action that the mesh's damping is on average, N s/m."""
        return (
            2.0
            * self.table.options.damping_ratio
            * math.sqrt(self.mean_mesh_stiffness * self.equivalent_mass)
        )

    @cached_property
    def stiff_rates(self) -> NDArray[np.complex128]:
        """Eigenvalues with the mesh held somewhat above its mean stiffness, 1/s."""
        return eigenvalues(
            self.system(), self.approach_direction(), 1.2 * self.mean_mesh_stiffness
        )

    def numbers(self, step: float, rest: Array) -> tuple[float, ...]:
        """The mesh as numbers, in the order of the rows of ``_layout.Group.numbers``."""
        table, options, pair = self.table, self.table.options, self.table.pair
        viscous, lag = self.mesh_damping, half_lag(table)
        return (
            pair.pinion.base_radius,
            pair.wheel.base_radius,
            pair.path_of_contact,
            pair.pitch_point,
            pair.start_curvature_radius,
            pair.tangent_length,
            table.shared_compliance,
            viscous / self.mesh_force if options.law == "one_sided" else viscous,
            options.friction_coefficient,
            2.0 / (options.friction_transition * pair.base_pitch + 2.0 * lag),
            2.0 / (pair.pinion.base_radius * self.operating.speed * step),
            pair.backlash,
            self.mesh_force,
            float(self.approach_direction() @ rest),
            lag,
            pair.pitch_point + lag,
        )

    def exact_numbers(self) -> tuple[float, ...]:
        """What decides where pairs stand, in the order of the rows of ``_layout.Group.exact``."""
        options, pair = self.table.options, self.table.pair
        near = (
            self._near_positions()
            if options.law == "one_sided"
            else (-math.inf, math.inf)
        )
        return (
            pair.pinion.base_radius,
            pair.base_pitch,
            1.0 / pair.base_pitch,
            options.points_per_pitch / pair.base_pitch,
            self.start_roll,
            *near,
            pitches(self.table)[0] * pair.base_pitch,
        )

    def _near_positions(self) -> tuple[float, float]:
        """Positions s outside of which no pair comes within ``FAR_NEAR`` of touching, m."""
        table = self.table
        beyond = table.position - table.pair.pitch_point - half_lag(table)
        teeth = (
            (self.pinion_error, self.pinion_tilt),
            (self.wheel_error, self.wheel_tilt),
        )
        nearest = [
            flank + error.min() + np.minimum(tilt.min() * beyond, tilt.max() * beyond)
            for flank, (error, tilt) in zip(least_gaps(table), teeth, strict=True)
        ]
        near = np.flatnonzero(nearest[0] + nearest[1] < FAR_NEAR)
        if len(near) == 0:  # every pair may be as near as any other
            return float(table.position[0]), float(table.position[-1])
        first, last = max(near[0] - 1, 0), min(near[-1] + 1, len(table.position) - 1)
        return float(table.position[first]), float(table.position[last])

    def friction_torque(self) -> float:
        """Mean friction torque reduced to the pinion, from the static loads over one turn of the
        wheel, N m.
        """
        pair = self.table.pair
        places = (np.arange(FRICTION_PLACES) + 0.5) / FRICTION_PLACES
        position, static = self._statics(
            pair.base_pitch * pair.wheel.n_teeth * places, self.mesh_force
        )
        return self.table.options.friction_coefficient * float(
            np.mean((static.load * loss_arm(self.table, position)).sum(axis=1))
        )

    def rest(self) -> Array:
        """Deflections of supports and couplings about which the machine moves.

        The pinion has not turned, (dof,).
        """
        start = self.static_start(0.0)
        return np.asarray(start - self.system().rotation * start[PINION_ROTATION])

    def static_start(self, time: float) -> Array:
        """Equilibrium at a nominal time: deflected supports and couplings, approach of the pairs
        in contact, (dof,).

        Under a nominal acceleration it is that of the accelerated machine; a ripple is too quick
        to be at rest with.
        """
        pair, system, (driver, driven) = self.table.pair, self.system(), self._ends
        nominal, smooth = (
            one.nominal(np.array([time]))
            for one in (self.operating, self.operating.without_ripple)
        )
        factor, acceleration = (
            float(nominal.torque_factor[0]),
            float(smooth.acceleration[0]),
        )
        wheel_acceleration = acceleration / pair.ratio
        force = (
            factor * self.mesh_force
            + wheel_acceleration * self.driven_inertia / pair.wheel.base_radius
        )
        start = np.zeros(len(system.mass))
        start[PINION_ROTATION] -= acceleration / self._drive_rate**2
        if self.motor is not None:
            lead = factor * system.force[driver] / system.stiffness[driver, driver]
            start[driver] = start[PINION_ROTATION] + lead
            driven_inertia = self.reduced_inertia - self.motor.inertia
            start[PINION_ROTATION] -= (
                acceleration * driven_inertia / self.motor.coupling_stiffness
            )
        advance = pair.pinion.base_radius * start[PINION_ROTATION]
        elapsed = float(self.operating.time_at_set_speed(np.array([time]))[0])
        roll = (
            self.start_roll
            + pair.pinion.base_radius * self.operating.speed * elapsed
            + advance
        )
        approach = float(self._statics(np.array([roll]), force)[1].approach[0])
        axial, reach = (
            range(len(PAIR_DOFS), len(self.gear_dofs)),
            self.approach_direction(),
        )
        for dof in (PINION_Y, WHEEL_Y, *axial):
            if system.stiffness[dof, dof] > 0.0:
                start[dof] = -reach[dof] * force / system.stiffness[dof, dof]
        closed = approach if math.isfinite(approach) else 0.0
        pushed = start[WHEEL_Y] - start[PINION_Y]
        for dof in axial:
            pushed += reach[dof] * start[dof]
        start[WHEEL_ROTATION] = (pushed - closed + advance) / pair.wheel.base_radius
        if self.load is not None:
            torque = (
                factor * system.force[driven] - wheel_acceleration * self.load.inertia
            )
            start[driven] = (
                start[WHEEL_ROTATION] + torque / self.load.coupling_stiffness
            )
        return start

    def _statics(self, roll: Array, force: float) -> tuple[Array, StaticMesh]:
        """Positions s of the pairs at some rolls, (phase, pair) m, and their equilibrium under a
        force in N.
        """
        if isinstance(self.table, SlicedTable):
            chords = chord_states(self.table, roll, **self._teeth)
            return chords.position, chord_equilibrium(self.table, chords, force)
        states = self._states(roll)
        return states.position, static_mesh(self.table, states, force)

    def _states(self, roll: Array) -> PairStates:
        assert isinstance(self.table, PairTable)
        return pair_states(self.table, roll, **self._teeth)

    @property
    def _teeth(self) -> dict[str, Any]:
        """Which teeth meet, and their errors, as the statics ask for them."""
        names = (
            "start_tooth_pinion",
            "start_tooth_wheel",
            "pinion_error",
            "wheel_error",
            "pinion_tilt",
            "wheel_tilt",
        )
        return {name: getattr(self, name) for name in names}


def _couple(matrix: Array, one: int, other: int, value: float) -> None:
    """Put a spring or a damper between two degrees of freedom."""
    matrix[[one, other], [one, other]] += value
    matrix[[one, other], [other, one]] -= value
