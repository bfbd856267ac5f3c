"""A gear pair on its supports as a lumped system.

One mesh, a soft speed source, and optionally a motor and a load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import final

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.bodies import HOUSING, Bodies, Motion, Spring
from gensig.dynamics.equations import PAIR_SLIDE, Equations, Mesh
from gensig.dynamics.helical import AXIAL_DOFS, axial_reach, pitches
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.course import SetCourse, ShaftTorque
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import ConfigError
from gensig.mesh.tooth_table import ToothTable
from gensig.operation.setpoint import Operating
from gensig.units import split_unit, unit

PAIR_DOFS = (
    "pinion_x",
    "pinion_y",
    "pinion_rotation",
    "wheel_x",
    "wheel_y",
    "wheel_rotation",
)
# all that a machine may have; ``RunningPair.dofs`` lists its own
DOFS = (*PAIR_DOFS, *AXIAL_DOFS, "motor_rotation", "load_rotation")
APPROACH_SIGN = (0.0, -1.0, 1.0, 0.0, 1.0, -1.0)
# indices in PAIR_DOFS
PINION_X, PINION_Y, PINION_ROTATION, WHEEL_X, WHEEL_Y, WHEEL_ROTATION = range(6)
PINION_Z, WHEEL_Z = 6, 9  # of helical gears, each followed by its tilts


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """Bearings and shaft under one gear: x across the line of action, y along it.

    For helical gears also z along the axis and tilts about x and y.
    """

    stiffness_x: float = unit("n_per_m")
    stiffness_y: float = unit("n_per_m")
    damping_x: float = unit("ns_per_m")
    damping_y: float = unit("ns_per_m")
    stiffness_z: float = unit("n_per_m", default=0.0)
    damping_z: float = unit("ns_per_m", default=0.0)
    stiffness_tilt: float = unit("nm_per_rad", default=0.0)
    damping_tilt: float = unit("nms_per_rad", default=0.0)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value < 0.0:
                key = f"{field.name}_{field.metadata['unit']}"
                raise ConfigError(f"support.{key} = {value:g} must not be negative")

    def damped(self, body: Body, ratio_x: float, ratio_y: float) -> Support:
        """The support with c = 2 zeta sqrt(k m) for a gear on it alone.

        Axial and tilt damping take the mean of the two ratios.
        """
        mean = 0.5 * (ratio_x + ratio_y)
        tilt = math.sqrt(self.stiffness_tilt * body.tilt_inertia)
        return replace(
            self,
            damping_x=2.0 * ratio_x * math.sqrt(self.stiffness_x * body.mass),
            damping_y=2.0 * ratio_y * math.sqrt(self.stiffness_y * body.mass),
            damping_z=2.0 * mean * math.sqrt(self.stiffness_z * body.mass),
            damping_tilt=2.0 * mean * tilt,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Mass in kg, moment of inertia in kg m2 and support of a gear.

    ``tilt_inertia`` about a diameter in kg m2 is needed for helical gears.
    """

    mass: float
    inertia: float
    support: Support
    tilt_inertia: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotor:
    """A motor or a load: a disc coupled to the shaft of its gear.

    The coupling is a torsional spring and damper.
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
        root = math.sqrt(self.coupling_stiffness * joined)
        return 2.0 * self.coupling_damping_ratio * root


def solid_disc(
    radius: float, bore_radius: float, width: float, density: float
) -> tuple[float, float]:
    """Mass in kg and moment of inertia in kg m2 of a disc with a bore.

    For gears whose source prints none.
    """
    mass = density * math.pi * (radius**2 - bore_radius**2) * width
    return mass, 0.5 * mass * (radius**2 + bore_radius**2)


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class RunningPair:
    """A gear pair ready to be integrated.

    No slots: the equations are cached.
    """

    teeth: MeshTeeth
    pinion: Body
    wheel: Body
    operating: Operating
    motor: Rotor | None = None
    load: Rotor | None = None

    def __post_init__(self) -> None:
        pitches(self.table)
        if not self.is_helical:
            return
        for name, body in (("pinion", self.pinion), ("wheel", self.wheel)):
            axial, tilt = body.support.stiffness_z, body.support.stiffness_tilt
            if not min(body.tilt_inertia, axial, tilt) > 0.0:
                raise ConfigError(
                    f"gear.{name}: a helical pair needs support.stiffness_z_n_per_m = "
                    f"{axial:g}, stiffness_tilt_nm_per_rad = {tilt:g} and the inertia of "
                    f"tilting {body.tilt_inertia:g} kg m2 to be positive"
                )

    @property
    def table(self) -> ToothTable:
        """Tables of the teeth."""
        return self.teeth.table

    @property
    def is_helical(self) -> bool:
        """True if the gears move along their axes and tilt."""
        return not self.table.is_separable

    @property
    def gear_dofs(self) -> tuple[str, ...]:
        """The first degrees of freedom: those that the mesh force may act on."""
        if self.is_helical:
            return (*PAIR_DOFS, *AXIAL_DOFS)
        return PAIR_DOFS

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, in the order of every (dof,) array."""
        rotors = {"motor_rotation": self.motor, "load_rotation": self.load}
        present = [name for name, rotor in rotors.items() if rotor is not None]
        return (*self.gear_dofs, *present)

    @property
    def _ends(self) -> tuple[int, int]:
        """Degrees of freedom that the drive torque and the load torque act on."""
        driver, driven = PINION_ROTATION, WHEEL_ROTATION
        if self.motor is not None:
            driver = self.dofs.index("motor_rotation")
        if self.load is not None:
            driven = self.dofs.index("load_rotation")
        return driver, driven

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
    def mesh_frequency(self) -> float:
        """Tooth meshing frequency at the set speed, Hz."""
        return self.operating.speed / (2.0 * math.pi) * self.table.pair.pinion.n_teeth

    @cached_property
    def reduced_inertia(self) -> float:
        """Inertia of all rotating bodies, reduced to the pinion, kg m2."""
        return float(self.bodies.mass @ self.bodies.rotation**2)

    @property
    def drive_stiffness(self) -> float:
        """Torsional spring of the soft speed source, N m/rad."""
        return self.reduced_inertia * self._drive_rate**2

    @property
    def drive_damping(self) -> float:
        """Torsional damper of the soft speed source, N m s/rad."""
        ratio_and_inertia = self.operating.drive_damping_ratio * self.reduced_inertia
        return 2.0 * ratio_and_inertia * self._drive_rate

    @property
    def _drive_rate(self) -> float:
        """Circular frequency of the soft speed source on all rotating bodies, rad/s."""
        return 2.0 * math.pi * self.operating.drive_frequency

    @cached_property
    def bodies(self) -> Bodies:
        """Equations (1) of the spur paper with corrected signs, motor and load, without the mesh.

        Action and reaction on both gears, mesh force driving the wheel:
        ``docs/theory/motion.md``. The soft speed source is not among the springs.
        """
        wheel_speed = 1.0 / self.table.pair.ratio
        gears = ("pinion", self.pinion, 1.0), ("wheel", self.wheel, wheel_speed)
        plane = [motion for gear in gears for motion in _in_plane(*gear)]
        springs = [
            *_supports(PINION_X, self.pinion.support),
            *_supports(WHEEL_X, self.wheel.support),
        ]
        if self.is_helical:
            plane += [m for name, body, _ in gears for m in _along_axis(name, body)]
            springs += _axial_supports(PINION_Z, self.pinion.support)
            springs += _axial_supports(WHEEL_Z, self.wheel.support)
        for rotor, dof, gear in zip(
            (self.motor, self.load),
            self._ends,
            (PINION_ROTATION, WHEEL_ROTATION),
            strict=True,
        ):
            if rotor is not None:
                turning = plane[gear]
                plane.append(Motion(self.dofs[dof], rotor.inertia, turning.speed))
                damping = rotor.coupling_damping(turning.inertia)
                springs.append(Spring(dof, gear, rotor.coupling_stiffness, damping))
        return Bodies(motions=tuple(plane), springs=tuple(springs))

    @cached_property
    def dynamics(self) -> Dynamics:
        """The pair in motion; all torques follow the profile of the set torque."""
        torque, (driver, driven) = self.operating.torque, self._ends
        load = -torque * self.table.pair.ratio
        friction_torque = np.zeros(len(self.dofs))
        friction_torque[driver] = self._at_drive(self.friction_torque())
        return Dynamics(
            dofs=self.dofs,
            system=self.equations,
            nominal=SetCourse(operating=self.operating),
            torques=(
                ShaftTorque(dof=driver, table=np.array([self._at_drive(torque)])),
                ShaftTorque(dof=driven, table=np.array([load])),
            ),
            friction_torque=friction_torque,
            reference_force=np.array([self.mesh_force]),
        )

    def _at_drive(self, torque: float) -> float:
        """Force on the drive's degree of freedom that puts a torque on the pinion, N m.

        The soft speed source acts on the deviation from the set rotation, so it is a spring and a
        damper on the motor if there is one, else on the pinion. Its set angle leads by the wind-up
        of the mean torque, so that the mean deviation of the pinion is about 0.
        """
        if self.motor is None:
            return torque
        return torque + self.drive_stiffness * torque / self.motor.coupling_stiffness

    def approach_direction(self) -> Array:
        """Gradient of the approach along the line of action, (dof,)."""
        pair, direction = self.table.pair, np.zeros(len(self.dofs))
        direction[: len(PAIR_DOFS)] = APPROACH_SIGN
        direction[PINION_ROTATION] *= pair.pinion.base_radius
        direction[WHEEL_ROTATION] *= pair.wheel.base_radius
        if self.is_helical:
            direction[PINION_Z : len(self.gear_dofs)] = axial_reach(pair)
        return direction

    @cached_property
    def mean_mesh_stiffness(self) -> float:
        """Mean tangent stiffness of healthy teeth over one base pitch under the set torque, N/m."""
        return self.teeth.mean_stiffness(self.mesh_force)

    @property
    def mesh_damping(self) -> float:
        """Mean damping of the mesh along the line of action, N s/m."""
        root = math.sqrt(self.mean_mesh_stiffness * self.equivalent_mass)
        return 2.0 * self.table.options.damping_ratio * root

    @cached_property
    def equations(self) -> Equations:
        """The pair as numbers: one mesh, held by the soft speed source alone."""
        bodies, options, (driver, _) = self.bodies, self.table.options, self._ends
        n_touched, force = len(self.gear_dofs), self.mesh_force
        held = np.zeros(len(self.dofs))
        held[driver] = math.sqrt(self.drive_stiffness)
        slide = np.zeros(n_touched)
        slide[: len(PAIR_SLIDE)] = PAIR_SLIDE
        mesh = Mesh(
            name="pinion-wheel",
            teeth=self.teeth,
            touched=np.arange(n_touched),
            reach=self.approach_direction()[:n_touched],
            slide=slide,
            stiffness=self.mean_mesh_stiffness,
            damping=self.mesh_damping / (force if options.law == "one_sided" else 1.0),
            mean_force=force,
            speed=self.operating.speed,
        )
        return Equations(
            mass=bodies.mass,
            stiffness=bodies.stiffness,
            damping=bodies.damping,
            rotation=bodies.rotation,
            held=held,
            held_damping=self.drive_damping / self.drive_stiffness,
            meshes=(mesh,),
            sources=(),
            reference=PINION_ROTATION,
            angles=(PINION_ROTATION,),
        )

    def friction_torque(self) -> float:
        """Mean friction torque reduced to the pinion, N m."""
        return self.teeth.friction_torque(self.mesh_force)


def _in_plane(name: str, body: Body, speed: float) -> tuple[Motion, ...]:
    """Motions of a gear in its plane, in the order of ``PAIR_DOFS``."""
    return (
        Motion(f"{name}_x", body.mass),
        Motion(f"{name}_y", body.mass),
        Motion(f"{name}_rotation", body.inertia, speed),
    )


def _along_axis(name: str, body: Body) -> tuple[Motion, ...]:
    """Motions of a helical gear along its axis, in the order of ``AXIAL_DOFS``."""
    return (
        Motion(f"{name}_z", body.mass),
        Motion(f"{name}_tilt_x", body.tilt_inertia),
        Motion(f"{name}_tilt_y", body.tilt_inertia),
    )


def _supports(x: int, held: Support) -> tuple[Spring, ...]:
    """Springs to the housing of a gear whose motion along x has the number ``x``."""
    return (
        Spring(x, HOUSING, held.stiffness_x, held.damping_x),
        Spring(x + 1, HOUSING, held.stiffness_y, held.damping_y),
    )


def _axial_supports(z: int, held: Support) -> tuple[Spring, ...]:
    """Springs to the housing of a gear whose motion along z has the number ``z``."""
    return (
        Spring(z, HOUSING, held.stiffness_z, held.damping_z),
        Spring(z + 1, HOUSING, held.stiffness_tilt, held.damping_tilt),
        Spring(z + 2, HOUSING, held.stiffness_tilt, held.damping_tilt),
    )
